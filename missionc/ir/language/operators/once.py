"""``once[a, b] f``: ``f`` at some step of the window, which reaches back; false where that holds no step."""

from __future__ import annotations

from missionc.ir.kernel.nodes import Eventually, Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return Eventually(body, *use.back, use.span)


OPERATOR = Operator(
    name="once",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.PAST,
    spatial=False,
    expand=expand,
    says="at some step of the window, which reaches back",
    reads="{some}, {body}",
    example="once[0, 5 s] base",
)
