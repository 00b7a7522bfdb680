"""Link ranges and link weights by ordered pairs of agents, and derived properties of a graph."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

from missionc.base.units import Metres
from missionc.ir.couplings import Graph, PairRange, PairWeight, Proximity, Sight, Weight


def range_of(graph: Graph, sender: int, receiver: int) -> Metres:
    """Communication range of the link from ``sender`` to ``receiver`` (different agents), metres."""
    for each in graph.ranges:
        if sender in each.senders and receiver in each.receivers:
            return each.radius
    return graph.radius


def kinds(graph: Graph) -> tuple[tuple[int, ...], ...]:
    """Groups of a graph's agents with equal link ranges, in both directions and within the group."""
    return _alike(graph, graph.ranges)


def weigh(weight: Weight, sender: int, receiver: int) -> int:
    """Weight of the link from ``sender`` to ``receiver``."""
    for each in weight.pairs:
        if sender in each.senders and receiver in each.receivers:
            return each.weight
    return weight.others


def kinds_of_weight(graph: Graph, weight: Weight) -> tuple[tuple[int, ...], ...]:
    """Groups of a graph's agents with equal link weights, in both directions and within the group."""
    return _alike(graph, weight.pairs)


def lightest(weight: Weight) -> int:
    """Least weight of any link."""
    return min((weight.others, *(each.weight for each in weight.pairs)))


def heaviest(weight: Weight) -> int:
    """Greatest weight of any link."""
    return max((weight.others, *(each.weight for each in weight.pairs)))


def _alike(graph: Graph, pairs: tuple[PairRange, ...] | tuple[PairWeight, ...]) -> tuple[tuple[int, ...], ...]:
    alike: dict[tuple[tuple[bool, bool], ...], list[int]] = {}
    for agent in graph.agents:
        sides = tuple((agent in each.senders, agent in each.receivers) for each in pairs)
        alike.setdefault(sides, []).append(agent)
    return tuple(map(tuple, alike.values()))


def directed(graph: Graph) -> bool:
    """Return true if some pair of agents has different link ranges in the two directions."""
    firsts = [kind[0] for kind in kinds(graph)] if graph.ranges else []
    return any(range_of(graph, one, other) != range_of(graph, other, one) for one, other in product(firsts, firsts))


def all_ranges(graph: Graph) -> tuple[Metres, ...]:
    """Distinct link ranges of the graph's pairs, metres, in descending order; empty for fewer than two agents."""
    return tuple(sorted(set(_of_pairs(graph)), reverse=True))


def between(graph: Graph, sender: int, receiver: int) -> Graph:
    """Graph in which all links have the range of this pair of agents."""
    if not graph.ranges:
        return graph
    return with_ranges(graph, range_of(graph, sender, receiver), ())


def with_ranges(graph: Graph, radius: Metres, ranges: tuple[PairRange, ...]) -> Graph:
    """Graph with another default range ``radius``, metres, and other pair ranges."""
    if isinstance(graph, Proximity | Sight):
        return replace(graph, radius=radius, ranges=ranges)
    return replace(graph, radius=radius)


def _of_pairs(graph: Graph) -> Iterator[Metres]:
    alike = kinds(graph)
    for one, other in product(alike, alike):
        if one is not other or len(one) > 1:
            yield range_of(graph, one[0], other[-1])
