"""Equivalence, ``f iff g``: both or neither."""

from __future__ import annotations

from missionc.ir.kernel.nodes import All, Any, Node, Not
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    left, right = use.arguments
    span = use.span
    return All((Any((Not(left, span), right), span), Any((Not(right, span), left), span)), span)


OPERATOR = Operator(
    name="iff",
    letter="<->",
    fixity=Fixity.INFIX,
    bounds=Bounds.NONE,
    spatial=False,
    expand=expand,
    says="both hold, or neither",
    reads="{left}, exactly when {right}",
    example="field iff drone[0]",
)
