"""Safe reading of untrusted files into text: a mission may come from anyone.

    in   a path, a limit
    out  Source
    says MC002 MC004 MC009 MC010 MC033

Only regular files are opened, nothing larger than the limit is read, and a file that changes meanwhile is an error.
Included files must be in the mission's own folder or below it, with symbolic links resolved.

Reader of the files that declarations name, such as maps and tables.

    in   a declaration as it was parsed
    out  the same with the sources of its files, and errors of unreadable ones
    says MC004, and the codes of ``load``

Their contents are not parsed here: ``maps`` does so once the request is known.
"""

from __future__ import annotations

import codecs
import errno
import os
import re
import stat
import sys
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from pathlib import Path, PurePosixPath
from posixpath import dirname, join, normpath, relpath
from typing import Protocol

from missionc.base.diagnostics import code as codes
from missionc.base.diagnostics.code import FILE_TOO_LARGE
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax import ast

LIMITS = {
    codes.UNREADABLE: "file_bytes",
    codes.TRACE_UNREADABLE: "trace_bytes",
    codes.CHECKPOINT_UNREADABLE: "checkpoint_bytes",
    codes.FOLDER_UNREADABLE: "trace_bytes",
    codes.MAP_UNREADABLE: "map_bytes",
    codes.SCENARIO_UNUSABLE: "file_bytes",
}
"""Limit for each kind of file, by the code of its read error."""


class Loader(Protocol):
    """Function that reads a file that a mission names: an included mission, or with ``data`` a map or table."""

    def __call__(self, written: str, span: Span, /, *, data: bool = False) -> Source | Diagnostic: ...


class Absent(Diagnostic):
    """Diagnostic of a file that does not exist."""

    __slots__ = ()


def read_bytes(
    path: Path, name: str, limit: int, code: codes.Code = codes.UNREADABLE, cause: Span | None = None
) -> bytes | Diagnostic:
    """Contents of a regular file, at most ``limit`` bytes, or an error.

    Args:
        path: the file.
        name: its name in messages.
        limit: maximum size in bytes; a larger file is an error before it is read.
        code: code of the message for a file that cannot be read.
        cause: the words that request the file, if any.
    """
    try:
        handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError as error:
        return cannot_read(code, name, error, cause)
    try:
        return bytes_of(handle, name, limit, cause, code)
    except OSError as error:
        return cannot_read(code, name, error, cause)
    finally:
        os.close(handle)


def read_text(
    path: Path, name: str, limit: int, code: codes.Code = codes.UNREADABLE, cause: Span | None = None
) -> str | Diagnostic:
    """Text of a UTF-8 file, with or without a byte order mark, without NUL, or an error.

    Arguments as for ``read_bytes``.
    """
    content = read_bytes(path, name, limit, code, cause)
    return content if isinstance(content, Diagnostic) else text_of(content, name, code, cause)


def text_of(
    content: bytes, name: str, code: codes.Code = codes.UNREADABLE, cause: Span | None = None
) -> str | Diagnostic:
    """Text decoded from UTF-8 bytes, or an error; arguments as for ``read_bytes``."""
    if b"\0" in content:
        return _unreadable(code, name, f"binary file: byte {content.index(0) + 1} is zero", cause)
    try:
        return content.removeprefix(codecs.BOM_UTF8).decode("utf-8")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        return _unreadable(code, name, f"byte {error.start + 1}, on line {line}, is not UTF-8", cause)


def read_source(path: Path, name: str, limits: Limits, cause: Span | None = None) -> Source | Diagnostic:
    """Text of a mission file within the limits, or an error."""
    text = read_text(path, name, limits.file_bytes, codes.UNREADABLE, cause)
    return text if isinstance(text, Diagnostic) else Source(name, text)


def unread(written: str, span: Span, /, *, data: bool = False) -> Source:
    """Empty source for a file that a mission names; the loader for the analysis of a single file."""
    return Source(written, "", b"" if data else None)


def data_of(content: bytes, name: str) -> Source:
    """Source of a file that is not a mission: its bytes, and its text if it is text."""
    text = text_of(content, name)
    return Source(name, "" if isinstance(text, Diagnostic) else text, content)


def read_data(path: Path, name: str, limits: Limits, cause: Span | None = None) -> Source | Diagnostic:
    """Content of a file that is not a mission, within the limits, or an error."""
    content = read_bytes(path, name, limits.map_bytes, codes.MAP_UNREADABLE, cause)
    return content if isinstance(content, Diagnostic) else data_of(content, name)


