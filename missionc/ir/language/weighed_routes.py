"""Routes with a bounded total link weight in kernel form: a recursion over links with the remaining weight.

Every link weighs at least 1, so the recursion ends. Its states depend on the remaining weight and on the link weights
of an agent, not on agent names. With a lower bound, they also depend on the agents already visited. The helpers for
route lengths serve all spatial operators.
"""

from __future__ import annotations

import math
from functools import cache

from missionc.base.source import Span
from missionc.base.units import Metric
from missionc.ir import Apply, Graph, Length, Weight
from missionc.ir.couplings import heaviest, kinds_of_weight, weigh
from missionc.ir.kernel.nodes import All, Any, Is, Neighbour, Node, Not, PathLength, Reach


def nodes_at_most(length: Length, most: int) -> int:
    """Estimated number of kernel nodes for routes of weight up to ``most``."""
    assert length.weight is not None
    alike = len(kinds_of_weight(length.graph, length.weight))
    return (most + 1) * (4 + alike * (3 + 2 * alike))


def weight_within(length: Length, through: Node, end: Node, most: int) -> Node:
    """Formula of a route through ``through`` agents to an ``end`` agent with a total weight of at most ``most``."""
    graph, weight, span = length.graph, length.weight, length.span
    assert weight is not None
    ways = _ways(graph, weight)
    left = {most}
    for _ in range(len(graph.agents)):
        more = {rest - each for rest in left for each in {w for _, _, w in ways} if rest >= each} - left
        if not more:
            break
        left |= more
    made: dict[int, Node] = {}
    for rest in sorted(left):
        onward = _onward(graph, ways, made, rest, span)
        made[rest] = Any((end, All((through, onward), span)), span) if onward.parts else end
    return made[most]


def weight_at_least(length: Length, through: Node, end: Node, low: int, high: int) -> Node:
    """Formula of a route through ``through`` agents to an ``end`` agent with a total weight of ``low`` (above 0) to
    ``high``.

    The route repeats no agent. Up to the weight ``low``, the formula distinguishes the visited agents. The rest runs
    over the other agents; removing the loops of a walk among them gives a route.
    """
    graph, weight, span = length.graph, length.weight, length.span
    assert weight is not None
    here = {agent: Is(frozenset((agent,)), span) for agent in graph.agents}

    @cache
    def rest(behind: frozenset[int], most: int) -> Node:
        outside = Not(Is(behind, span), span)
        return weight_within(length, All((through, outside), span), All((end, outside), span), most)

    @cache
    def leaving(behind: frozenset[int], spent: int) -> Node:
        """Formula that a route continues from an agent outside the visited agents ``behind``, after the weight
        ``spent``."""
        return Any(tuple(from_(agent, behind, spent) for agent in graph.agents if agent not in behind), span)

    @cache
    def from_(agent: int, behind: frozenset[int], spent: int) -> Node:
        left = behind | {agent}
        ends = tuple(arriving(agent, other, left, spent) for other in graph.agents if other not in left)
        return All((here[agent], through, Neighbour(graph, Any(ends, span), span)), span)

    def arriving(agent: int, other: int, left: frozenset[int], spent: int) -> Node:
        total = spent + weigh(weight, agent, other)
        if total > high:
            return Any((), span)
        onward = rest(left, high - total) if total >= low else from_(other, left, total)
        return All((here[other], onward), span)

    return leaving(frozenset(), 0)


def _ways(graph: Graph, weight: Weight) -> tuple[tuple[tuple[int, ...], tuple[int, ...], int], ...]:
    """Groups of agents with equal link weights, pairwise: source agents, target agents, weight of the links between
    them."""
    alike = kinds_of_weight(graph, weight)
    return tuple(
        (senders, receivers, weigh(weight, senders[0], receivers[-1]))
        for senders in alike
        for receivers in alike
        if senders is not receivers or len(senders) > 1
    )


def _onward(
    graph: Graph,
    ways: tuple[tuple[tuple[int, ...], tuple[int, ...], int], ...],
    made: dict[int, Node],
    rest: int,
    span: Span,
) -> Any:
    """Formula of a link of weight at most ``rest`` to an agent from which a route of the remaining weight exists.

    Args:
        made: formula of a route by its remaining weight.
    """
    starts: dict[tuple[int, ...], list[Node]] = {}
    for senders, receivers, each in ways:
        if each <= rest and rest - each in made:
            ends = All((Is(frozenset(receivers), span), made[rest - each]), span)
            starts.setdefault(senders, []).append(ends)
    return Any(
        tuple(
            All((Is(frozenset(senders), span), Neighbour(graph, Any(tuple(ends), span), span)), span)
            for senders, ends in starts.items()
        ),
        span,
    )


def most_hops(length: Length) -> int:
    """Number of links of the longest route without repeated agents: one less than the number of agents."""
    return max(len(length.graph.agents) - 1, 0)


def longest(length: Length) -> float:
    """Greatest length of a route without repeated agents, in hops or weight; infinite in metres."""
    if measured_in_metres(length):
        return math.inf
    return most_hops(length) * (1 if length.weight is None else heaviest(length.weight))


def whole_bounds(length: Length) -> tuple[int, int]:
    """Bounds of a length in hops or weight as integers; the upper bound is at most ``longest``."""
    return int(length.low), int(min(length.high, longest(length)))


def measured_in_metres(length: Length) -> bool:
    return length.metric is Metric.METRES


def up_to(length: Length, through: Node, end: Node, most: int, span: Span) -> Node:
    """Formula of a route through ``through`` agents to an ``end`` agent with at most ``most`` hops, or at most that
    weight."""
    if length.weight is not None:
        return weight_within(length, through, end, most)
    return Reach(length.graph, through, end, min(most, most_hops(length)), span)


def no_hops(use: Apply) -> bool:
    """Return true if the bounds allow a route without links, so that the agent reaches itself."""
    return isinstance(use.bounds, Length) and use.bounds.low <= 0


def always_true(span: Span) -> Node:
    return All((), span)


def distance_to(length: Length, agent: int, span: Span) -> Node:
    """Formula that the shortest path from the evaluated agent to ``agent``, over any agents, is within the bounds."""
    if measured_in_metres(length):
        return PathLength(length.graph, agent, length.low, length.high, span)
    low, high = whole_bounds(length)
    near = _within(length, agent, high, span)
    return near if low == 0 else All((near, Not(_within(length, agent, low - 1, span), span)), span)


def distance_from(length: Length, agent: int, span: Span) -> Node:
    """Formula of ``distance_to`` for an agent that a route is known to reach, so that an infinite bound adds no
    condition."""
    if not measured_in_metres(length) and length.low > 0 and length.high >= longest(length):
        low = int(length.low)
        return Not(_within(length, agent, low - 1, span), span)
    return distance_to(length, agent, span)


def _within(length: Length, agent: int, most: int, span: Span) -> Node:
    target = Is(frozenset((agent,)), span)
    return target if most == 0 else up_to(length, always_true(span), target, most, span)
