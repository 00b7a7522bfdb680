"""``leaves f``: ``f`` one step ago, and not now; false at the first step, before which there is none."""

from __future__ import annotations

from missionc.ir.kernel.nodes import All, Eventually, Node, Not
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return All((Not(body, use.span), Eventually(body, -1, -1, use.span)), use.span)


OPERATOR = Operator(
    name="leaves",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.NONE,
    spatial=False,
    expand=expand,
    says="not now, and one step ago",
    reads="one step ago and not now, {body}",
    example="leaves(base)",
)
