"""Meets and joins of formulas of which some are decided, and some are nobody's.

The logic has three values beside the formulas that are open: true, false, and nobody's (None). What is nobody's would
have been up to an agent that is lost: it makes no whole true and none false, and quantifiers pass it over.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from missionc.kernel.constants import NO, YES, constant
from missionc.kernel.nodes import All, Any, AtLeast, Node, says_opposite


class Decided(Enum):
    """What a formula is worth without another look."""

    TRUE = "true"
    FALSE = "false"
    OPEN = "open"
    NOBODY = "nobody's"


def decided(node: Node | None) -> Decided:
    """Whether a formula is true, false or nobody's whatever comes."""
    value = constant(node) if node is not None else None
    if value is None:
        return Decided.NOBODY if node is None else Decided.OPEN
    return Decided.TRUE if value else Decided.FALSE


class Lattice:
    """Meets and joins; of the same parts the same object is made."""

    def __init__(self) -> None:
        self._made: dict[tuple[object, ...], tuple[Node, tuple[Node, ...]]] = {}

    def whole(self, like: Node, parts: Sequence[Node | None], *, quantified: bool = False) -> Node | None:
        """The meet of parts where ``like`` asks for every one of them, else their join; None where it is nobody's.

        Args:
            quantified: parts that are nobody's are passed over, unless all are.
        """
        absorbing, neutral = (Decided.FALSE, Decided.TRUE) if like.every else (Decided.TRUE, Decided.FALSE)
        worth = [decided(part) for part in parts]
        if absorbing in worth:
            return NO if like.every else YES
        lost = worth.count(Decided.NOBODY)
        if lost and (not quantified or lost == len(parts)):
            return None
        left = dict.fromkeys(part for part in parts if part is not None and decided(part) is not neutral)
        match list(left):
            case []:
                return YES if like.every else NO
            case [only]:
                return only
            case several:
                kind = All if like.every else Any
                return self._kept(kind, tuple(several), 0, like)

    def at_least(self, node: AtLeast, parts: Sequence[Node | None]) -> Node | None:
        """So many of the parts; whoever is lost does not count."""
        there = [part for part in parts if part is not None]
        if parts and not there:
            return None
        worth = [decided(part) for part in there]
        count = node.count - worth.count(Decided.TRUE)
        left = tuple(part for part, each in zip(there, worth, strict=True) if each is Decided.OPEN)
        if count <= 0 or count > len(left):
            return YES if count <= 0 else NO
        return self._kept(AtLeast, left, count, node)

    def _kept(self, kind: type[All | Any | AtLeast], parts: tuple[Node, ...], count: int, like: Node) -> Node:
        """The node of such parts, made once; the parts are kept, so that no other one comes to lie where one lay."""
        span, dual = like.span, says_opposite(like)
        key = (kind, count, span, dual, *map(id, parts))
        if key not in self._made:
            made: Node = AtLeast(count, parts, span, dual) if issubclass(kind, AtLeast) else kind(parts, span, dual)
            self._made[key] = made, parts
        return self._made[key][0]