def read_standard_input(limits: Limits) -> Source | Diagnostic:
    """Mission from standard input within the limits, or an error; no more is read."""
    name, limit = "<stdin>", limits.file_bytes
    if sys.stdin is None:
        return closed_input()
    try:
        content = sys.stdin.buffer.read(limit + 1)
    except (OSError, ValueError) as error:
        why = _reason(error) if isinstance(error, OSError) else "standard input is closed"
        return _unreadable(codes.UNREADABLE, name, why, None)
    if len(content) > limit:
        return too_large(codes.UNREADABLE, name, len(content), limit, more=True)
    text = text_of(content, name)
    return text if isinstance(text, Diagnostic) else Source(name, text)


def closed_input() -> Diagnostic:
    """Finding for a standard input that was closed when the process started."""
    return _unreadable(codes.UNREADABLE, "<stdin>", "standard input is closed", None)


def loader(main: Path, name: str, limits: Limits) -> Loader:
    """Function that reads the files included by a mission.

    A path is relative to the file that includes it. A file has one source name for all paths to it, so cycles are
    detected by name. A link has a source of its own, which includes its target, so the sources with their names are the
    complete mission.

    Args:
        main: path of the mission.
        name: name of the mission in messages.
    """
    folder, root = Path(name).parent, main.parent.resolve()
    leads: dict[str, Path] = {}
    paths = {name: root / main.name}
    names = {main.resolve(): name}

    def load(written: str, span: Span, /, *, data: bool = False) -> Source | Diagnostic:
        if strange(written):
            return _not_allowed(written, "the path is not relative", span)
        try:
            path = leads.get(span.source.name) or (paths[span.source.name].parent / written).resolve()
        except (OSError, RuntimeError, ValueError):
            return _unreadable(codes.UNREADABLE, written, "a symbolic link of the path is broken", span)
        # Whether a file outside exists is nobody's business, so this comes before any look at it.
        if not path.is_relative_to(root):
            return _not_allowed(written, "the file is outside the mission's own folder", span)
        link = "" if path in names else _link(Path(span.source.name).relative_to(folder).parent / written, path, root)
        called = names.setdefault(path, str(folder / path.relative_to(root)))
        paths[called] = path
        source = (read_data if data else read_source)(path, called, limits, span)
        if not link or isinstance(source, Diagnostic):
            return source
        leads[str(folder / link)] = path
        return Source(str(folder / link), f'include "{relpath(path.relative_to(root), PurePosixPath(link).parent)}"\n')

    return load


def _link(written: Path, path: Path, root: Path) -> str:
    """Path, relative to ``root``, of the symbolic link through which a file was reached; empty if there is no link.

    Also empty if a mission cannot express the link: several links, a path up and down again, or invalid characters.
    """
    named, own = normpath(written.as_posix()), path.relative_to(root).as_posix()
    if named == own or named.startswith("../") or (root / named).resolve() != path:
        return ""
    return "" if strange(own) or '"' in own or not own.isprintable() or not named.isprintable() else named


def held(main: str, folder: str, files: Mapping[str, bytes], limits: Limits) -> tuple[Source | Diagnostic, Loader]:
    """Source of a mission whose files are in memory, and the function that finds its included files among them.

    Args:
        main: name of the mission, one of ``files``.
        folder: folder of the files in messages.
        files: contents of each file, by its name relative to the folder.
    """

    def source(name: str, cause: Span | None = None, data: bool = False) -> Source | Diagnostic:
        shown = f"{folder}/{name}"
        if name not in files:
            absent = "this file is not part of the mission"
            return _unreadable(codes.MAP_UNREADABLE if data else codes.UNREADABLE, shown, absent, cause, absent=True)
        if data and not _leads(files[name]):
            return data_of(files[name], shown)
        if len(files[name]) > limits.file_bytes:
            return too_large(codes.UNREADABLE, shown, len(files[name]), limits.file_bytes, cause)
        text = text_of(files[name], shown, codes.UNREADABLE, cause)
        return text if isinstance(text, Diagnostic) else Source(shown, text)

    def load(written: str, span: Span, /, *, data: bool = False) -> Source | Diagnostic:
        if strange(written):
            return _not_allowed(written, "the path is not relative", span)
        beside = PurePosixPath(span.source.name).relative_to(folder).parent
        name = normpath(str(beside / written))
        if name.startswith("../"):
            return _not_allowed(written, "the file is outside the mission's own folder", span)
        return source(name, span, data)

    return source(main), load


