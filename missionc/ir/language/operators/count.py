"""``count[a..b] f >= n``: at least ``n`` agents satisfy ``f`` at a shortest-path distance within the bounds.

The evaluated agent itself counts if the lower bound is 0, even if it is outside the graph.

For a count of 1, the formula is a route to any agent that satisfies ``f``; ``reach`` expresses it without naming
agents. The route is also necessary for larger counts, with at least the same robustness. A larger count is therefore a
conjunction of both formulas, and its robustness remains the ``n``-th largest.
"""

from __future__ import annotations

from dataclasses import replace

from missionc.ir import Apply
from missionc.ir.kernel.nodes import All, At, AtLeast, Is, Node, Not
from missionc.ir.language.operator import Bounds, Operator, TooLarge, Use
from missionc.ir.language.operators.reach import reach
from missionc.ir.language.weighed_routes import always_true, distance_to, measured_in_metres, no_hops


def expand(use: Use) -> Node | TooLarge:
    some = _some_agent(use)
    if isinstance(some, TooLarge):
        return some
    every, span, number = _each_agent(use), use.span, use.number

    def at_least(count: int) -> Node:
        if some is None or count < 1:
            return AtLeast(count, every, span)
        if count == 1 and use.length.low <= 1:
            return some
        return All((some, AtLeast(count, every, span)), span)

    def fewer_than(count: int) -> Node:
        return Not(at_least(count) if count == 1 else AtLeast(count, every, span), span)

    match use.comparison:
        case ">=":
            return at_least(number)
        case ">":
            return at_least(number + 1)
        case "<=":
            return fewer_than(number + 1)
        case "<":
            return fewer_than(number)
        case "=":
            return All((at_least(number), fewer_than(number + 1)), span)
        case _:
            raise AssertionError(use.comparison)


def _each_agent(use: Use) -> tuple[Node, ...]:
    """For each agent that may count, the formula that it satisfies ``f`` at a distance within the bounds."""
    (body,) = use.arguments
    length, span = use.length, use.span

    def counts(agent: int) -> Node:
        other = Not(Is(frozenset((agent,)), span), span)
        return All((other, distance_to(length, agent, span), At(agent, body, span)), span)

    itself = (body,) if length.low <= 0 else ()
    return itself + tuple(counts(agent) for agent in length.graph.agents)


def _some_agent(use: Use) -> Node | TooLarge | None:
    """Formula of a route to some agent that satisfies ``f`` within the upper bound, excluding the evaluated agent if it
    does not count.

    The result is None for lengths in metres with a lower bound, which would need an enumeration of routes.
    """
    (body,) = use.arguments
    length = use.length
    if length.low > 0 and measured_in_metres(length):
        return None
    nearer = replace(use, bounds=replace(length, low=min(length.low, 1.0)))
    return reach(nearer, always_true(use.span), body)


def traps(use: Apply) -> tuple[str, ...]:
    return ("count includes the agent itself",) if no_hops(use) else ()


OPERATOR = Operator(
    name="count",
    bounds=Bounds.LENGTH,
    expand=expand,
    says="the given number of agents at a distance within the bounds satisfy the operand",
    reads="of the agents whose shortest way from {here} on {graph} is {far}{included}, there are {number} "
    "of which each {body}",
    example="count[hops 1..1 on radio] field >= 2",
    traps=traps,
)
