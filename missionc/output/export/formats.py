"""The table of export formats for verified flights.

in   Flight
out  Exported: files by name; or why this form cannot hold the flight
says MC404 MC712

A form is data: its name, a sentence, and a function; ``form_names`` says which there are.
"""

from __future__ import annotations

from missionc.output.export.export_form import Exported, Format
from missionc.output.export.form_names import FORMATS
from missionc.output.export.verified_flight import Flight, flight

__all__ = ["FORMATS", "Exported", "Flight", "Format", "flight"]
