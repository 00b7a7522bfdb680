"""``f surround[a..b] g``: the agent is in a group of agents with ``f`` that agents with ``g`` enclose within the
bounds.

In detail: the agent satisfies ``f``. No route over agents with ``f`` of length at most ``b`` leads to an agent with
neither ``f`` nor ``g``. No such route of length below ``a`` leads to an agent without ``f``. No such route leads to an
agent further than ``b`` away.
"""

from __future__ import annotations

import math
from dataclasses import replace

from missionc.ir import Apply, Length
from missionc.ir.kernel.nodes import All, Any, Node, Not, Route
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use
from missionc.ir.language.operators import escape
from missionc.ir.language.weighed_routes import longest, measured_in_metres, up_to, whole_bounds


def expand(use: Use) -> Node:
    inner, border = use.arguments
    length, span = use.length, use.span

    def no_exit(end: Node, high: float) -> Node:
        return Not(_route(replace(length, low=0.0, high=high), inner, end), span)

    parts = [inner, no_exit(Not(Any((inner, border), span), span), length.high)]
    if length.low > 0:
        parts.append(no_exit(Not(inner, span), _next_below(length)))
    if length.high < longest(length):
        beyond = replace(length, low=_next_above(length), high=math.inf)
        parts.append(Not(escape.expand(replace(use, arguments=(inner,), bounds=beyond)), span))
    return All(tuple(parts), span)


def _route(length: Length, through: Node, end: Node) -> Node:
    if not measured_in_metres(length):
        return up_to(length, through, end, whole_bounds(length)[1], length.span)
    return Route(length.graph, through, end, 0.0, length.high, length.span)


def _next_below(length: Length) -> float:
    return math.nextafter(length.low, 0.0) if measured_in_metres(length) else length.low - 1


def _next_above(length: Length) -> float:
    return math.nextafter(length.high, math.inf) if measured_in_metres(length) else length.high + 1


def traps(use: Apply) -> tuple[str, ...]:
    return ("surround without neighbours",)


OPERATOR = Operator(
    name="surround",
    fixity=Fixity.INFIX,
    bounds=Bounds.LENGTH,
    expand=expand,
    says="the agent satisfies the left operand; routes over such agents end, within the bounds, at agents of the right",
    reads="{here} {left}, and the part of {graph} around it, of agents of which each {left}, "
    "ends on every side after {far}, at agents of which each {right}",
    example="base surround[hops 0..3 on radio] field",
    traps=traps,
)
