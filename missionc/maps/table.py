"""Tables: CSV with a row of column names to rows of numbers, each with its place in the text.

    in   the text, the columns that there may be
    out  its rows
    says MC004 MC033 MC034

Source:
    RFC 4180.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from io import StringIO
from itertools import accumulate

from missionc.base.late_dataclass import dataclass
from missionc.base.limits import Limits
from missionc.base.plain_number import plain_number
from missionc.base.source import Source, Span, line_ends
from missionc.diagnostics.suggest import nearest
from missionc.maps.feature import MapError, too_many, unreadable, unusable

TEXTS = frozenset({"name", "kind"})
"""Columns that are no numbers."""


@dataclass(frozen=True, slots=True)
class Row:
    """What stands in one row, by its column; cells that are empty are left out."""

    span: Span
    cells: dict[str, str]
    limits: Limits

    def number(self, column: str) -> float:
        """Raises:
        MapError: there is none.
        """
        text = self.cells.get(column, "")
        value = plain_number(text)
        if not text:
            raise self.wrong(f"column `{column}` is empty here", "write a number in it")
        if not abs(value) <= self.limits.magnitude:
            raise self.wrong(f"`{text[:40]}` in column `{column}` is no number, or too large", "write a plain number")
        return value

    def numbers(self, *columns: str) -> tuple[float, ...]:
        return tuple(self.number(column) for column in columns)

    def wrong(self, reason: str, way_out: str) -> MapError:
        return unusable(f"`{self.span.source.name}`: {reason}", self.span, way_out)


def read_table(source: Source, asked: Span, known: Sequence[str], needed: Sequence[str], limits: Limits) -> list[Row]:
    """Args:
        asked: the words that ask for the file.
        known: the columns that there may be.
        needed: those that there have to be.

    Raises:
        MapError: it is no such table.
    """
    rows_at_most = line_ends(source.text.rstrip())
    if rows_at_most > limits.map_features:
        raise too_many(source, "rows", "map_features", rows_at_most, limits, asked)
    lines = list(_lines(source))
    if not lines:
        reason = "it has no values" if source.text.strip() else "it has no text in UTF-8"
        raise unreadable(source, reason, asked, "give a table of values with commas between them")
    header, *rows = lines
    names = [name.strip().lower() for name in header[1]]
    _check_header(source, header[0], names, known, needed)
    if not rows:
        raise unusable(f"`{source.name}` has no row", header[0], "add rows below the names of the columns")
    for span, cells in rows:
        if len(cells) != len(names):
            reason = f"`{source.name}`: this row has {len(cells)} values, and there are {len(names)} columns"
            raise unusable(reason, span, "give each column a value; it may be empty")
    return [
        Row(span, {name: cell.strip() for name, cell in zip(names, cells, strict=True) if cell.strip()}, limits)
        for span, cells in rows
    ]


def _lines(source: Source) -> Iterator[tuple[Span, list[str]]]:
    """Rows that are not empty, each with where it begins."""
    lines = StringIO(source.text, newline="").readlines()
    starts = [0, *accumulate(map(len, lines))]
    reader, before = csv.reader(lines, strict=True), 0
    try:
        for cells in reader:
            first, before = before, reader.line_num
            if any(cell.strip() for cell in cells):
                yield Span(source, starts[first], starts[first] + len(lines[first].rstrip("\r\n"))), cells
    except csv.Error as error:
        place = starts[before]
        raise unreadable(source, f"it is no CSV: {error}", Span(source, place, place), "mend this row") from None


def _check_header(source: Source, span: Span, names: list[str], known: Sequence[str], needed: Sequence[str]) -> None:
    takes = ", ".join(f"`{name}`" for name in known)
    for name in names:
        if name not in known:
            near = nearest(name, known)
            meant = f"did you mean `{near}`?" if isinstance(near, str) else f"the first row names columns: {takes}"
            raise unusable(f"`{source.name}`: `{name[:40]}` is no column of such a table", span, meant)
    twice = next((name for at, name in enumerate(names) if name in names[:at]), "")
    if twice:
        raise unusable(f"`{source.name}`: column `{twice}` is there twice", span, "leave one of them out")
    missing = next((name for name in needed if name not in names), "")
    if missing:
        raise unusable(f"`{source.name}`: there is no column `{missing}`", span, f"name it in the first row: {takes}")
