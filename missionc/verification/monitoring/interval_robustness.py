"""Robustness intervals at the first and last step, from the mission's starts and finishes only.

in   formulas in kernel form, Mission
out  Intervals: minimum and maximum robustness of each formula at these steps, over every plan

A start or finish at a point is known; a start or finish in a region lies in a ball around the region. Without a start
or finish, and at every step in between, the position is unknown. Margins are 1-Lipschitz in positions, which gives each
margin an interval, and all operators are monotone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Trace
from missionc.geometry.configuration_space import Atlas
from missionc.ir import Formation, FormationEdge, Graph, InitialSet, Mission, Predicate, Resource
from missionc.ir.kernel.evaluate import Domain, evaluate
from missionc.ir.kernel.nodes import NeighbourNode, Node, PathLength, ReachNode, RouteNode, UntilNode, WindowNode
from missionc.ir.kernel.walk import more_than, postorder
from missionc.ir.language.margins.links import all_links
from missionc.ir.language.margins.predicate_margins import formation_margin, margin
from missionc.verification.monitoring.end_columns import FIRST, LAST, MOST_NODES, columns
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import ROBUSTNESS, Values, decided_at_border

MOST_MEMBERS, MOST_ROUTES = 200, 7
"""Maximum number of agents of a graph, and of a graph with route lengths in metres; larger graphs get no result."""


class RobustnessInterval(Record, eq=False):
    """Minimum and maximum robustness of a formula at the first and last step: (agents, 2) each, metres.

    For a formula about the team, the shape is (1, 2).
    """

    least: Array
    most: Array


class Intervals(Domain[RobustnessInterval]):
    """Evaluation of formulas to robustness intervals at the first and last step.

    ``position`` and ``radius`` bound the agents' positions at both steps.
    """

    def __init__(self, mission: Mission, atlas: Atlas) -> None:
        self.mission = mission
        starts = [_around(agent.start, atlas) for agent in mission.agents]
        ends = [_around(agent.finish, atlas) for agent in mission.agents]
        self.position = np.array([[start[0], end[0]] for start, end in zip(starts, ends, strict=True)])
        self.radius = np.array([[start[1], end[1]] for start, end in zip(starts, ends, strict=True)])
        still = np.zeros_like(self.position)
        trace = Trace(mission.step, self.position, still, np.zeros(self.radius.shape))
        self.least, self.most = (Evaluation(ROBUSTNESS, mission, trace) for _ in range(2))
        self.graphs: set[Graph] = set()
        self.predicates: dict[Predicate, RobustnessInterval] = {}
        self.worst: dict[tuple[Formation, int], FormationEdge] = {}

    def of(self, roots: Iterable[Node]) -> dict[Node, RobustnessInterval]:
        """Robustness intervals of the formulas and all their subformulas; empty if there are too many."""
        roots = tuple(roots)
        return {} if more_than(MOST_NODES, roots) else evaluate(postorder(roots), self)

    def links(self, graph: Graph) -> RobustnessInterval:
        """Minimum and maximum margins of a graph's links: (2, members, members) each, metres."""
        if graph not in self.graphs:
            members = list(graph.agents)
            reach = self.radius[members].T
            change = reach[:, :, None] + reach[:, None, :]
            itself = np.arange(len(members))
            change[:, itself, itself] = 0.0
            links = all_links(graph, self.position)
            for side, sign in ((self.least, -1.0), (self.most, 1.0)):
                side.links[graph] = decided_at_border(links + sign * change, is_open=True)
            self.graphs.add(graph)
        return RobustnessInterval(self.least.links[graph], self.most.links[graph])

    def worst_edge(self, formation: Formation, column: int) -> FormationEdge:
        """Edge of a formation with the largest error if all agents are at the centres of their position bounds."""
        if (formation, column) not in self.worst:
            place, edges = self.position[:, column], formation.edges
            margins = [float(formation_margin(formation, e, place[e.first], place[e.second])) for e in edges]
            self.worst[formation, column] = edges[int(np.argmin(margins))]
        return self.worst[formation, column]

    def atom(self, predicate: Predicate, holds: bool) -> RobustnessInterval:
        if predicate not in self.predicates:
            self.predicates[predicate] = self._of_predicate(predicate)
        return self.predicates[predicate] if holds else _denied(self.predicates[predicate])

    def member(self, agents: frozenset[int], holds: bool) -> RobustnessInterval:
        return self._each(lambda side: side.member(agents, holds))

    def meet(self, parts: Sequence[RobustnessInterval]) -> RobustnessInterval:
        return self._each(lambda side, *below: side.meet(below), *parts)

    def join(self, parts: Sequence[RobustnessInterval]) -> RobustnessInterval:
        return self._each(lambda side, *below: side.join(below), *parts)

    def at_least(self, count: int, parts: Sequence[RobustnessInterval]) -> RobustnessInterval:
        return self._each(lambda side, *below: side.at_least(count, below), *parts)

    def at(self, agent: int, body: RobustnessInterval) -> RobustnessInterval:
        return self._each(lambda side, below: side.at(agent, below), body)

    def window(self, node: WindowNode, body: RobustnessInterval) -> RobustnessInterval:
        if node.every:
            return _denied(self._sometime(_denied(body), node.low, node.high))
        return self._sometime(body, node.low, node.high)

    def until(self, node: UntilNode, hold: RobustnessInterval, end: RobustnessInterval) -> RobustnessInterval:
        if node.every:
            return _denied(self._until(_denied(hold), _denied(end), node.low, node.high))
        return self._until(hold, end, node.low, node.high)

    def neighbour(self, node: NeighbourNode, body: RobustnessInterval) -> RobustnessInterval:
        return self._linked(node.graph, node.every, lambda side, body: side.neighbour(node, body), body)

    def reach(self, node: ReachNode, through: RobustnessInterval, end: RobustnessInterval) -> RobustnessInterval:
        return self._linked(node.graph, node.every, lambda side, *below: side.reach(node, *below), through, end)

    def route(self, node: RouteNode, through: RobustnessInterval, end: RobustnessInterval) -> RobustnessInterval:
        return self._measured(node.graph, node.every, lambda side, *below: side.route(node, *below), through, end)

    def path_length(self, node: PathLength, holds: bool) -> RobustnessInterval:
        return self._measured(node.graph, not holds, lambda side: side.path_length(node, holds))

    def _each(
        self, value: Callable[..., Values], *below: RobustnessInterval, denied: bool = False
    ) -> RobustnessInterval:
        """Interval of a monotone operator: its minimum value from the minimum operands, its maximum from the maximum.

        Args:
            denied: True if more links reduce the value.
        """
        fewest, widest = (self.most, self.least) if denied else (self.least, self.most)
        return RobustnessInterval(
            _spread(value(fewest, *(each.least for each in below))),
            _spread(value(widest, *(each.most for each in below))),
        )

    def _linked(
        self, graph: Graph, every: bool, value: Callable[..., Values], *below: RobustnessInterval
    ) -> RobustnessInterval:
        if len(graph.agents) > MOST_MEMBERS:
            return self._unknown()
        self.links(graph)
        return self._each(value, *below, denied=every)

    def _measured(
        self, graph: Graph, every: bool, value: Callable[..., Values], *below: RobustnessInterval
    ) -> RobustnessInterval:
        """Interval of an operator on route lengths, computed at the centres of the position bounds.

        It is unknown at a step if some member's position is not exact, or if the graph is too large.
        """
        unknown = self._unknown()
        if len(graph.agents) > MOST_ROUTES:
            return unknown
        interval = self._linked(graph, every, value, *below)
        exact = (self.radius[list(graph.agents)] == 0).all(axis=0)
        least, most = (decided_at_border(each, is_open=every) for each in (interval.least, interval.most))
        return RobustnessInterval(np.where(exact, least, unknown.least), np.where(exact, most, unknown.most))

    def _unknown(self) -> RobustnessInterval:
        return RobustnessInterval(np.full(self.radius.shape, -np.inf), np.full(self.radius.shape, np.inf))

    def _of_predicate(self, predicate: Predicate) -> RobustnessInterval:
        if predicate.reads_past or predicate.reads_heading:
            return self._unknown()
        value = np.atleast_2d(margin(predicate, self.mission, self.least.trace))
        change = predicate.rate(_Reach(self.mission.dimension, self.radius))
        least, most = (decided_at_border(each, predicate.open_border) for each in (value - change, value + change))
        return RobustnessInterval(least, most)

    def columns(self, low: int, high: int | None, column: int) -> tuple[list[int], bool]:
        """Columns of the first and last step that lie in a window, and True if the window contains no other step."""
        return columns(self.mission.steps, low, high, column)

    def _sometime(self, body: RobustnessInterval, low: int, high: int | None) -> RobustnessInterval:
        least, most = (np.empty_like(body.most) for _ in range(2))
        for column in (FIRST, LAST):
            known, whole = self.columns(low, high, column)
            least[:, column] = body.least[:, known].max(axis=1, initial=-np.inf)
            most[:, column] = body.most[:, known].max(axis=1, initial=-np.inf) if whole else np.inf
        return RobustnessInterval(least, most)

    def _until(
        self, hold: RobustnessInterval, end: RobustnessInterval, low: int, high: int | None
    ) -> RobustnessInterval:
        at_some = self._sometime(end, low, high)
        if low < 0:
            # A condition that holds now has held since now, for any past.
            return RobustnessInterval(end.least if high == 0 else np.full_like(at_some.most, -np.inf), at_some.most)
        if high == 0:
            return at_some
        # The left side has to hold now, for any future.
        later = self._sometime(end, max(low, 1), high).most
        now = end.most if low == 0 else np.full((1, 2), -np.inf)
        most = np.maximum(now, np.minimum(hold.most, later))
        most[:, LAST] = np.where(high is None, at_some.most[:, LAST], np.inf)
        least = np.broadcast_to(end.least if low == 0 else np.full((1, 2), -np.inf), most.shape).copy()
        least[:, LAST] = np.where(high is None, at_some.least[:, LAST], -np.inf)
        return RobustnessInterval(least, most)


