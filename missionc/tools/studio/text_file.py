"""Text with its file: read unchanged, compared with the disk, and saved on request only.

Lines of a page end in one character. The line ends on the disk and the byte order mark are stored here, so that saving
changes edited parts only.

    says MC002 MC004 MC009 MC702
"""

from __future__ import annotations

import codecs
import os
from dataclasses import dataclass, replace
from pathlib import Path

from missionc import Diagnostic, Limits
from missionc.frontend.syntax.read_file import read_bytes, text_of
from missionc.output.folder.write_folder import write_file


@dataclass(frozen=True, slots=True)
class TextFile:
    r"""Text of a mission and its file.

    Args:
        path: path of the file, which need not exist.
        text: text with ``\n`` line ends.
        disk: last known content of the file; None without a file.
        named: whether the user chose the path, so that saving there needs no question.
        newline: line end on the disk.
        mark: byte order mark on the disk.
    """

    path: Path
    text: str
    disk: bytes | None = None
    named: bool = False
    newline: str = "\n"
    mark: bytes = b""

    @property
    def saved(self) -> bool:
        """Return whether the text has a file."""
        return self.disk is not None

    def changed(self, limits: Limits) -> bool:
        """Return whether the file has changed since it was last read or saved."""
        now = read_bytes(self.path, str(self.path), limits.file_bytes)
        return now != self.disk if isinstance(now, bytes) else self.saved or os.path.lexists(self.path)

    def save(self, path: Path, text: str) -> TextFile | Diagnostic:
        """Write a text to a path; return the saved file or an error."""
        content = self.mark + text.replace("\n", self.newline).encode("utf-8")
        wrong = write_file(path, content)
        return wrong or replace(self, path=path, text=text, disk=content, named=True)


def opened_text(path: Path, limits: Limits) -> TextFile | Diagnostic:
    """Read a text and its line ends from a file, or return the error."""
    content = read_bytes(path, str(path), limits.file_bytes)
    if isinstance(content, Diagnostic):
        return content
    text = text_of(content, str(path))
    if isinstance(text, Diagnostic):
        return text
    mark = codecs.BOM_UTF8 if content.startswith(codecs.BOM_UTF8) else b""
    newline = "\r\n" if "\r\n" in text else "\n"
    return TextFile(path, text.replace("\r\n", "\n").replace("\r", "\n"), content, True, newline, mark)


def fresh(folder: Path, name: str) -> Path:
    """Path in a folder that does not exist yet: ``name.mission``, or with a number."""
    numbers = iter(range(2, 10_000))
    path = folder / f"{name}.mission"
    while os.path.lexists(path):
        path = folder / f"{name}_{next(numbers)}.mission"
    return path
