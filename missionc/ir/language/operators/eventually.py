"""``eventually[a, b] f``: ``f`` at some step of the window."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Eventually, Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return Eventually(body, use.window.low, use.window.high, use.span)


OPERATOR = Operator(
    name="eventually",
    letter="F",
    fixity=Fixity.PREFIX,
    bounds=Bounds.TIME,
    spatial=False,
    expand=expand,
    says="at some step of the window",
    reads="{some}, {body}",
    example="eventually[0, 12 s] survivor",
)
