"""Route lengths in kernel formulas: what more than one spatial operator needs."""

from __future__ import annotations

from missionc.base.source import Span
from missionc.ir import Apply, Length
from missionc.kernel.nodes import All, Is, Node, Not, PathLength, Reach
from missionc.syntax.ast import Metric


def most_hops(length: Length) -> int:
    """Links of the longest route without repeated agents: one fewer than the graph's agents."""
    return max(len(length.graph.agents) - 1, 0)


def whole_hops(length: Length) -> tuple[int, int]:
    """The bounds of a length in hops as whole numbers, the upper one at most ``most_hops``."""
    return int(length.low), int(min(length.high, most_hops(length)))


def measured_in_hops(length: Length) -> bool:
    return length.metric is Metric.HOPS


def no_hops(use: Apply) -> bool:
    """Whether the agent itself is within the bounds: a route of no links will do."""
    return isinstance(use.bounds, Length) and use.bounds.low <= 0


def always_true(span: Span) -> Node:
    return All((), span)


def distance_to(length: Length, agent: int, span: Span) -> Node:
    """The shortest way from here to ``agent``, over any agents, is within the bounds."""
    if not measured_in_hops(length):
        return PathLength(length.graph, agent, length.low, length.high, span)
    low, high = whole_hops(length)
    near = _within(length, agent, high, span)
    return near if low == 0 else All((near, Not(_within(length, agent, low - 1, span), span)), span)


def distance_from(length: Length, agent: int, span: Span) -> Node:
    """``distance_to`` where a route to ``agent`` is known to be there, so that an open bound asks no more."""
    low, high = whole_hops(length)
    if measured_in_hops(length) and low > 0 and high == most_hops(length):
        return Not(_within(length, agent, low - 1, span), span)
    return distance_to(length, agent, span)


def _within(length: Length, agent: int, hops: int, span: Span) -> Node:
    target = Is(frozenset((agent,)), span)
    if hops == 0:
        return target
    return Reach(length.graph, always_true(span), target, min(hops, most_hops(length)), span)
