"""Semantic tokens: every name coloured by its kind, at its declaration and its uses."""

from __future__ import annotations

from lsprotocol import types

from missionc.frontend.resolve.context import Kind
from missionc.tools.language_server.open_text import Name, OpenText

Colour = types.SemanticTokenTypes

COLOURS = {
    Kind.PARAM: Colour.Parameter,
    Kind.REGION: Colour.Type,
    Kind.OBSTACLE: Colour.Struct,
    Kind.BEACON: Colour.EnumMember,
    Kind.TEAM: Colour.Class,
    Kind.AGENT: Colour.Class,
    Kind.GROUP: Colour.Class,
    Kind.GRAPH: Colour.Interface,
    Kind.FORMATION: Colour.Enum,
    Kind.RESOURCE: Colour.Property,
    Kind.FLAG: Colour.Property,
    Kind.LET: Colour.Function,
}
"""Token type by kind of name; only types of the protocol, for which every theme has a colour."""

LABEL, INDEX = Colour.Event, Colour.Variable
TYPES = tuple(dict.fromkeys((*COLOURS.values(), LABEL, INDEX)))
DECLARATION = 1
LEGEND = types.SemanticTokensLegend(
    [each.value for each in TYPES], [types.SemanticTokenModifiers.Declaration.value]
)  # one bit for each modifier, the lowest for the first


def semantic_tokens(text: OpenText) -> types.SemanticTokens:
    """Semantic tokens of a text, encoded as five numbers each: line and character offsets, length, type, modifiers."""
    data: list[int] = []
    line = character = 0
    own = [name for name in text.outline.names if name.span.source.name == text.source.name]
    for name in sorted(own, key=lambda name: name.span.start):
        colour = _colour(name)
        if colour is None or name.span.text != name.text:
            continue
        here = text.places.range(name.span)
        start, length = here.start, here.end.character - here.start.character
        across = start.character - character if start.line == line else start.character
        data += [start.line - line, across, length, TYPES.index(colour), DECLARATION if name.declares else 0]
        line, character = start.line, start.character
    return types.SemanticTokens(data)


def _colour(name: Name) -> Colour | None:
    """Token type of a name; None if it is undeclared."""
    if name.label:
        return LABEL
    if name.index is not None:
        return INDEX
    return COLOURS[name.kind] if name.kind is not None else None
