"""Poses measured where vehicles stand: a table or a list in JSON, to plain numbers, each with its place in the text.

in   CSV with the columns ``agent``, ``x``, ``y``, ``z`` and, if there is one, ``yaw``; or JSON, a list of records
     with these keys
out  one row for each agent
says MC004 MC033 MC034
"""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass
from missionc.base.limits import Limits
from missionc.base.plain_number import is_number
from missionc.base.source import Source, Span
from missionc.base.strict_json import NotJsonError, parse_json
from missionc.diagnostics.model import Diagnostic
from missionc.maps.companions import ending
from missionc.maps.feature import MapError, unreadable, unusable
from missionc.maps.table import read_table

NEEDED = ("agent", "x", "y", "z")
KNOWN = (*NEEDED, "yaw")


@dataclass(frozen=True, slots=True)
class PoseRow:
    """Where an agent was measured: x, y and z in metres. A ``yaw`` beside them, in radians, is read and left out."""

    span: Span
    agent: str
    position: tuple[float, ...]


def pose_table(source: Source, limits: Limits) -> list[PoseRow] | Diagnostic:
    """The rows, in the order of the file; agents of the same name may be among them."""
    whole = Span(source, 0, len(source.text)).first_line
    try:
        if ending(source.name) == ".json":
            return _listed(source, whole, limits)
        if ending(source.name) != ".csv":
            raise unreadable(source, "measured poses are a table or a list", whole, "name a `.csv` or a `.json`")
        rows = []
        for row in read_table(source, whole, KNOWN, NEEDED, limits):
            if not row.cells.get("agent"):
                raise row.wrong("column `agent` is empty here", "write the name of an agent in it")
            if "yaw" in row.cells:
                row.number("yaw")
            rows.append(PoseRow(row.span, row.cells["agent"], row.numbers("x", "y", "z")))
        return rows
    except MapError as error:
        return error.finding


def _listed(source: Source, whole: Span, limits: Limits) -> list[PoseRow]:
    form = "a list of records with `agent`, `x`, `y`, `z`"
    try:
        value = parse_json(source.text, limits.json_values)
    except NotJsonError as error:
        raise unreadable(source, error.reason, Span(source, error.place, error.place), f"give {form}") from None
    if not isinstance(value, list) or not value:
        raise unusable(f"`{source.name}` is no list of poses", whole, f"give {form}")
    rows = []
    for number, record in enumerate(value, 1):
        strange = set(record) - set(KNOWN) if isinstance(record, dict) else {""}
        if strange or not isinstance(record.get("agent"), str):
            raise unusable(f"`{source.name}`: record {number} is no pose", whole, f"give {form}")
        for key in (*NEEDED[1:], *(["yaw"] if "yaw" in record else [])):
            measured = record.get(key)
            if not is_number(measured) or abs(measured) > limits.magnitude:
                raise unusable(f"`{source.name}`: `{key}` of record {number} is no number", whole, "write a number")
        rows.append(PoseRow(whole, record["agent"], tuple(float(record[key]) for key in NEEDED[1:])))
    return rows
