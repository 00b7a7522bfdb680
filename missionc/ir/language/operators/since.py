"""``f since[a, b] g``: ``g`` at some step of the window, which reaches back, and ``f`` at every step after that one.

The mirror image of ``until``: ``f`` from now back to, not at, the step with ``g``.
"""

from __future__ import annotations

from missionc.ir.kernel.nodes import Node, Until
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    hold, end = use.arguments
    if use.window.high == 0:  # there is no step after it
        return end
    return Until(hold, end, *use.back, use.span)


OPERATOR = Operator(
    name="since",
    letter="",
    fixity=Fixity.INFIX,
    bounds=Bounds.PAST,
    spatial=False,
    expand=expand,
    says="the right one at some step of the window, which reaches back, the left one at every step after it",
    reads="{some}, {right}; and {before}, {left}",
    example="safe since[0, 10 s] base",
)