class _Reach:
    """Bounds on the difference between a measured quantity and its value at the centres of the position bounds.

    Shape: (agents, 2) or (1, 2), metres.
    """

    larger = staticmethod(np.maximum)

    def __init__(self, dimension: int, radius: Array) -> None:
        self.dimension, self.radius = dimension, radius

    def motion(self) -> Array:
        return self.radius

    def relative(self, first: int | None, second: int) -> Array:
        radius: Array = self.radius[slice(None) if first is None else slice(first, first + 1)] + self.radius[second]
        return radius

    def acceleration(self) -> Array:
        return np.full((1, 2), np.inf)

    def use(self, resource: Resource) -> Array:
        return np.full((1, 2), np.inf)

    def along(self, direction: tuple[float, ...]) -> Array:
        return float(np.abs(direction).sum()) * self.radius


def _around(place: InitialSet | None, atlas: Atlas) -> tuple[tuple[float, ...], float]:
    """Centre and radius of a ball around all possible positions at a start or finish, metres.

    None means no restriction.
    """
    if place is None:
        return tuple(atlas.world.low), np.inf
    if place.point is not None:
        return place.point, 0.0
    low, high = atlas.bounds(atlas.outer(place.shape))
    middle = (np.array(low) + np.array(high)) / 2
    return tuple(middle.tolist()), float(np.linalg.norm(np.array(high) - middle))


def _denied(one: RobustnessInterval) -> RobustnessInterval:
    return RobustnessInterval(-one.most, -one.least)


def _spread(value: Values) -> Array:
    return np.broadcast_to(value, (len(value), 2)).astype(np.float64)
