"""``every 40 s: f``, recurrence: ``f`` at some step of each stretch of that length from now to the mission's end.

A stretch begins at each step from now on and ends, both ends included, no later than the mission: the horizon cuts
none. Each is asked for at its last step, from where it reaches back, so that the operator may stand at any step.

Source:
    Konrad and Cheng, "Real-time Specification Patterns" (2005), bounded recurrence.
"""

from __future__ import annotations

from missionc.ir.kernel.nodes import Always, Eventually, Node
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def expand(use: Use) -> Node:
    (body,) = use.arguments
    return Always(Eventually(body, -use.period, 0, use.span), use.period, None, use.span)


OPERATOR = Operator(
    name="every",
    letter="",
    fixity=Fixity.PREFIX,
    bounds=Bounds.PERIOD,
    spatial=False,
    expand=expand,
    says="at some step of each stretch of that length, up to the end of the mission",
    reads="in each {period} from {start} to the end of the mission, at some step, {body}",
    example="every 40 s: gate",
)
