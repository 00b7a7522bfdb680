"""Conversion between offsets in a text and the protocol's positions, in the client's encoding."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass, field

from lsprotocol import types

from missionc.base.source import Span

_LINE_END = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """A text's lines as the protocol has them, which end in ``\\n``, ``\\r\\n`` or a lone ``\\r``."""

    text: str
    encoding: str = types.PositionEncodingKind.Utf16
    starts: tuple[int, ...] = field(init=False, repr=False)
    ends: tuple[int, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        cuts = [match.span() for match in _LINE_END.finditer(self.text)]
        object.__setattr__(self, "starts", (0, *(after for _, after in cuts)))
        object.__setattr__(self, "ends", (*(before for before, _ in cuts), len(self.text)))

    def position(self, offset: int) -> types.Position:
        """The position of the character at an offset; what is amid a line end counts as before it."""
        line = self.line(offset)
        before = self.text[self.starts[line] : min(offset, self.ends[line])]
        return types.Position(line, self._units(before))

    def line(self, offset: int) -> int:
        """The number of the line that an offset is in, from 0."""
        return bisect_right(self.starts, offset) - 1

    def offset(self, position: types.Position) -> int:
        """Where a position is; past the end of a line or of the text means there, amid a character means before it."""
        if position.line >= len(self.starts):
            return len(self.text)
        start, end = self.starts[position.line], self.ends[position.line]
        line = self.text[start:end]
        if line.isascii():
            return start + min(position.character, len(line))
        left = position.character
        for place, letter in enumerate(line):
            left -= self._units(letter)
            if left < 0:
                return start + place
        return end

    def range(self, span: Span) -> types.Range:
        return self.between(span.start, span.end)

    def between(self, start: int, end: int) -> types.Range:
        return types.Range(self.position(start), self.position(end))

    def _units(self, text: str) -> int:
        if text.isascii() or self.encoding == types.PositionEncodingKind.Utf32:
            return len(text)
        if self.encoding == types.PositionEncodingKind.Utf8:
            return len(text.encode("utf-8", "surrogatepass"))
        return len(text) + sum(letter > "\uffff" for letter in text)
