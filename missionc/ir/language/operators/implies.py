"""Implication, ``f implies g``: ``g`` wherever ``f``."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Any, Node, Not
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    condition, consequence = use.arguments
    return Any((Not(condition, use.span), consequence), use.span)


OPERATOR = Operator(
    name="implies",
    letter="->",
    fixity=Fixity.INFIX,
    bounds=Bounds.NONE,
    spatial=False,
    expand=expand,
    says="the right one wherever the left one",
    reads="if {left}, then {right}",
    example="field implies safe",
)
