"""Route lengths in kernel formulas: what more than one spatial operator needs."""

from __future__ import annotations

import math

from missionc.base.source import Span
from missionc.ir import Apply, Length
from missionc.ir.pair_ranges import heaviest
from missionc.kernel.nodes import All, Is, Node, Not, PathLength, Reach
from missionc.language.weighed_routes import within
from missionc.syntax.ast import Metric


def most_hops(length: Length) -> int:
    """Links of the longest route without repeated agents: one fewer than the graph's agents."""
    return max(len(length.graph.agents) - 1, 0)


def longest(length: Length) -> float:
    """How long a route without repeated agents can be: in hops, or in what links weigh; in metres, without limit."""
    if measured_in_metres(length):
        return math.inf
    return most_hops(length) * (1 if length.weight is None else heaviest(length.weight))


def whole_bounds(length: Length) -> tuple[int, int]:
    """The bounds of a length that is not in metres as whole numbers, the upper one at most ``longest``."""
    return int(length.low), int(min(length.high, longest(length)))


def measured_in_metres(length: Length) -> bool:
    return length.metric is Metric.METRES


def up_to(length: Length, through: Node, end: Node, most: int, span: Span) -> Node:
    """A route over ``through`` agents to an ``end`` of at most so many hops, or so much weight."""
    if length.weight is not None:
        return within(length, through, end, most)
    return Reach(length.graph, through, end, min(most, most_hops(length)), span)


def no_hops(use: Apply) -> bool:
    """Whether the agent itself is within the bounds: a route of no links will do."""
    return isinstance(use.bounds, Length) and use.bounds.low <= 0


def always_true(span: Span) -> Node:
    return All((), span)


def distance_to(length: Length, agent: int, span: Span) -> Node:
    """The shortest way from here to ``agent``, over any agents, is within the bounds."""
    if measured_in_metres(length):
        return PathLength(length.graph, agent, length.low, length.high, span)
    low, high = whole_bounds(length)
    near = _within(length, agent, high, span)
    return near if low == 0 else All((near, Not(_within(length, agent, low - 1, span), span)), span)


def distance_from(length: Length, agent: int, span: Span) -> Node:
    """``distance_to`` where a route to ``agent`` is known to be there, so that an open bound asks no more."""
    if not measured_in_metres(length) and length.low > 0 and length.high >= longest(length):
        low = int(length.low)
        return Not(_within(length, agent, low - 1, span), span)
    return distance_to(length, agent, span)


def _within(length: Length, agent: int, most: int, span: Span) -> Node:
    target = Is(frozenset((agent,)), span)
    return target if most == 0 else up_to(length, always_true(span), target, most, span)
