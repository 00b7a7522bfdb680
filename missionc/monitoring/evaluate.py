"""Evaluation of kernel formulas along a trace, in the logic of truth or of robustness."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable
from functools import reduce
from typing import assert_never

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.ir import Graph, Mission, Predicate
from missionc.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.kernel.normal_form import dual
from missionc.kernel.walk import children, postorder
from missionc.language.margins.links import all_links, pieces
from missionc.language.margins.predicate_margins import margin
from missionc.monitoring import graph_routes, temporal_windows
from missionc.monitoring.logic import Logic, Values
from missionc.world.signed_distance import distance_between


class Evaluation:
    """Values of the formulas asked for and of what is below them.

    A value is (agents, steps + 1), or 1 in place of either where it does not
    depend on it. A node's value is forgotten once the last formula that needs
    it has its own, so that many nodes need little memory.

    Raises:
        ValueError: the trace has other agents than the mission.
    """

    def __init__(self, logic: Logic, mission: Mission, trace: Trace) -> None:
        if trace.position.shape[0] != len(mission.agents):
            raise ValueError(f"the trace has {trace.position.shape[0]} agents, the mission {len(mission.agents)}")
        self.logic, self.mission, self.trace = logic, mission, trace
        self.steps = trace.position.shape[1]
        self.margins: dict[Predicate, Array] = {}
        self.links: dict[Graph, Values] = {}

    def values(self, roots: Iterable[Node]) -> dict[Node, Values]:
        """The value of each of these formulas."""
        wanted = tuple(roots)
        order = postorder(wanted)
        needed = Counter(child for node in order for child in children(node))
        needed.update(wanted)
        known: dict[Node, Values] = {}
        for node in order:
            below = tuple(known[child] for child in children(node))
            known[node] = self.value(node, below)
            for child in children(node):
                needed[child] -= 1
                if not needed[child]:
                    del known[child]
        return {node: known[node] for node in wanted}

    def value(self, node: Node, below: tuple[Values, ...]) -> Values:
        """A formula's value from those of the formulas directly below it."""
        logic = self.logic
        match node:
            case Atom(predicate):
                if predicate not in self.margins:
                    self.margins[predicate] = np.atleast_2d(margin(predicate, self.mission, self.trace))
                return logic.of_predicate(predicate, self.margins[predicate])
            case Is(agents):
                return np.array([[logic.top if index in agents else logic.bottom] for index in self._agents()])
            case Not():
                result: Values = logic.negate(below[0])
                return result
            case All():
                return _combined(np.minimum, below, logic.top)
            case Any():
                return _combined(np.maximum, below, logic.bottom)
            case AtLeast(count):
                return _largest(count, below, logic)
            case Always(_, low, high):
                return temporal_windows.sliding(np.minimum, self._spread(below[0]), low, high, logic.bottom)
            case Eventually(_, low, high):
                return temporal_windows.sliding(np.maximum, self._spread(below[0]), low, high, logic.bottom)
            case Until(_, _, low, high):
                return temporal_windows.until(self._spread(below[0]), self._spread(below[1]), low, high, logic.bottom)
            case Release(_, _, low, high):
                return temporal_windows.release(logic, self._spread(below[0]), self._spread(below[1]), low, high)
            case At(agent):
                return below[0] if len(below[0]) == 1 else below[0][agent : agent + 1]
            case Neighbour(graph):
                return self._nearby(graph, below[0])
            case Reach(graph, _, _, hops):
                return self._reach(graph, below[0], below[1], hops)
            case EveryNeighbour() | EveryReach() | EveryRoute():
                failing = tuple(logic.negate(value) for value in below)
                return np.asarray(logic.negate(self.value(dual(node, children(node)), failing)))
            case Route():
                return self._route(node, below[0], below[1])
            case PathLength():
                return self._apart(node)
            case _:
                assert_never(node)

    def _agents(self) -> range:
        return range(len(self.mission.agents))

    def _spread(self, value: Values) -> Values:
        """The value at every step, also where it does not depend on the step."""
        return np.broadcast_to(value, (len(value), self.steps))

    def _along(
        self, graph: Graph, below: tuple[Values, ...], outside: Values, measure: Callable[..., Values]
    ) -> Values:
        """``measure`` of each piece of steps and the members' values there; ``outside`` is the value of the others."""
        members = list(graph.agents)
        shape = (len(self._agents()), self.steps)
        result = np.broadcast_to(outside, shape).copy()
        spread = [np.broadcast_to(value, shape)[members] for value in below]
        for piece in pieces(self.steps, len(members)) if members else ():
            result[members, piece] = measure(piece, *(value[:, piece].T for value in spread)).T
        return result

    def _nowhere(self) -> Values:
        return np.full((1, 1), self.logic.bottom)

    def _nearby(self, graph: Graph, body: Values) -> Values:
        def measure(piece: slice, body: Values) -> Values:
            return graph_routes.nearby(self._links(graph, piece), body)

        return self._along(graph, (body,), self._nowhere(), measure)

    def _reach(self, graph: Graph, through: Values, end: Values, hops: int) -> Values:
        def measure(piece: slice, through: Values, end: Values) -> Values:
            return graph_routes.reach(self._links(graph, piece), through, end, hops)

        return self._along(graph, (through, end), end, measure)

    def _route(self, node: Route, through: Values, end: Values) -> Values:
        graph, low, high, logic = node.graph, node.low, node.high, self.logic

        def shorter(piece: slice, through: Values, end: Values) -> Values:
            links, lengths = self._links(graph, piece), self._lengths(graph, piece)
            return graph_routes.reach_within(logic, links, lengths, through, end, high)

        def longer(piece: slice, through: Values, end: Values) -> Values:
            links, lengths = self._links(graph, piece), self._lengths(graph, piece)
            return graph_routes.bounded_below(logic, links, lengths, through, end, low, high)

        if low > 0:
            return self._along(graph, (through, end), self._nowhere(), longer)
        return self._along(graph, (through, end), end, shorter)

    def _apart(self, node: PathLength) -> Values:
        """No longer than the upper bound, and not shorter than the lower one."""
        graph, logic = node.graph, self.logic
        target = np.array([[logic.top if index == node.agent else logic.bottom] for index in self._agents()])

        def measure(piece: slice, target: Values) -> Values:
            links, lengths = self._links(graph, piece), self._lengths(graph, piece)
            anyone = np.full_like(target, logic.top)
            near = graph_routes.reach_within(logic, links, lengths, anyone, target, node.high)
            if node.low <= 0:
                return near
            below = math.nextafter(node.low, 0.0)
            both: Values = np.minimum(
                near, logic.negate(graph_routes.reach_within(logic, links, lengths, anyone, target, below))
            )
            return both

        return self._along(graph, (target,), target if node.low <= 0 else self._nowhere(), measure)

    def _links(self, graph: Graph, piece: slice) -> Values:
        """All links of some steps; kept where the whole trace is one piece."""
        if graph in self.links:
            return self.links[graph][piece]
        links = self.logic.of_link(all_links(graph, self.trace.position[:, piece]))
        if len(links) == self.steps:
            self.links[graph] = links
        return links

    def _lengths(self, graph: Graph, piece: slice) -> Array:
        members = self.trace.position[list(graph.agents), piece].swapaxes(0, 1)
        lengths: Array = distance_between(np, members[:, :, None, :], members[:, None, :, :])
        return lengths


def _combined(choose: np.ufunc, parts: tuple[Values, ...], neutral: object) -> Values:
    return reduce(choose, parts, np.full((1, 1), neutral))


def _largest(count: int, parts: tuple[Values, ...], logic: Logic) -> Values:
    """The ``count``-th largest of the parts, agent by agent to hold few of them at once."""
    if count <= 0:
        return np.full((1, 1), logic.top)
    if count > len(parts):
        return np.full((1, 1), logic.bottom)
    spread = np.broadcast_arrays(*parts)
    rows = [np.partition(np.stack(row), -count, axis=0)[-count] for row in zip(*spread, strict=True)]
    return np.stack(rows)
