"""References in a syntax tree: its nodes, and the names in it that are declared elsewhere."""

from __future__ import annotations

from collections.abc import Iterator

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.syntax import ast

NOT_REFERENCES = frozenset({"name", "label", "kind", "goal", "backend", "unit"})
"""Fields of nodes whose names are declarations or words of the language instead of references."""

LEAVES = (Span, ast.Number, str, float, bool, type(None))
"""Kinds of nodes without children."""


def nodes(root: object) -> Iterator[object]:
    """Yield all nodes at or below ``root``, a node or a tuple of nodes, in any order.

    Numbers, and names that are not references, are omitted. The function is iterative, because a tree may be deeper
    than Python's stack.
    """
    waiting = [root]
    while waiting:
        node = waiting.pop()
        if isinstance(node, tuple):
            waiting.extend(node)
            continue
        yield node
        for name in getattr(node, "__match_args__", ()):  # the fields of a dataclass, faster than by asking for them
            value = getattr(node, name)
            if isinstance(value, LEAVES):
                continue
            if name not in NOT_REFERENCES or not isinstance(value, ast.Name):
                waiting.append(value)
            elif isinstance(value, ast.FamilyName):
                waiting.append(value.indices)


class Mentions(Record):
    """Names that a tree refers to, each once.

    The flags state whether it also refers to every beacon, or to the only graph.
    """

    names: tuple[str, ...]
    every_beacon: bool
    only_graph: bool


def mentions(root: object) -> Mentions:
    names: dict[str, None] = {}
    every_beacon = only_graph = False
    for node in nodes(root):
        match node:
            case ast.Name(text=text):
                names.setdefault(text)
            case ast.Graph(kind="beacons"):
                every_beacon = True
            case ast.Length(graph=None):
                only_graph = True
    return Mentions(tuple(names), every_beacon, only_graph)


def references(root: object) -> Iterator[ast.Name]:
    """Yield all names at or below ``root`` that need a declaration (or are state words)."""
    return (node for node in nodes(root) if isinstance(node, ast.Name))
