"""CSV tables as rows of numbers, each with its location in the text: points, and measured poses.

    in   the text, the allowed columns
    out  rows
    says MC004 MC033 MC034

A CSV table begins with a row of column names. Rows of points are starts, finishes, offsets in a formation, and paths
with their times.

Poses are measured at the pads of vehicles, one row for each agent. They are a CSV with the columns ``agent``, ``x``,
``y``, ``z`` and optionally ``yaw``, or a list in JSON of records with these keys.

Source:
    RFC 4180.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from io import StringIO
from itertools import accumulate

from missionc.base.diagnostics.map_error import MapError, too_many, unreadable, unusable
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.suggest import suggestion
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span, line_ends
from missionc.base.strict_json import NotJsonError, parse_json
from missionc.base.units import is_number, plain_number
from missionc.frontend.maps.map_metadata import ending

TEXTS = frozenset({"name", "kind"})
"""Names of the columns that contain text instead of numbers."""


class Row(Record):
    """One row of a CSV table, as texts by column; empty cells are omitted."""

    span: Span
    cells: dict[str, str]
    limits: Limits

    def number(self, column: str) -> float:
        """Number in a column of the row.

        Raises:
            MapError: the row has no number there.
        """
        text = self.cells.get(column, "")
        value = plain_number(text)
        if not text:
            raise self.wrong(f"column `{column}` is empty here", "write a number")
        if not abs(value) <= self.limits.magnitude:
            raise self.wrong(
                f"`{text[:40]}` in column `{column}` is not a number or is too large", "write a plain number"
            )
        return value

    def numbers(self, *columns: str) -> tuple[float, ...]:
        return tuple(self.number(column) for column in columns)

    def wrong(self, reason: str, way_out: str) -> MapError:
        return unusable(f"`{self.span.source.name}`: {reason}", self.span, way_out)


def read_table(source: Source, asked: Span, known: Sequence[str], needed: Sequence[str], limits: Limits) -> list[Row]:
    """Rows of a CSV table.

    Args:
        asked: the words that request the file.
        known: the allowed columns.
        needed: the required columns.

    Raises:
        MapError: the file is no such table.
    """
    rows_at_most = line_ends(source.text.rstrip())
    if rows_at_most > limits.map_features:
        raise too_many(source, "rows", "map_features", rows_at_most, limits, asked)
    lines = list(_lines(source))
    if not lines:
        reason = "it is empty" if source.text.strip() else "no UTF-8 text"
        raise unreadable(source, reason, asked, "use comma-separated values")
    header, *rows = lines
    names = [name.strip().lower() for name in header[1]]
    _check_header(source, header[0], names, known, needed)
    if not rows:
        raise unusable(f"`{source.name}` has no rows", header[0], "add rows below the header")
    for span, cells in rows:
        if len(cells) != len(names):
            reason = f"`{source.name}`: this row has {len(cells)} values, but the header has {len(names)} columns"
            raise unusable(reason, span, "write one value for each column")
    return [
        Row(span, {name: cell.strip() for name, cell in zip(names, cells, strict=True) if cell.strip()}, limits)
        for span, cells in rows
    ]


def _lines(source: Source) -> Iterator[tuple[Span, list[str]]]:
    """Yield the cells of each row that is not empty, with the source location of its beginning.

    Raises:
        MapError: the text is not CSV.
    """
    lines = StringIO(source.text, newline="").readlines()
    starts = [0, *accumulate(map(len, lines))]
    reader, before = csv.reader(lines, strict=True), 0
    try:
        for cells in reader:
            first, before = before, reader.line_num
            if any(cell.strip() for cell in cells):
                yield Span(source, starts[first], starts[first] + len(lines[first].rstrip("\r\n"))), cells
    except csv.Error:
        place = starts[before]
        raise unreadable(source, "not valid CSV", Span(source, place, place), "check the quotes of this row") from None


def _check_header(source: Source, span: Span, names: list[str], known: Sequence[str], needed: Sequence[str]) -> None:
    takes = ", ".join(f"`{name}`" for name in known)
    other = next((sign for sign in (";", "\t") if len(names) == 1 and sign in names[0]), "")
    if other:
        sign = "tabs" if other == "\t" else f"`{other}`"
        raise unusable(
            f"`{source.name}`: values are separated by {sign}, not by commas", span, "separate the values with commas"
        )
    for name in names:
        if name not in known:
            meant = suggestion(name, known, f"use one of the columns {takes}")
            raise unusable(f"`{source.name}`: unknown column `{name[:40]}`", span, meant)
    twice = next((name for at, name in enumerate(names) if name in names[:at]), "")
    if twice:
        raise unusable(f"`{source.name}`: duplicate column `{twice}`", span, "delete one of the columns")
    missing = next((name for name in needed if name not in names), "")
    if missing:
        raise unusable(f"`{source.name}`: missing column `{missing}`", span, f"add the column `{missing}`")


class PointRow(Record):
    """Row of a table of points: ``time`` in seconds, 0 if absent, and two or three coordinates in metres."""

    span: Span
    time: float
    position: tuple[float, ...]


def point_table(source: Source, asked: Span, limits: Limits, *, timed: bool = False) -> list[PointRow] | Diagnostic:
    """Rows of a table with the columns ``x``, ``y``, optionally ``z``, and ``t`` if ``timed``, or a finding about an
    error.

    Args:
        asked: the words that request the file.
    """
    columns = ("t", "x", "y", "z") if timed else ("name", "x", "y", "z")
    try:
        if ending(source.name) != ".csv":
            raise unreadable(source, "expected a table of points", asked, "name a `.csv` file")
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


NEEDED = ("agent", "x", "y", "z")
KNOWN = (*NEEDED, "yaw")


class PoseRow(Record):
    """Measured position of an agent: x, y and z in metres; a ``yaw`` in the file is checked and ignored."""

    span: Span
    agent: str
    position: tuple[float, ...]


def pose_table(source: Source, limits: Limits) -> list[PoseRow] | Diagnostic:
    """Measured positions in the order of the file, or a finding about an error; agents may occur several times."""
    whole = Span(source, 0, len(source.text)).first_line
    try:
        if ending(source.name) == ".json":
            return _listed(source, whole, limits)
        if ending(source.name) != ".csv":
            raise unreadable(source, "expected a table or a list of poses", whole, "name a `.csv` or `.json` file")
        rows = []
        for row in read_table(source, whole, KNOWN, NEEDED, limits):
            if not row.cells.get("agent"):
                raise row.wrong("column `agent` is empty here", "write the name of an agent")
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
        raise unreadable(source, error.reason, Span(source, error.place, error.place), f"write {form}") from None
    if not isinstance(value, list) or not value:
        raise unusable(f"`{source.name}` is not a list of poses", whole, f"write {form}")
    rows = []
    for number, record in enumerate(value, 1):
        strange = set(record) - set(KNOWN) if isinstance(record, dict) else {""}
        if strange or not isinstance(record.get("agent"), str):
            raise unusable(f"`{source.name}`: record {number} is not a pose", whole, f"write {form}")
        for key in (*NEEDED[1:], *(["yaw"] if "yaw" in record else [])):
            measured = record.get(key)
            if not is_number(measured) or abs(measured) > limits.magnitude:
                raise unusable(f"`{source.name}`: `{key}` of record {number} is not a number", whole, "write a number")
        rows.append(PoseRow(whole, record["agent"], tuple(float(record[key]) for key in NEEDED[1:])))
    return rows
