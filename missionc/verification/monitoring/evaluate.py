"""Evaluation of kernel formulas along a trace, in Boolean or robustness logic."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import reduce

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.ir import Graph, Mission, Predicate
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.kernel.evaluate import Domain, evaluate
from missionc.ir.kernel.nodes import NeighbourNode, Node, PathLength, ReachNode, RouteNode, UntilNode, WindowNode
from missionc.ir.language.margins.links import all_links, link_pieces
from missionc.ir.language.margins.predicate_margins import AlongTrace
from missionc.verification.monitoring import graph_routes, temporal_windows
from missionc.verification.monitoring.logic import Logic, Values


class Evaluation(Domain[Values]):
    """Evaluation of kernel formulas along a trace, in one of the two logics.

    Values have shape (agents, steps + 1); an axis that does not matter has length 1.

    Raises:
        ValueError: trace and mission have different agents.
    """

    def __init__(self, logic: Logic, mission: Mission, trace: Trace) -> None:
        if trace.position.shape[0] != len(mission.agents):
            raise ValueError(f"the trace has {trace.position.shape[0]} agents, the mission {len(mission.agents)}")
        self.logic, self.mission, self.trace = logic, mission, trace
        self.steps = trace.position.shape[1]
        self.view = AlongTrace(mission, trace)
        self.margins: dict[Predicate, Array] = {}
        self.links: dict[Graph, Values] = {}

    def values(self, roots: Iterable[Node]) -> dict[Node, Values]:
        """Truth or robustness of each of these formulas, (agents, steps + 1)."""
        return evaluate(roots, self)

    def atom(self, predicate: Predicate, holds: bool) -> Values:
        if predicate not in self.margins:
            self.margins[predicate] = np.atleast_2d(predicate.margin(self.view))
        return self._signed(self.logic.of_predicate(predicate, self.margins[predicate]), holds)

    def member(self, agents: frozenset[int], holds: bool) -> Values:
        logic = self.logic
        return np.array([[logic.top if (agent in agents) is holds else logic.bottom] for agent in self._agents()])

    def meet(self, parts: Sequence[Values]) -> Values:
        return reduce(np.minimum, parts, np.full((1, 1), self.logic.top))

    def join(self, parts: Sequence[Values]) -> Values:
        return reduce(np.maximum, parts, self._nowhere())

    def at_least(self, count: int, parts: Sequence[Values]) -> Values:
        """Value of "at least ``count`` of the parts hold": the ``count``-th largest of the parts.

        Agents are processed separately to save memory.
        """
        if not 0 < count <= len(parts):
            return self.meet(()) if count <= 0 else self.join(())
        spread = np.broadcast_arrays(*parts)
        rows = [np.partition(np.stack(row), -count, axis=0)[-count] for row in zip(*spread, strict=True)]
        return np.stack(rows)

    def window(self, node: WindowNode, body: Values) -> Values:
        choose = np.minimum if node.every else np.maximum
        if node.low < 0 and node.high is not None:
            empty = self.logic.top if node.every else self.logic.bottom
            return temporal_windows.sliding_back(choose, self._spread(body), node.low, node.high, empty)
        return temporal_windows.sliding(choose, self._spread(body), node.low, node.high, self.logic.bottom)

    def until(self, node: UntilNode, hold: Values, end: Values) -> Values:
        hold, end = self._spread(hold), self._spread(end)
        if node.every:
            return temporal_windows.release(self.logic, hold, end, node.low, node.high)
        if node.low < 0 and node.high is not None:
            return temporal_windows.since(hold, end, node.low, node.high, self.logic.bottom)
        return temporal_windows.until(hold, end, node.low, node.high, self.logic.bottom)

    def at(self, agent: int, body: Values) -> Values:
        return body if len(body) == 1 else body[agent : agent + 1]

    def neighbour(self, node: NeighbourNode, body: Values) -> Values:
        def measure(piece: slice, body: Values) -> Values:
            return graph_routes.nearby(self.links_of(node.graph, piece), body)

        some = self._along(node.graph, (self._signed(body, not node.every),), self._nowhere(), measure)
        return self._signed(some, not node.every)

    def reach(self, node: ReachNode, through: Values, end: Values) -> Values:
        through, end = (self._signed(value, not node.every) for value in (through, end))

        def measure(piece: slice, through: Values, end: Values) -> Values:
            return graph_routes.reach(self.links_of(node.graph, piece), through, end, node.hops)

        return self._signed(self._along(node.graph, (through, end), end, measure), not node.every)

    def route(self, node: RouteNode, through: Values, end: Values) -> Values:
        graph, low, high, logic = node.graph, node.low, node.high, self.logic
        through, end = (self._signed(value, not node.every) for value in (through, end))

        def shorter(piece: slice, through: Values, end: Values) -> Values:
            links, lengths = self.links_of(graph, piece), self._lengths(graph, piece)
            return graph_routes.reach_within(logic, links, lengths, through, end, high)

        def longer(piece: slice, through: Values, end: Values) -> Values:
            links, lengths = self.links_of(graph, piece), self._lengths(graph, piece)
            return graph_routes.bounded_below(logic, links, lengths, through, end, low, high)

        if low > 0:
            some = self._along(graph, (through, end), self._nowhere(), longer)
        else:
            some = self._along(graph, (through, end), end, shorter)
        return self._signed(some, not node.every)

    def path_length(self, node: PathLength, holds: bool) -> Values:
        """Value of "the shortest route to the named agent has a length within the bounds", or of its negation."""
        graph, logic = node.graph, self.logic
        target = self.member(frozenset((node.agent,)), True)

        def measure(piece: slice, target: Values) -> Values:
            links, lengths = self.links_of(graph, piece), self._lengths(graph, piece)
            anyone = np.full_like(target, logic.top)
            near = graph_routes.reach_within(logic, links, lengths, anyone, target, node.high)
            if node.low <= 0:
                return near
            below = math.nextafter(node.low, 0.0)
            both: Values = np.minimum(
                near, logic.negate(graph_routes.reach_within(logic, links, lengths, anyone, target, below))
            )
            return both

        outside = target if node.low <= 0 else self._nowhere()
        return self._signed(self._along(graph, (target,), outside, measure), holds)

    def _signed(self, value: Values, holds: bool) -> Values:
        """The value itself, or with ``holds`` False the value of its negation."""
        return value if holds else np.asarray(self.logic.negate(value))

    def _agents(self) -> range:
        return range(len(self.mission.agents))

    def _spread(self, value: Values) -> Values:
        """The value repeated for every step, if it does not depend on the step."""
        return np.broadcast_to(value, (len(value), self.steps))

    def _along(
        self, graph: Graph, below: tuple[Values, ...], outside: Values, measure: Callable[..., Values]
    ) -> Values:
        """Values of a spatial operator, computed by ``measure`` for the members of a graph in batches of steps.

        Agents outside the graph get the value ``outside``.
        """
        members = list(graph.agents)
        shape = (len(self._agents()), self.steps)
        result = np.broadcast_to(outside, shape).copy()
        spread = [np.broadcast_to(value, shape)[members] for value in below]
        for piece in link_pieces(self.steps, len(members)) if members else ():
            result[members, piece] = measure(piece, *(value[:, piece].T for value in spread)).T
        return result

    def _nowhere(self) -> Values:
        return np.full((1, 1), self.logic.bottom)

    def links_of(self, graph: Graph, piece: slice) -> Values:
        """All links of some steps, (steps, members, members); cached if the whole trace is one piece."""
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
