"""Ranges and weights of links by ordered pairs of agents, and what follows from them for a graph as a whole."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

from missionc.base.units import Metres
from missionc.ir.couplings import Graph, PairRange, PairWeight, Proximity, Sight, Weight


def range_of(graph: Graph, sender: int, receiver: int) -> Metres:
    """How near the receiver has to be, for a link to lead to it from the sender: two different agents."""
    for each in graph.ranges:
        if sender in each.senders and receiver in each.receivers:
            return each.radius
    return graph.radius


def kinds(graph: Graph) -> tuple[tuple[int, ...], ...]:
    """The agents of a graph, those together whose links have the same ranges, both ways and to one another."""
    return _alike(graph, graph.ranges)


def weigh(weight: Weight, sender: int, receiver: int) -> int:
    """What a link from the one to the other weighs."""
    for each in weight.pairs:
        if sender in each.senders and receiver in each.receivers:
            return each.weight
    return weight.others


def kinds_of_weight(graph: Graph, weight: Weight) -> tuple[tuple[int, ...], ...]:
    """The agents of a graph, those together whose links weigh the same, both ways and to one another."""
    return _alike(graph, weight.pairs)


def lightest(weight: Weight) -> int:
    """What a link weighs at least."""
    return min((weight.others, *(each.weight for each in weight.pairs)))


def heaviest(weight: Weight) -> int:
    """What a link weighs at most."""
    return max((weight.others, *(each.weight for each in weight.pairs)))


def _alike(graph: Graph, pairs: tuple[PairRange, ...] | tuple[PairWeight, ...]) -> tuple[tuple[int, ...], ...]:
    alike: dict[tuple[tuple[bool, bool], ...], list[int]] = {}
    for agent in graph.agents:
        sides = tuple((agent in each.senders, agent in each.receivers) for each in pairs)
        alike.setdefault(sides, []).append(agent)
    return tuple(map(tuple, alike.values()))


def directed(graph: Graph) -> bool:
    """Whether some two agents have another range one way than the other way."""
    firsts = [kind[0] for kind in kinds(graph)] if graph.ranges else []
    return any(range_of(graph, one, other) != range_of(graph, other, one) for one, other in product(firsts, firsts))


def all_ranges(graph: Graph) -> tuple[Metres, ...]:
    """The ranges that its pairs have, each once, the longest first; none where it has no two agents."""
    return tuple(sorted(set(_of_pairs(graph)), reverse=True))


def between(graph: Graph, sender: int, receiver: int) -> Graph:
    """The graph as if the links of all its agents had the range of this pair."""
    if not graph.ranges:
        return graph
    return with_ranges(graph, range_of(graph, sender, receiver), ())


def with_ranges(graph: Graph, radius: Metres, ranges: tuple[PairRange, ...]) -> Graph:
    """The graph with other ranges."""
    if isinstance(graph, Proximity | Sight):
        return replace(graph, radius=radius, ranges=ranges)
    return replace(graph, radius=radius)


def _of_pairs(graph: Graph) -> Iterator[Metres]:
    alike = kinds(graph)
    for one, other in product(alike, alike):
        if one is not other or len(one) > 1:
            yield range_of(graph, one[0], other[-1])
