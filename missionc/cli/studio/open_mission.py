"""The open mission: the text that a page has, where it may be saved, and the answers to open and save.

says MC002 MC004 MC702
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.cli.studio.mission_lists import SUFFIX, Shelf, taken
from missionc.cli.studio.text_file import TextFile, opened
from missionc.diagnostics.code import UNREADABLE
from missionc.diagnostics.model import Diagnostic
from missionc.lsp.scene.scene import Json
from missionc.output.folder.unwritable import cannot_write
from missionc.output.folder.write_file import write_file
from missionc.syntax.parse import read
from missionc.syntax.read_file import loader, too_large

LONGEST = 200
"""Bytes of a file's name."""
ANOTHER_NAME = "another name, in this folder"


@dataclass(slots=True)
class OpenMission:
    """``home`` is the one folder that is read and written."""

    home: Path
    file: TextFile
    limits: Limits

    @property
    def uri(self) -> str:
        """How the language server calls the text."""
        return self.file.path.as_uri()

    def described(self) -> Json:
        """The text as a page opens it."""
        return {
            "uri": self.uri,
            "name": self.file.path.name,
            "text": self.file.text,
            "saved": self.file.saved,
            "named": self.file.named,
            "folder": str(self.home),
        }

    def open(self, shelf: Shelf, name: str) -> Json | Diagnostic:
        """Another text, in the place of this one."""
        file = taken(shelf, name, self.home, self.limits)
        if isinstance(file, Diagnostic):
            return file
        self.file = file
        return self.described()

    def reload(self) -> Json | Diagnostic:
        """The text as its file has it now."""
        file = opened(self.file.path, self.limits)
        if isinstance(file, Diagnostic):
            return file
        self.file = file
        return self.described()

    def save(self, text: str, name: str, replace: bool) -> Json | Diagnostic:
        """Save the text: under its own name, or under another one in the folder.

        ``problem`` says what has to be asked first: for a name where it has none yet (``unnamed``), whether to replace
        a file that is there (``exists``), or one that somebody else has saved meanwhile (``changed``).
        ``beside`` are the files that were saved along, which a text from the gallery includes.
        """
        size = len(text.encode("utf-8"))
        if size > self.limits.file_bytes:
            return too_large(UNREADABLE, self.file.path.name, size, self.limits.file_bytes)
        if not name and not self.file.named:
            return {"problem": "unnamed"}
        path = self.file.path if not name else self.home / (name if name.endswith(SUFFIX) else f"{name}{SUFFIX}")
        if name and (wrong := refused_name(self.home, path)):
            return wrong
        if path == self.file.path and self.file.named:
            if not replace and self.file.changed(self.limits):
                return {"problem": "changed"}
        elif not replace and os.path.lexists(path):
            return {"problem": "exists"}
        beside = {} if self.file.path.parent == self.home else self._included(text)
        saved = self.file.save(path, text)
        if isinstance(saved, Diagnostic):
            return saved
        self.file = saved
        missing = {name: content for name, content in beside.items() if not os.path.lexists(self.home / name)}
        for name, content in missing.items():
            wrong = write_file(self.home / name, content)
            if wrong:
                return wrong
        return {"problem": "", "beside": list(missing), **self.described()}

    def _included(self, text: str) -> dict[str, bytes]:
        """The files that a text from elsewhere names, relative to the text: they go along where that is saved."""
        path = self.file.path
        find = loader(path, str(path), self.limits)
        found: dict[str, bytes] = {}

        def load(written: str, span: Span, /, *, data: bool = False) -> Source | Diagnostic:
            included = find(written, span, data=data)
            if isinstance(included, Source):
                found[os.path.relpath(included.name, path.parent)] = included.content
            return included

        read(Source(str(path), text), self.limits, load)
        return found


def refused_name(home: Path, path: Path) -> Diagnostic | None:
    """Why a text cannot be saved under a name; absent where it can."""
    name = path.name
    plain = path.parent == home and name.isprintable() and not name.startswith(".") and "\\" not in name
    if not plain or len(os.fsencode(name)) > LONGEST:
        return cannot_write(path, f"a plain name is needed, which ends in `{SUFFIX}`", ANOTHER_NAME)
    if Path(os.path.realpath(path)).parent != Path(os.path.realpath(home)):
        return cannot_write(path, "it is a link that leads out of the folder", ANOTHER_NAME)
    return None
