"""The indices of families and of ``for``: where each is named, and where it is used."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from missionc.base.source import Span
from missionc.syntax import ast
from missionc.syntax.references import LEAVES


def index_names(declaration: ast.Declaration) -> Iterator[tuple[ast.Name, Span]]:
    """Every place where an index stands, with the place that names it: the innermost one around it."""
    waiting: list[tuple[object, Mapping[str, Span]]] = [(declaration, _named(_family(declaration)))]
    while waiting:
        node, scope = waiting.pop()
        if isinstance(node, tuple):
            waiting += [(part, scope) for part in node]
            continue
        if isinstance(node, ast.ForEach):
            scope = {**scope, **_named(node.indices)}
        if isinstance(node, ast.Index):
            yield node.name, node.name.span
            waiting += [(node.low, scope), (node.high, scope)]
            continue
        if type(node) is ast.Name and node.text in scope:
            yield node, scope[node.text]
        for field in getattr(node, "__match_args__", ()):
            value = getattr(node, field)
            if not isinstance(value, LEAVES):
                waiting.append((value, scope))


def _family(declaration: ast.Declaration) -> tuple[ast.Index, ...]:
    """The indices of a declaration that is a family; none of any other."""
    name = (
        declaration.label if isinstance(declaration, ast.Require | ast.Prefer) else getattr(declaration, "name", None)
    )
    return name.indices if isinstance(name, ast.FamilyName) else ()


def _named(indices: tuple[ast.Index, ...]) -> dict[str, Span]:
    return {index.name.text: index.name.span for index in indices}
