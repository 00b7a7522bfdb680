"""``always[a, b] f``: ``f`` at every step of the window."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Always, Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return Always(body, use.window.low, use.window.high, use.span)


OPERATOR = Operator(
    name="always",
    letter="G",
    fixity=Fixity.PREFIX,
    bounds=Bounds.TIME,
    spatial=False,
    expand=expand,
    says="at every step of the window",
    reads="{each}, {body}",
    example="always[0, 20 s] not fire",
)
