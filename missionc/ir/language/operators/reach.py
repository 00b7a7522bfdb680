"""``f reach[a..b] g``: a route within the bounds, with ``f`` at every agent except the last, and ``g`` at the last.

A route visits no agent twice. ``Reach`` in the kernel may, which is equivalent for a lower bound of 0, since loops can
be removed. For a positive lower bound, the formula enumerates the first ``low - 1`` agents; the rest is a ``Reach`` of
at least one link over the other agents. This rest ends at an agent other than its start, so at least one link remains
after its loops are removed. It depends on the set of visited agents, not on their order, so the formula grows with the
number of such sets, not with the number of routes.

Source:
    [strel] Table 1, with routes and lower bounds as in its prose.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from math import comb, perm

from missionc.ir import Apply, Length, Truth
from missionc.ir.couplings import lightest
from missionc.ir.kernel.nodes import All, Any, Is, Neighbour, Node, Not, Reach, Route
from missionc.ir.language.operator import Bounds, Fixity, Operator, TooLarge, Use
from missionc.ir.language.weighed_routes import (
    always_true,
    measured_in_metres,
    no_hops,
    nodes_at_most,
    up_to,
    weight_at_least,
    whole_bounds,
)


def expand(use: Use) -> Node | TooLarge:
    through, end = use.arguments
    return reach(use, through, end)


def reach(use: Use, through: Node, end: Node) -> Node | TooLarge:
    """Kernel form of ``through reach[a..b] end`` with the bounds of a use; also used for ``somewhere`` and
    ``everywhere``."""
    length, span = use.length, use.span
    agents = len(length.graph.agents)
    if measured_in_metres(length):
        cost = _up_to(use.room, (perm(agents - 1, links) for links in range(agents))) if length.low > 0 else 0
        route = Route(length.graph, through, end, length.low, length.high, span)
        return TooLarge(cost) if cost > use.room else route
    low, high = whole_bounds(length)
    if low == 0:
        return up_to(length, through, end, high, span)
    if low > high:
        return Any((), span)
    most = low if length.weight is None else min(-(-low // lightest(length.weight)), agents)
    each = 5 if length.weight is None else nodes_at_most(length, high)
    cost = _up_to(use.room, (each * comb(agents, size) * (agents - size) for size in range(most)))
    if cost > use.room:
        return TooLarge(cost)
    if length.weight is not None:
        return weight_at_least(length, through, end, low, high)
    return _some_links(use, through, end, low, high)


def _up_to(room: int, costs: Iterator[int]) -> int:
    """Sum of node counts, or the first partial sum above ``room``.

    For bounds in hops, each set of fewer than ``low`` agents costs a few nodes for each agent outside it. For bounds in
    metres the formula is one node, but its evaluation may have to enumerate routes.
    """
    total = 0
    for cost in costs:
        total += cost
        if total > room:
            break
    return total


def _some_links(use: Use, through: Node, end: Node, low: int, high: int) -> Node:
    graph, span = use.graph, use.span
    here = {agent: Is(frozenset((agent,)), span) for agent in graph.agents}

    @cache
    def outside(body: Node, left: frozenset[int]) -> Node:
        return All((body, Not(Is(left, span), span)), span) if left else body

    @cache
    def leaving(left: frozenset[int]) -> Node:
        """Formula that a route continues from the current agent to an agent outside ``left``, the visited agents."""
        return Any(tuple(onward(agent, left) for agent in graph.agents if agent not in left), span)

    def onward(agent: int, left: frozenset[int]) -> Node:
        behind = left | {agent}
        if len(behind) < low:
            return All((here[agent], through, Neighbour(graph, leaving(behind), span)), span)
        rest = Reach(graph, outside(through, left), outside(end, behind), high - len(left), span)
        return All((here[agent], rest), span)

    return leaving(frozenset())


def traps(use: Apply) -> tuple[str, ...]:
    over_anybody = isinstance(use.operands[0], Truth)
    return (*of_routes(use), *(() if over_anybody else ("last agent of a route",)))


def of_routes(use: Apply) -> tuple[str, ...]:
    """Names of the conventions about routes that affect a use and differ in other tools."""
    assert isinstance(use.bounds, Length)
    if no_hops(use):
        return ("zero hops",)
    if use.bounds.low > 1:
        return ("routes do not turn back", "routes need not be shortest")
    return ("routes do not turn back",) if use.bounds.high > 1 else ()


def _somewhere(use: Use) -> Node | TooLarge:
    """Kernel form of ``somewhere[a..b] f``: a route within the bounds leads to an agent that satisfies ``f``."""
    (body,) = use.arguments
    return reach(use, always_true(use.span), body)


def _everywhere(use: Use) -> Node | TooLarge:
    """Kernel form of ``everywhere[a..b] f``: every route within the bounds leads to an agent that satisfies ``f``."""
    (body,) = use.arguments
    broken = reach(use, always_true(use.span), Not(body, use.span))
    return broken if isinstance(broken, TooLarge) else Not(broken, use.span)


OPERATOR = Operator(
    name="reach",
    letter="R",
    fixity=Fixity.INFIX,
    bounds=Bounds.LENGTH,
    expand=expand,
    says="a route within the bounds, over agents that satisfy the left operand, ends at one that satisfies the right",
    reads="{route} leads from {here} to an agent{perhaps} that {right}, and {left:agent on it but the last}",
    example="safe reach[hops 0..2 on radio] base",
    traps=traps,
)

SOMEWHERE = Operator(
    name="somewhere",
    bounds=Bounds.LENGTH,
    expand=_somewhere,
    says="some route within the bounds ends at an agent that satisfies the operand",
    reads="{route} leads from {here} to an agent{perhaps} that {body}",
    example="somewhere[hops 1..2 on radio] base",
    traps=of_routes,
)

EVERYWHERE = Operator(
    name="everywhere",
    bounds=Bounds.LENGTH,
    expand=_everywhere,
    says="every route within the bounds ends at an agent that satisfies the operand",
    reads="{body:agent to which {route} leads from {here}{included}}",
    example="everywhere[hops 0..1 on radio] not fire",
    traps=of_routes,
)
