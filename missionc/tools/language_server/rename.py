"""Rename request: changes a name in all files; rejected if the meaning of the text would change."""

from __future__ import annotations

from itertools import groupby

from lsprotocol import types
from pygls.exceptions import JsonRpcException

from missionc.base.source import Source
from missionc.frontend.resolve.context import STATE_WORDS
from missionc.frontend.syntax.tokens import nameable, reserved
from missionc.tools.language_server.open_text import LIMITS, Name, OpenText, Outline

REQUEST_FAILED = int(types.LSPErrorCodes.RequestFailed)


class RefusedError(JsonRpcException):
    """Error: a name cannot be renamed, for the given reason, which the editor shows."""

    CODE = REQUEST_FAILED


def renamable(text: OpenText, position: types.Position) -> types.PrepareRenamePlaceholder:
    """Range and text of the name at a position.

    Raises:
        RefusedError: there is no name, or another file declares it.
    """
    name = _name(text, position)
    return types.PrepareRenamePlaceholder(text.places.range(name.span), name.text)


def rename(text: OpenText, position: types.Position, new: str) -> types.WorkspaceEdit:
    """Edits that rename the name at a position, by file.

    Args:
        text: open text.
        position: position in the protocol's units.
        new: new name.

    Raises:
        RefusedError: there is no name, the text has syntax errors, or the new name is taken or invalid.
    """
    name, outline = _name(text, position), text.outline
    if new == name.text:
        return types.WorkspaceEdit(changes={})
    _check(new, name, outline)
    if not outline.whole:
        raise RefusedError("the text has syntax errors; correct them before you rename a name")
    places = sorted(outline.alike(name), key=lambda other: (other.span.source.name, other.span.start))
    _keeps_its_meaning(text, name, new, places)
    changes: dict[str, list[types.TextEdit]] = {}
    for source, others in groupby(places, key=lambda other: other.span.source):
        lines = text.places_in(source)
        changes[text.uri_of(source)] = [types.TextEdit(lines.range(other.span), new) for other in others]
    return types.WorkspaceEdit(changes=changes)


def _name(text: OpenText, position: types.Position) -> Name:
    name = text.outline.at(text.places.offset(position))
    if name is None:
        raise RefusedError("no name of the mission at this position")
    if name.label or name.index is not None:
        return name
    if name.text not in text.outline.declared:
        raise RefusedError(f"unknown name `{name.text}`")
    declared = text.outline.declared[name.text][0].span
    source = declared.source
    if declared.text != name.text:
        raise RefusedError(f"`{name.text}` is a generated name; set another name with `named`")
    if source.name != text.source.name:
        raise RefusedError(f"`{name.text}` is declared in `{source.name}`: rename it there")
    return name


def _check(new: str, name: Name, outline: Outline) -> None:
    if not nameable(new):
        raise RefusedError(f"`{new}` is not a valid name; use the letters a to z, digits and `_`, and no digit first")
    if len(new) > LIMITS.name_length:
        raise RefusedError(f"the name has {len(new)} characters; the limit is {LIMITS.name_length}")
    if reserved(new) and not name.label:
        raise RefusedError(f"`{new}` is a reserved word")
    if new in STATE_WORDS and not name.label:
        raise RefusedError(f"`{new}` is a part of an agent's state")
    if any(other.text == new and other.label == name.label for other in outline.names):
        raise RefusedError(f"`{new}` is already declared")


def _keeps_its_meaning(text: OpenText, name: Name, new: str, places: list[Name]) -> None:
    """Check that the renamed text has the same tree; some words are allowed as names only in some positions.

    Args:
        text: open text.
        name: name to replace.
        new: new name.
        places: all occurrences of the name.

    Raises:
        RefusedError: the renamed text reads differently.
    """
    parts, end = [], 0
    for place in (place for place in places if place.span.source is text.source):
        parts += [text.source.text[end : place.span.start], new]
        end = place.span.end
    renamed = Source(text.source.name, "".join([*parts, text.source.text[end:]]))
    after = Outline.of(renamed, LIMITS)
    mine = [other for other in places if other.span.source is text.source]
    matches = [other for other in after.names if other.text == new and other.label == name.label]
    there = [other for other in matches if other.span.source is renamed]
    if not after.whole or len(there) != len(mine):
        raise RefusedError(f"`{new}` has another meaning where the mission uses `{name.text}`")
