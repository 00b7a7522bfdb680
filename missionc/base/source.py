"""Source text of missions and spans in it; line and column are worked out when a message is shown."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import field
from itertools import accumulate, islice
from typing import NamedTuple

from missionc.base.late_dataclass import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """One file's text, under the name the user knows it by.

    ``data`` is what a file holds that is no mission; its ``text`` is empty where that is no UTF-8.
    """

    name: str
    text: str
    data: bytes | None = None
    _starts: list[int] = field(init=False, repr=False, default_factory=list)

    @property
    def line_starts(self) -> list[int]:
        """Offset of each line, counted when a place is first asked for: few files need one."""
        if not self._starts:
            ends = accumulate(len(line) + 1 for line in self.text.split("\n"))
            self._starts.extend((0, *islice(ends, self.text.count("\n"))))
        return self._starts

    @property
    def content(self) -> bytes:
        """What the file holds; of a mission its text in UTF-8."""
        return self.text.encode("utf-8", "replace") if self.data is None else self.data

    def place(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset, both counted from 1."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line(self, number: int) -> str:
        """The text of a line (counted from 1), without its line end."""
        start = self.line_starts[number - 1]
        end = self.line_starts[number] if number < len(self.line_starts) else len(self.text)
        return self.text[start:end].rstrip("\r\n")


def line_ends(text: str) -> int:
    """Number of line ends in a text: line feeds, carriage returns, and pairs of both."""
    return text.count("\n") + text.count("\r") - text.count("\r\n")


class Turn(NamedTuple):
    """One value of the index of this ``name``, of all those from ``low`` to ``high``."""

    name: str
    value: int
    low: int
    high: int


@dataclass(frozen=True, slots=True)
class Span:
    """The characters ``start`` up to, but not at, ``end`` of a source.

    ``turns`` are the indices with which the text of a family, or after ``for``, is read here, the outermost first.
    """

    source: Source
    start: int
    end: int
    turns: tuple[Turn, ...] = ()

    @property
    def text(self) -> str:
        return self.source.text[self.start : self.end]

    def part(self, start: int, end: int) -> Span:
        """Other characters of the same source, read with the same indices."""
        return Span(self.source, start, end, self.turns)

    @property
    def first_line(self) -> Span:
        """The part before the first line end."""
        end = self.source.text.find("\n", self.start, self.end)
        return self.part(self.start, self.end if end < 0 else end)

    def to(self, other: Span) -> Span:
        """From the start of this span to the end of the other."""
        return self.part(self.start, other.end)
