"""References in a tree as written: its nodes, and the names in it that are declared elsewhere."""

from __future__ import annotations

from collections.abc import Iterator

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.frontend.syntax import ast

NOT_REFERENCES = frozenset({"name", "label", "kind", "goal", "backend", "unit"})
"""The fields whose names declare, or are words of the language."""

LEAVES = (Span, ast.Number, str, float, bool, type(None))
"""What nothing lies below."""


def nodes(root: object) -> Iterator[object]:
    """Every node at or below ``root``, a node or a tuple of them, but for numbers and names that refer to nothing.

    In any order. Iterative: a tree may be deeper than Python's stack.
    """
    waiting = [root]
    while waiting:
        node = waiting.pop()
        if isinstance(node, tuple):
            waiting.extend(node)
            continue
        yield node
        for name in getattr(node, "__match_args__", ()):  # the fields of a dataclass, sooner than by asking for them
            value = getattr(node, name)
            if isinstance(value, LEAVES):
                continue
            if name not in NOT_REFERENCES or not isinstance(value, ast.Name):
                waiting.append(value)
            elif isinstance(value, ast.FamilyName):
                waiting.append(value.indices)


class Mentions(Record):
    """What a tree says by name: ``names``, each once; and whether it also means every beacon, or the only graph."""

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
    """Every name at or below ``root`` that something must have declared (or that is a state word)."""
    return (node for node in nodes(root) if isinstance(node, ast.Name))
