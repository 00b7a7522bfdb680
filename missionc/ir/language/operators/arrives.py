"""``arrives f``: ``f`` now, and not one step ago; false at the first step, before which there is none."""

from __future__ import annotations

from missionc.ir.kernel.nodes import All, Eventually, Node, Not
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return All((body, Eventually(Not(body, use.span), -1, -1, use.span)), use.span)


OPERATOR = Operator(
    name="arrives",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.NONE,
    spatial=False,
    expand=expand,
    says="now, and not one step ago",
    reads="now and not one step ago, {body}",
    example="arrives(base)",
)