LINK = re.compile(r'include "([^"\n]*)"\n')
"""Pattern of a file that stands for a symbolic link; its group is the target."""


def _leads(content: bytes) -> bool:
    """Return whether the content stands for a symbolic link instead of being the file."""
    return content.startswith(b"include ") and LINK.fullmatch(content.decode("utf-8", "replace")) is not None


def strange(written: str) -> bool:
    """Return whether a file name is not allowed: absolute, empty, or with characters of another system."""
    return PurePosixPath(written).is_absolute() or not written or "\0" in written or "\\" in written


def bytes_of(handle: int, name: str, limit: int, cause: Span | None, code: codes.Code) -> bytes | Diagnostic:
    """Contents of an open file, or an error; arguments as for ``read_bytes``.

    Raises:
        OSError: the file cannot be read.
    """
    before = os.fstat(handle)
    if not stat.S_ISREG(before.st_mode):
        what = "a folder" if stat.S_ISDIR(before.st_mode) else "not a regular file"
        return _unreadable(code, name, f"it is {what}", cause)
    if before.st_size > limit:
        return too_large(code, name, before.st_size, limit, cause)
    content = _read(handle, before.st_size + 1)
    after = os.fstat(handle)
    if len(content) != after.st_size or (before.st_size, before.st_mtime_ns) != (after.st_size, after.st_mtime_ns):
        return changed_meanwhile(name, cause)
    return content


def too_large(
    code: codes.Code, name: str, size: int, limit: int, cause: Span | None = None, *, more: bool = False
) -> Diagnostic:
    """Finding for a file of ``size`` bytes, or more with ``more``, above ``limit``."""
    limited = LIMITS.get(code)
    raised = (
        f"raise the limit with `--limit {limited}={'BYTES' if more else size}`" if limited else "use a smaller file"
    )
    return Diagnostic(
        codes.FILE_TOO_LARGE,
        f"`{name}` has {size} bytes{' or more' if more else ''}; the limit is {limit}",
        Label(cause, "requested here") if cause else None,
        help=f"{raised}" if code is codes.UNREADABLE else raised,
    )


def cannot_read(code: codes.Code, name: str, error: OSError, cause: Span | None = None) -> Diagnostic:
    """Finding for a system error while opening or reading a file."""
    return _unreadable(code, name, _reason(error), cause, absent=error.errno == errno.ENOENT)


def _read(handle: int, limit: int) -> bytes:
    """Bytes of an open file up to ``limit``; a single system call may return fewer than requested."""
    parts: list[bytes] = []
    while limit > 0 and (part := os.read(handle, limit)):
        parts.append(part)
        limit -= len(part)
    return b"".join(parts)


def nowhere() -> bool:
    """Return whether the working directory has been removed."""
    try:
        os.getcwd()
    except OSError:
        return True
    return False


def _reason(error: OSError) -> str:
    """The operating system's text for an error, as the end of a sentence."""
    words = os.strerror(error.errno) if error.errno else str(error)
    return words[:1].lower() + words[1:]


def _unreadable(code: codes.Code, name: str, reason: str, cause: Span | None, *, absent: bool = False) -> Diagnostic:
    return (Absent if absent else Diagnostic)(
        code,
        f"cannot read `{name}`: {reason}",
        Label(cause, "requested here") if cause else None,
        help="name an existing, readable file"
        if code in (codes.CHECKPOINT_UNREADABLE, codes.FOLDER_UNREADABLE, codes.MAP_UNREADABLE)
        else "name a readable file of UTF-8 text",
    )


def changed_meanwhile(name: str, cause: Span | None = None) -> Diagnostic:
    """Finding for a file that changes while it is read, or before the output from it is written."""
    return Diagnostic(
        codes.FILE_CHANGED,
        f"`{name}` changed during reading",
        Label(cause, "requested here") if cause else None,
        help="run the command again after the file is written",
    )


def _not_allowed(written: str, reason: str, span: Span) -> Diagnostic:
    return Diagnostic(
        codes.INCLUDE_NOT_ALLOWED,
        f"`{written}` cannot be included: {reason}",
        Label(span),
        help="write a relative path inside the mission's own folder",
    )


