"""Export formats for verified flights.

in   Flight
out  Exported: files by name; or why the format cannot represent the flight
says MC404 MC712

A format is data: a name, a sentence, and a function; ``form_names`` lists all of them.
"""

from __future__ import annotations

from missionc.output.export.export_form import Exported, Format
from missionc.output.export.form_names import FORMATS
from missionc.output.export.verified_flight import Flight, flight

__all__ = ["FORMATS", "Exported", "Flight", "Format", "flight"]
