"""Document symbols: the declarations of a text, for its table of contents."""

from __future__ import annotations

from lsprotocol import types

from missionc.base.source import Span
from missionc.lsp.open_text import OpenText
from missionc.resolve.names import Kind, Named, kind_of
from missionc.syntax import ast

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
    """What this text itself declares; where a declaration cannot be read, the name that it seems to declare."""
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
    """A name, of a family with its indices: ``w[i in 0..9]``."""
    return name.whole_span.text if isinstance(name, ast.FamilyName) else name.text


def _symbol(
    text: OpenText, name: str, kind: types.SymbolKind, detail: str, whole: Span, words: Span
) -> types.DocumentSymbol:
    return types.DocumentSymbol(name, kind, text.places.range(whole), text.places.range(words), detail)
