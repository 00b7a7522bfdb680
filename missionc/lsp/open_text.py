"""An open document: its lines, what can be read of it, and what the last check found.

Conversion between offsets in a text and the protocol's positions, in the client's encoding.
"""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from lsprotocol import types
from pygls.uris import from_fs_path, to_fs_path

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.diagnostics.sanitize import plain_line
from missionc.ir import Mission
from missionc.lsp.outline import Outline
from missionc.pipeline.checked import Checked
from missionc.syntax.passages import passages
from missionc.syntax.tokens import Token, tokenise

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


LIMITS = Limits()


@dataclass(eq=False)
class OpenText:
    """One version of a text in the editor.

    ``found`` is what its check says, once it is done; ``before`` the mission as it was meant last, in versions before.
    """

    uri: str
    version: int
    source: Source
    encoding: str
    before: Mission | None = None
    found: Checked | None = None

    @cached_property
    def places(self) -> Places:
        return Places(self.source.text, self.encoding)

    @cached_property
    def outline(self) -> Outline:
        return Outline.of(self.source, LIMITS)

    @cached_property
    def tokens(self) -> tuple[Token, ...]:
        """All of them in order, those of a text that cannot be read too; none of a text that is too large."""
        if len(self.source.text) > LIMITS.file_bytes:
            return ()
        return tuple(token for passage in passages(self.source) for token in tokenise(passage, LIMITS)[0][:-1])

    @property
    def mission(self) -> Mission | None:
        """As meant: of this version where it is known, else of the last one that meant something."""
        return self.found.mission if self.found and self.found.mission else self.before

    def uri_of(self, source: Source) -> str:
        """The URI of this text, or of a file that it includes."""
        if source.name == self.source.name:
            return self.uri
        return from_fs_path(str(Path(source.name).absolute())) or source.name

    def places_in(self, source: Source) -> Places:
        return self.places if source.name == self.source.name else Places(source.text, self.encoding)


def name_of(uri: str) -> str:
    """How messages call a text: its path where it has one; written out where no file can be called so."""
    name = to_fs_path(uri) or uri
    try:
        return name if os.fsencode(name) and "\0" not in name else plain_line(name)
    except UnicodeEncodeError:
        return plain_line(name)
