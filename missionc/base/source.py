"""Source text of missions and spans in it; line and column are worked out when a message is shown.

In an editor a text changes while most of its lines stay. What was read of a passage that stays is not read
again: its spans count from where the passage begins, so that they move along when something is put in before it.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import field
from itertools import accumulate, islice

from missionc.base.late_dataclass import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """One file's text, under the name the user knows it by."""

    name: str
    text: str
    line_starts: tuple[int, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        ends = accumulate(len(line) + 1 for line in self.text.split("\n"))
        object.__setattr__(self, "line_starts", (0, *islice(ends, self.text.count("\n"))))

    @property
    def stands(self) -> tuple[Source, int]:
        """The whole of a source is a passage of it that begins at 0."""
        return self, 0

    @property
    def source(self) -> Source:
        return self

    @property
    def begin(self) -> int:
        return 0

    @property
    def size(self) -> int:
        return len(self.text)

    def place(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset, both counted from 1."""
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1

    def line(self, number: int) -> str:
        """The text of a line (counted from 1), without its line end."""
        start = self.line_starts[number - 1]
        end = self.line_starts[number] if number < len(self.line_starts) else len(self.text)
        return self.text[start:end].rstrip("\r\n")


@dataclass(slots=True, eq=False)
class Passage:
    """``size`` characters: where they stand, source and offset, in the newest text that has them.

    Set as one, so that whoever asks from another thread gets both of the same text.
    """

    stands: tuple[Source, int]
    size: int

    @staticmethod
    def of(source: Source, begin: int, end: int) -> Passage:
        """From one offset up to, but not at, another."""
        return Passage((source, begin), end - begin)

    @property
    def source(self) -> Source:
        return self.stands[0]

    @property
    def begin(self) -> int:
        return self.stands[1]


@dataclass(frozen=True, slots=True, match_args=False)
class Span:
    """The characters ``first`` up to, but not at, ``last`` of a source, or of a passage of one.

    ``start`` and ``end`` are the same place counted in the source as it is now.
    """

    whole: Source | Passage
    first: int
    last: int

    __match_args__ = ("source", "start", "end")

    @property
    def source(self) -> Source:
        return self.whole.source

    @property
    def start(self) -> int:
        return self.whole.begin + self.first

    @property
    def end(self) -> int:
        return self.whole.begin + self.last

    @property
    def text(self) -> str:
        source, begin = self.whole.stands
        return source.text[begin + self.first : begin + self.last]

    def to(self, other: Span) -> Span:
        """From the start of this span to the end of the other."""
        if self.whole is other.whole:
            return Span(self.whole, self.first, other.last)
        return Span(self.source, self.start, other.end)
