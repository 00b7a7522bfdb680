"""Source text of missions and its spans; lines and columns are computed for messages only."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import field
from itertools import accumulate, islice
from typing import NamedTuple

from missionc.base.late_dataclass import Record


class Source(Record, eq=False):
    """Text of one file, with the file name that messages show.

    ``data`` is the contents of a file that is not a mission; ``text`` is then empty if the contents are not UTF-8.
    """

    name: str
    text: str
    data: bytes | None = None
    _starts: list[int] = field(init=False, repr=False, default_factory=list)

    @property
    def line_starts(self) -> list[int]:
        """Offset of the start of each line, computed at first use."""
        if not self._starts:
            ends = accumulate(len(line) + 1 for line in self.text.split("\n"))
            self._starts.extend((0, *islice(ends, self.text.count("\n"))))
        return self._starts

    @property
    def content(self) -> bytes:
        """Contents of the file in bytes; for a mission, its text in UTF-8."""
        return self.text.encode("utf-8", "replace") if self.data is None else self.data

    def place(self, offset: int) -> tuple[int, int]:
        """Line and column of a character offset, both counted from 1."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line(self, number: int) -> str:
        """Text of the line with this number (counted from 1), without its line end."""
        start = self.line_starts[number - 1]
        end = self.line_starts[number] if number < len(self.line_starts) else len(self.text)
        return self.text[start:end].rstrip("\r\n")


def line_ends(text: str) -> int:
    """Number of line ends in a text: line feeds, carriage returns, and pairs of both."""
    return text.count("\n") + text.count("\r") - text.count("\r\n")


class Turn(NamedTuple):
    """One value of the index ``name`` of a family or a ``for``, which ranges from ``low`` to ``high``."""

    name: str
    value: int
    low: int
    high: int


class Span(Record):
    """Range of characters of a source, from offset ``start`` to offset ``end`` (exclusive).

    ``turns`` are the current index values of the surrounding families and ``for``, the outermost first.
    """

    source: Source
    start: int
    end: int
    turns: tuple[Turn, ...] = ()

    @property
    def text(self) -> str:
        return self.source.text[self.start : self.end]

    def part(self, start: int, end: int) -> Span:
        """Span from ``start`` to ``end`` of the same source, with the same index values."""
        return Span(self.source, start, end, self.turns)

    @property
    def first_line(self) -> Span:
        """Part of the span before its first line end."""
        end = self.source.text.find("\n", self.start, self.end)
        return self.part(self.start, self.end if end < 0 else end)

    def to(self, other: Span) -> Span:
        """Span from the start of this span to the end of ``other``."""
        return self.part(self.start, other.end)
