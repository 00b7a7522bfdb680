"""``f until[a, b] g``: ``g`` at some step of the window, and ``f`` at every step from now up to, not at, that one.

The standard reading. [strel] asks for ``f`` at that step too; that is ``f until[a, b] (f and g)``.
"""

from __future__ import annotations

from missionc.ir import Apply, Window
from missionc.ir.kernel.nodes import Node, Until
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    hold, end = use.arguments
    if use.window.high == 0:  # there is no step before, and so none from which the left one is asked how it goes on
        return end
    return Until(hold, end, use.window.low, use.window.high, use.span)


def traps(use: Apply) -> tuple[str, ...]:
    late = isinstance(use.bounds, Window) and use.bounds.low > 0
    return ("until, at its end", "until, at its beginning", *(("until, before its window",) if late else ()))


OPERATOR = Operator(
    name="until",
    letter="U",
    fixity=Fixity.INFIX,
    bounds=Bounds.TIME,
    spatial=False,
    expand=expand,
    says="the right one at some step of the window, the left one at every step before it",
    reads="{some}, {right}; and {before}, {left}",
    example="safe until[0, 10 s] base",
    traps=traps,
)
