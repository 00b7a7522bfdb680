"""Negation, ``not f``."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Node, Not
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return Not(body, use.span)


OPERATOR = Operator(
    name="not",
    letter="!",
    fixity=Fixity.PREFIX,
    bounds=Bounds.NONE,
    spatial=False,
    expand=expand,
    says="its operand does not hold",
    reads="it is not true that {body}",
    example="not fire",
)
