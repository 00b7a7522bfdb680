"""Tables of points: starts, finishes, places in a formation, and routes with their times.

in   CSV
out  rows of plain numbers, each with its place in the text
"""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.diagnostics.model import Diagnostic
from missionc.maps.companions import ending
from missionc.maps.feature import MapError, unreadable
from missionc.maps.table import read_table


@dataclass(frozen=True, slots=True)
class PointRow:
    """``time`` in seconds, 0 where there are none; two or three coordinates in metres."""

    span: Span
    time: float
    position: tuple[float, ...]


def point_table(source: Source, asked: Span, limits: Limits, *, timed: bool = False) -> list[PointRow] | Diagnostic:
    """The rows of a table with the columns ``x``, ``y``, in a volume ``z``, and ``t`` if ``timed``.

    Args:
        asked: the words that ask for the file.
    """
    columns = ("t", "x", "y", "z") if timed else ("name", "x", "y", "z")
    try:
        if ending(source.name) != ".csv":
            raise unreadable(source, "a list of points is a table", asked, "give a file whose name ends in `.csv`")
        rows = read_table(source, asked, columns, columns[not timed : 3], limits)
        return [
            PointRow(
                row.span,
                row.number("t") if timed else 0.0,
                row.numbers("x", "y", *(["z"] if "z" in row.cells else [])),
            )
            for row in rows
        ]
    except MapError as error:
        return error.finding
