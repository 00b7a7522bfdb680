"""``next f``: ``f`` one step from now."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Eventually, Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return Eventually(body, 1, 1, use.span)


OPERATOR = Operator(
    name="next",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.NONE,
    spatial=False,
    expand=expand,
    says="one step from now",
    reads="{some}, {body}",
    example="next base",
)