class Files(Record):
    """Map and table files of one mission; each is read once, with a limit on the total size."""

    limits: Limits
    load: Loader
    known: dict[tuple[str, str], Source | Diagnostic] = field(default_factory=dict)

    def read(self, declaration: ast.Declaration) -> tuple[ast.Declaration, list[Diagnostic]]:
        """The declaration with the contents of its files, and errors about unreadable files."""
        findings: list[Diagnostic] = []

        def whole(file: ast.File) -> ast.File:
            read = self._with_sources(file)
            if isinstance(read, Diagnostic):
                findings.append(read)
                return file
            return read

        return with_files(declaration, whole), findings

    def _with_sources(self, file: ast.File) -> ast.File | Diagnostic:
        first = self._read(file.path, file.span)
        if isinstance(first, Diagnostic):
            return first
        from missionc.frontend.maps.map_metadata import companion  # few missions have a map

        other = companion(file.path, first)
        if other.path == "":
            return replace(file, sources=(first,))
        second = self._read(join(dirname(file.path), other.path), file.span)
        if isinstance(second, Absent) and not other.needed:
            return replace(file, sources=(first,))
        return second if isinstance(second, Diagnostic) else replace(file, sources=(first, second))

    def _read(self, path: str, span: Span) -> Source | Diagnostic:
        key = span.source.name, path
        if key not in self.known:
            self.known[key] = self._within_limit(path, span)
        return self.known[key]

    def _within_limit(self, path: str, span: Span) -> Source | Diagnostic:
        """Content of a file, or an error; a link is followed once, and the total size is limited."""
        loaded = self.load(path, span, data=True)
        if isinstance(loaded, Source) and loaded.data is None and (link := LINK.fullmatch(loaded.text)):
            loaded = self.load(link[1], Span(loaded, 0, len(loaded.text)), data=True)
        if isinstance(loaded, Diagnostic):
            return loaded
        total = sum(len(each.content) for each in self.known.values() if isinstance(each, Source))
        total += len(loaded.content)
        return loaded if total <= self.limits.map_bytes else _too_large(loaded, total, span, self.limits)


def named_files(declaration: ast.Declaration) -> list[ast.File]:
    """Files that a declaration names."""
    named: list[ast.File] = []

    def keep(file: ast.File) -> ast.File:
        named.append(file)
        return file

    with_files(declaration, keep)
    return named


def with_files(declaration: ast.Declaration, whole: Callable[[ast.File], ast.File]) -> ast.Declaration:
    """The declaration with ``whole`` applied to each file that it names."""
    match declaration:
        case ast.FromFile(file=file):
            return replace(declaration, file=whole(file))
        case ast.Obstacle(motion=ast.AlongFile(span, file)):
            return replace(declaration, motion=ast.AlongFile(span, whole(file)))
        case ast.Formation(offsets=ast.File() as file):
            return replace(declaration, offsets=whole(file))
        case ast.Team(items=items) if any(_is_listed(item) for item in items):
            return replace(declaration, items=tuple(_item(item, whole) for item in items))
        case _:
            return declaration


def _is_listed(item: ast.TeamItem | ast.Pads) -> bool:
    if isinstance(item, ast.Flight):
        return any(map(_is_listed, item.items))
    return isinstance(item, ast.Start | ast.Finish | ast.Pads) and isinstance(item.places, ast.AtListed)


def _item(item: ast.TeamItem, whole: Callable[[ast.File], ast.File]) -> ast.TeamItem:
    match item:
        case ast.Start(places=ast.AtListed(span, file)) | ast.Finish(places=ast.AtListed(span, file)):
            return replace(item, places=ast.AtListed(span, whole(file)))
        case ast.Flight(items=items):
            return replace(item, items=tuple(_pads(each, whole) for each in items))
        case _:
            return item


def _pads(item: ast.Pads | ast.Setting, whole: Callable[[ast.File], ast.File]) -> ast.Pads | ast.Setting:
    match item:
        case ast.Pads(places=ast.AtListed(span, file)):
            return replace(item, places=ast.AtListed(span, whole(file)))
        case _:
            return item


# ------------------------------------------------------------------ messages


def _too_large(source: Source, total: int, span: Span, limits: Limits) -> Diagnostic:
    return Diagnostic(
        FILE_TOO_LARGE,
        f"with `{source.name}`, the map files of the mission have {total} bytes; the limit is {limits.map_bytes}",
        Label(span, "requested here"),
        help=f"raise the limit with `--limit map_bytes={total}`",
    )
