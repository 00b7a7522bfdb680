"""Reader of the files that declarations name, such as maps and tables.

    in   a declaration as it was parsed
    out  the same with the sources of its files, and errors of unreadable ones
    says MC004, and the codes of ``load``

Their contents are not parsed here: ``maps`` does so once the request is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, replace
from posixpath import dirname, join

from missionc.base.diagnostics.code import FILE_TOO_LARGE
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.read_file import LINK, Absent, Loader


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
