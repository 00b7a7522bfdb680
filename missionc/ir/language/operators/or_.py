"""Disjunction, ``f or g``."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Any, Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    return Any(use.arguments, use.span)


OPERATOR = Operator(
    name="or",
    letter="|",
    fixity=Fixity.INFIX,
    bounds=Bounds.NONE,
    spatial=False,
    expand=expand,
    says="one holds, or both",
    reads="at least one of these holds: {parts}",
    example="base or field",
)
