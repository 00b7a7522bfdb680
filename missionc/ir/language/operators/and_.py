"""Conjunction, ``f and g``."""

from __future__ import annotations

from missionc.ir.kernel.nodes import All, Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    return All(use.arguments, use.span)


OPERATOR = Operator(
    name="and",
    letter="&",
    fixity=Fixity.INFIX,
    bounds=Bounds.NONE,
    spatial=False,
    expand=expand,
    says="both hold",
    reads="all of these hold: {parts}",
    example="base and speed <= 1",
)
