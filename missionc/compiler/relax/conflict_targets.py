"""Parameters of conflicting requirements, and the direction of change that weakens each requirement.

in   kernel formulas
out  ConflictTargets
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeVar

from missionc.base.source import Span
from missionc.ir.kernel.nodes import AtLeast, Atom, Node, Not
from missionc.ir.kernel.walk import children, graph_of, route_bounds, window_of

Key = TypeVar("Key", Span, str)


class ConflictTarget(Enum):
    """Direction in which a parameter weakens a requirement: larger, smaller, or EITHER if it occurs in both senses."""

    MORE = 1
    LESS = -1
    EITHER = 0


@dataclass(slots=True)
class ConflictTargets:
    """Parameters of conflicting requirements by source text or name, each with its weakening direction.

    ``windows``: last step of a window, or length of a period. ``lengths``: upper bound of a route. ``counts``: number
    of agents. ``comparisons``: value compared with zero, as a sum that has to be positive.
    """

    windows: dict[Span, ConflictTarget] = field(default_factory=dict)
    lengths: dict[Span, ConflictTarget] = field(default_factory=dict)
    counts: dict[Span, ConflictTarget] = field(default_factory=dict)
    comparisons: dict[Span, ConflictTarget] = field(default_factory=dict)
    graphs: dict[str, ConflictTarget] = field(default_factory=dict)
    regions: dict[str, ConflictTarget] = field(default_factory=dict)
    formations: dict[str, ConflictTarget] = field(default_factory=dict)


def conflict_targets(formulas: Iterable[Node]) -> ConflictTargets:
    """Parameters that occur in these required formulas, with their weakening directions."""
    found = ConflictTargets()
    stack = [(formula, 1) for formula in formulas][::-1]
    seen: set[tuple[Node, int]] = set()
    while stack:
        node, sign = stack.pop()
        if (node, sign) in seen:
            continue
        seen.add((node, sign))
        below = -sign if isinstance(node, Not) else sign
        _note(found, node, sign)
        stack.extend((child, below) for child in reversed(children(node)))
    return found


def _note(found: ConflictTargets, node: Node, sign: int) -> None:
    span = node.span
    match node:
        case Atom(predicate):
            if predicate.region:
                _add(found.regions, predicate.region.name, sign)
            elif predicate.formation:
                _add(found.formations, predicate.formation.name, sign)
            else:
                _add(found.comparisons, span, sign)
        case AtLeast():
            # Too few hold if enough of the others fail: the number changes in the other direction.
            _add(found.counts, span, sign if node.dual else -sign)
        case _:
            sign = -sign if node.every else sign
            if (window := window_of(node)) and window[1] is not None:
                _add(found.windows, span, sign)
            if graph := graph_of(node):
                # A wider graph has shorter paths and new links; their effect on a bound is unknown.
                _add(found.graphs, graph.name, sign if children(node) else 0)
            if route_bounds(node):
                _add(found.lengths, span, sign)


def _add(ways: dict[Key, ConflictTarget], key: Key | None, sign: int) -> None:
    if key is not None:
        way = ConflictTarget(sign)
        ways[key] = way if ways.get(key, way) is way else ConflictTarget.EITHER
