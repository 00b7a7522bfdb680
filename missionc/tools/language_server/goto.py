"""Requests about names: go to definition, references and highlights; and links to the files that a text names."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path, PurePosixPath

from lsprotocol import types
from pygls.uris import from_fs_path

from missionc.frontend.syntax.read_file import strange
from missionc.frontend.syntax.tokens import TEXT
from missionc.tools.language_server.open_text import Name, OpenText

BEFORE = frozenset({"include", "from", "="})
"""Tokens before the name of a file: ``include "…"``, ``from "…"``, ``roadmap = "…"``."""


def links(text: OpenText) -> list[types.DocumentLink]:
    """Links to the files that a text names by a relative path, existing or not; none for a text that is not on disk."""
    if not text.uri.startswith("file:"):
        return []
    folder = Path(text.source.name).absolute().parent
    found = []
    for before, token in pairwise(text.tokens):
        written = token.text[1:-1]
        if token.kind != TEXT or before.text not in BEFORE or strange(written):
            continue
        span = token.span
        inner = text.places.between(span.start + 1, span.end - 1)
        target = from_fs_path(str(folder / PurePosixPath(written)))
        found.append(types.DocumentLink(inner, target, f"Open {written}"))
    return found


def definition(text: OpenText, position: types.Position) -> types.Location | None:
    name = text.outline.at(text.places.offset(position))
    if name is None:
        return None
    if name.label:
        return _location(text, name)
    if name.index is not None:
        return _location(text, replace(name, span=name.index))
    declared = text.outline.declared.get(name.text)
    return _location(text, declared[0]) if declared else None


def references(text: OpenText, position: types.Position, declaration: bool) -> list[types.Location]:
    """All uses of the name at a position, also in included files; empty if there is no name.

    Args:
        text: open text.
        position: position in the protocol's units.
        declaration: whether to include the declaration.
    """
    name = text.outline.at(text.places.offset(position))
    if name is None:
        return []
    return [_location(text, other) for other in text.outline.alike(name) if declaration or not other.declares]


def highlights(text: OpenText, position: types.Position) -> list[types.DocumentHighlight]:
    name = text.outline.at(text.places.offset(position))
    if name is None:
        return []
    write, read = types.DocumentHighlightKind.Write, types.DocumentHighlightKind.Read
    return [
        types.DocumentHighlight(text.places.range(other.span), write if other.declares else read)
        for other in text.outline.alike(name)
        if other.span.source.name == text.source.name
    ]


def _location(text: OpenText, name: Name) -> types.Location:
    return types.Location(text.uri_of(name.span.source), text.places_in(name.span.source).range(name.span))
