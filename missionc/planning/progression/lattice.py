"""Conjunctions and disjunctions of formulas that may be decided, or undefined because of lost agents.

Besides undecided formulas, the logic has three values: true, false, and undefined (None). A formula is undefined if
only a lost agent could decide it. An undefined part does not decide a conjunction or disjunction, and quantifiers skip
it.
"""

from __future__ import annotations

from collections.abc import Sequence

from missionc.ir.kernel.nodes import All, Any, AtLeast, Node, says_opposite
from missionc.ir.kernel.normal_form import constant, truth


class Lattice:
    """Cache of conjunctions and disjunctions; equal parts give the same object."""

    def __init__(self) -> None:
        self._made: dict[tuple[object, ...], tuple[Node, tuple[Node, ...]]] = {}

    def whole(self, like: Node, parts: Sequence[Node | None], *, quantified: bool = False) -> Node | None:
        """Conjunction of the parts if ``like`` is universal, otherwise their disjunction; None if undefined.

        Args:
            quantified: True to skip undefined parts, unless all are undefined.
        """
        left = tuple(dict.fromkeys(part for part in parts if part is not None and constant(part) is not like.every))
        if any(constant(part) is not None for part in left):
            return truth(not like.every)
        if None in parts and (not quantified or parts.count(None) == len(parts)):
            return None
        if len(left) <= 1:
            return left[0] if left else truth(like.every)
        return self._kept(All if like.every else Any, left, 0, like)

    def at_least(self, node: AtLeast, parts: Sequence[Node | None]) -> Node | None:
        """Formula that at least ``node.count`` of the parts are true, where parts of lost agents do not count; None if
        undefined."""
        there = [part for part in parts if part is not None]
        if parts and not there:
            return None
        count = node.count - sum(constant(part) is True for part in there)
        left = tuple(part for part in there if constant(part) is None)
        if not 0 < count <= len(left):
            return truth(count <= 0)
        return self._kept(AtLeast, left, count, node)

    def _kept(self, kind: type[All | Any | AtLeast], parts: tuple[Node, ...], count: int, like: Node) -> Node:
        """Cached node over these parts; the cache keeps the parts alive so that their identities stay unique."""
        span, dual = like.span, says_opposite(like)
        key = (kind, count, span, dual, *map(id, parts))
        if key not in self._made:
            made: Node = AtLeast(count, parts, span, dual) if issubclass(kind, AtLeast) else kind(parts, span, dual)
            self._made[key] = made, parts
        return self._made[key][0]
