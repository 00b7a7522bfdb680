"""``historically[a, b] f``: ``f`` at every step of the window, which reaches back; true where that holds no step."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Always, Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return Always(body, *use.back, use.span)


OPERATOR = Operator(
    name="historically",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.PAST,
    spatial=False,
    expand=expand,
    says="at every step of the window, which reaches back",
    reads="{each}, {body}",
    example="historically[0, 5 s] not fire",
)
