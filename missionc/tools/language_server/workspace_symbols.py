"""Document and workspace symbols: the declarations of a text, and those of all missions in the open folders."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from lsprotocol import types
from pygls.uris import from_fs_path

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source, Span
from missionc.frontend.resolve.context import Kind, Named, kind_of
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.read_file import read_source
from missionc.output.folder.file_names import MANIFEST
from missionc.tools.language_server.open_text import LIMITS, OpenText

KINDS = {
    Kind.PARAM: types.SymbolKind.Constant,
    Kind.REGION: types.SymbolKind.Object,
    Kind.OBSTACLE: types.SymbolKind.Object,
    Kind.BEACON: types.SymbolKind.Object,
    Kind.TEAM: types.SymbolKind.Class,
    Kind.AGENT: types.SymbolKind.Class,
    Kind.GROUP: types.SymbolKind.Array,
    Kind.GRAPH: types.SymbolKind.Interface,
    Kind.FORMATION: types.SymbolKind.Struct,
    Kind.RESOURCE: types.SymbolKind.Number,
    Kind.FLAG: types.SymbolKind.Boolean,
    Kind.LET: types.SymbolKind.Function,
}


def symbols(text: OpenText) -> list[types.DocumentSymbol]:
    """Declarations of a text as symbols; from unreadable declarations, the names that follow their keywords."""
    symbols: list[types.DocumentSymbol] = []
    for declaration in text.outline.declarations:
        if declaration.span.source.name != text.source.name:
            continue
        match declaration:
            case ast.MissionName(name=name):
                symbols.append(
                    _symbol(text, name.text, types.SymbolKind.Module, "mission", declaration.span, name.span)
                )
            case ast.Require(label=label) | ast.Prefer(label=label):
                word = "require" if isinstance(declaration, ast.Require) else "prefer"
                span = label.span if label else declaration.span
                shown = _shown(label) if label else word
                symbols.append(_symbol(text, shown, types.SymbolKind.Event, word, declaration.span, span))
            case _ if isinstance(declaration, Named):
                kind, name = kind_of(declaration), declaration.name
                symbols.append(_symbol(text, _shown(name), KINDS[kind], kind.value, declaration.span, name.span))
    for seen, read in text.outline.declared.values():
        if read is None and seen.kind is not None and seen.span.source.name == text.source.name:
            symbols.append(_symbol(text, seen.text, KINDS[seen.kind], seen.kind.value, seen.span, seen.span))
    return sorted(symbols, key=lambda symbol: (symbol.range.start.line, symbol.range.start.character))


def _shown(name: ast.Name) -> str:
    """Name of a declaration, with the indices of a family: ``w[i in 0..9]``."""
    return name.whole_span.text if isinstance(name, ast.FamilyName) else name.text


def _symbol(
    text: OpenText, name: str, kind: types.SymbolKind, detail: str, whole: Span, words: Span
) -> types.DocumentSymbol:
    return types.DocumentSymbol(name, kind, text.places.range(whole), text.places.range(words), detail)


MOST_FILES = 300
"""Maximum number of missions in the open folders that are read."""
MOST_ENTRIES = 20_000
"""Maximum number of files and folders that are listed to find missions."""
MOST_SYMBOLS = 1_000
"""Maximum number of symbols in one answer."""


class WorkspaceSymbols:
    """Cache of the declarations in the open folders; a changed file is read again."""

    def __init__(self) -> None:
        self._known: dict[Path, tuple[tuple[int, int], list[types.DocumentSymbol], str]] = {}

    def search(
        self, query: str, folders: Iterable[Path], texts: Mapping[str, OpenText], encoding: str
    ) -> list[types.WorkspaceSymbol]:
        """Symbols whose names contain the letters of a query in order, ignoring case.

        Args:
            query: letters; empty matches all names.
            folders: open folders.
            texts: open texts by URI, in their current version.
            encoding: encoding in whose units the client counts columns.
        """
        found: list[types.WorkspaceSymbol] = []
        for uri, declared, mission in self._files(folders, texts, encoding):
            for symbol in declared:
                if _fits(query, symbol.name):
                    place = types.Location(uri, symbol.selection_range)
                    found.append(types.WorkspaceSymbol(place, symbol.name, symbol.kind, container_name=mission))
                    if len(found) == MOST_SYMBOLS:
                        return found
        return found

    def _files(
        self, folders: Iterable[Path], texts: Mapping[str, OpenText], encoding: str
    ) -> Iterator[tuple[str, list[types.DocumentSymbol], str]]:
        seen = set()
        for uri, text in texts.items():
            seen.add(Path(text.source.name))
            yield uri, symbols(text), Path(text.source.name).name
        for path, status in _missions(folders):
            if path in seen:
                continue
            seen.add(path)
            uri, stamp = from_fs_path(str(path)) or path.as_uri(), (status.st_mtime_ns, status.st_size)
            if path not in self._known or self._known[path][0] != stamp:
                source = read_source(path, str(path), LIMITS)
                declared = [] if isinstance(source, Diagnostic) else _declared(uri, source, encoding)
                self._known[path] = stamp, declared, path.name
            yield uri, *self._known[path][1:]


def _declared(uri: str, source: Source, encoding: str) -> list[types.DocumentSymbol]:
    return symbols(OpenText(uri, 0, source, encoding))


def _missions(folders: Iterable[Path]) -> Iterator[tuple[Path, os.stat_result]]:
    """Yield the missions in and below some folders, except in hidden folders and those written by the compiler."""
    files = entries = 0
    waiting = [*folders]
    while waiting:
        try:
            listed = sorted(os.scandir(waiting.pop(0)), key=lambda entry: entry.name)
        except OSError:
            continue
        if any(entry.name == MANIFEST for entry in listed):
            continue
        for entry in listed:
            entries += 1
            if entries > MOST_ENTRIES or files == MOST_FILES:
                return
            try:
                if entry.is_dir(follow_symlinks=False):
                    if not entry.name.startswith(".") and entry.name != "node_modules":
                        waiting.append(Path(entry.path))
                elif entry.name.endswith(".mission") and entry.is_file():
                    files += 1
                    yield Path(entry.path), entry.stat()
            except OSError:
                continue  # it was deleted in the meantime


def _fits(query: str, name: str) -> bool:
    letters = iter(name.casefold())
    return all(letter in letters for letter in query.casefold())
