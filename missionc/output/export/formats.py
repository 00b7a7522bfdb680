"""The table of export formats for verified flights: the only place where one is registered.

in   Flight
out  Exported: files by name; or why this form cannot hold the flight
says MC404 MC712

A form is data: its name, a sentence, and a function. The tuple here is the only registration.
"""

from __future__ import annotations

from missionc.output.export import (
    cflib,
    crazyswarm2,
    mcap,
    px4,
    ros2,
    skybrush,
)
from missionc.output.export.export_form import Exported, Format
from missionc.output.export.verified_flight import Flight, flight

__all__ = ["FORMATS", "Exported", "Flight", "Format", "flight"]

FORMATS: dict[str, Format] = {
    form.name: form
    for form in (crazyswarm2.FORMAT, cflib.FORMAT, skybrush.FORMAT, mcap.FORMAT, ros2.FORMAT, px4.FORMAT)
}
"""Every form by its name."""
