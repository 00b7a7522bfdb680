"""``f release[a, b] g``: ``g`` throughout the window, until ``f`` has freed it; the dual of ``until``."""

from __future__ import annotations

from missionc.ir import Apply
from missionc.ir.kernel.nodes import Node, Release
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    frees, held = use.arguments
    window = use.window
    if window.high == 0:
        return held
    return Release(frees, held, window.low, window.high, use.span)


def traps(use: Apply) -> tuple[str, ...]:
    return ("release, at its end",)


OPERATOR = Operator(
    name="release",
    letter="Rel",
    fixity=Fixity.INFIX,
    bounds=Bounds.TIME,
    spatial=False,
    expand=expand,
    says="the right one at every step of the window, or up to and with a step where the left one held before",
    reads="{each}, {right}, unless {earlier}, {left}",
    example="charged release[0, 10 s] base",
    traps=traps,
)
