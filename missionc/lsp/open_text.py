"""An open document: its lines, what can be read of it, and what the last check found."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from pygls.uris import from_fs_path, to_fs_path

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.diagnostics.sanitize import plain_line
from missionc.ir import Mission
from missionc.lsp.outline import Outline
from missionc.lsp.positions import Places
from missionc.pipeline.checked import Checked
from missionc.syntax.passages import passages
from missionc.syntax.tokens import Token, tokenise

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
