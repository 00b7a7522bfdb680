"""Evaluation of kernel formulas along a trace, in Boolean or robustness logic.

Sliding windows and *until* along the last axis of an array, for truth and for robustness alike.

``numpy.minimum`` and ``numpy.maximum`` are *and* and *or* on truth values. A window that runs past the last step is
``undefined``; the horizon check ensures that no goal reads such a value.
"""

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
from missionc.verification.monitoring import graph_routes
from missionc.verification.monitoring.logic import Logic, Values


def sliding(choose: np.ufunc, values: Values, low: int, high: int | None, undefined: object) -> Values:
    """Minimum or maximum (``choose``) over the window ahead of every step: (..., steps) -> (..., steps).

    The cost is O(steps log window).

    Args:
        low, high: the window in steps ahead; ``high`` None means up to the last step.
        undefined: value at steps whose window runs past the last step.
    """
    steps = values.shape[-1]
    result = np.full_like(values, undefined)
    if high is None:
        if low < steps:
            suffix = choose.accumulate(values[..., ::-1], axis=-1)[..., ::-1]
            result[..., : steps - low] = suffix[..., low:]
    elif high < steps:
        result[..., : steps - high] = _over(choose, values[..., low:], high - low + 1)
    return result


def until(hold: Values, end: Values, low: int, high: int | None, undefined: object) -> Values:
    """Value of "``end`` holds at some step of the window, and ``hold`` from now until then".

    Shape: (..., steps) -> (..., steps).

    Args:
        low, high: the window in steps ahead; ``high`` None means up to the last step.
        undefined: value at steps whose window runs past the last step.
    """
    hold, end = np.broadcast_arrays(hold, end)
    steps = hold.shape[-1]
    result = np.full_like(end, undefined)
    last = steps - 1 if high is None else high
    if last >= steps or low >= steps:
        return result
    if high is None:
        beyond = np.full((*end.shape[:-1], steps - 1 - low), undefined, dtype=end.dtype)
        freed = _until_within(np.concatenate((hold, beyond), -1), np.concatenate((end, beyond), -1), steps - low)
        defined = steps - low
    else:
        freed = _until_within(hold, end, high - low + 1)
        defined = steps - high
    chosen = freed[..., low : low + defined]
    if low > 0:
        chosen = np.minimum(_over(np.minimum, hold, low)[..., :defined], chosen)
    result[..., :defined] = chosen
    return result


def sliding_back(choose: np.ufunc, values: Values, low: int, high: int, empty: object) -> Values:
    """Minimum or maximum (``choose``) over the past window of every step; ``empty`` if the window contains no step.

    Args:
        low, high: the window in steps ahead, so both are at most 0.
    """
    steps = values.shape[-1]
    low = max(low, -steps)
    if -high >= steps:
        return np.full_like(values, empty)
    before = np.full((*values.shape[:-1], -low), empty, dtype=values.dtype)
    return _over(choose, np.concatenate((before, values), -1), high - low + 1)[..., :steps]


def since(hold: Values, end: Values, low: int, high: int, bottom: object) -> Values:
    """Value of "``end`` held at some step of the past window, and ``hold`` from then until now".

    Nothing holds before the first step.

    Shape: (..., steps) -> (..., steps).

    Args:
        low, high: the window in steps ahead, so both are at most 0.
    """
    hold, end = np.broadcast_arrays(hold, end)
    steps = hold.shape[-1]
    low = max(low, -steps)
    if -high >= steps:
        return np.full_like(end, bottom)
    beyond = np.full((*end.shape[:-1], -low), bottom, dtype=end.dtype)
    hold, end = (np.concatenate((value[..., ::-1], beyond), -1) for value in (hold, end))
    return until(hold, end, -high, -low, bottom)[..., :steps][..., ::-1]


def release(logic: Logic, free: Values, end: Values, low: int, high: int | None) -> Values:
    """Dual of ``until`` and of ``since``: ``end`` holds at every step of the window, or ``free`` at an earlier step.

    Args:
        low, high: the window in steps ahead; negative for the dual of ``since``.
    """
    if low < 0 and high is not None:
        return np.asarray(logic.negate(since(logic.negate(free), logic.negate(end), low, high, logic.bottom)))
    freed: Values = logic.negate(until(logic.negate(free), logic.negate(end), low, high, logic.bottom))
    steps = freed.shape[-1]
    freed[..., max(steps - (low if high is None else high), 0) :] = logic.bottom
    return freed


def _over(choose: np.ufunc, values: Values, width: int) -> Values:
    """Minimum or maximum (``choose``) over every ``width`` adjacent steps, by doubling.

    The result is ``width - 1`` shorter.
    """
    done = 1
    while 2 * done <= width:
        values = choose(values[..., :-done], values[..., done:])
        done *= 2
    rest = width - done
    return choose(values[..., : values.shape[-1] - rest], values[..., rest:]) if rest else values


def _until_within(hold: Values, end: Values, width: int) -> Values:
    """Value of ``until`` over the first ``width`` steps from every step; the result is ``width - 1`` shorter.

    A range of steps is summarised by two values: ``hold`` over all of it, and the until within it. Two adjacent ranges
    join into one, so that a range of any width is built by doubling.
    """

    def joined(left: tuple[Values, Values], right: tuple[Values, Values], width: int) -> tuple[Values, Values]:
        size = min(left[0].shape[-1], right[0].shape[-1] - width)
        held, freed = left[0][..., :size], left[1][..., :size]
        later_held, later_freed = right[0][..., width : width + size], right[1][..., width : width + size]
        return np.minimum(held, later_held), np.maximum(freed, np.minimum(held, later_freed))

    stretch, size = (hold, end), 1
    whole, done = stretch, 0
    while True:
        if width & size:
            whole = joined(whole, stretch, done) if done else stretch
            done += size
        if done == width:
            return whole[1]
        stretch = joined(stretch, stretch, size)
        size *= 2


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
            return sliding_back(choose, self._spread(body), node.low, node.high, empty)
        return sliding(choose, self._spread(body), node.low, node.high, self.logic.bottom)

    def until(self, node: UntilNode, hold: Values, end: Values) -> Values:
        hold, end = self._spread(hold), self._spread(end)
        if node.every:
            return release(self.logic, hold, end, node.low, node.high)
        if node.low < 0 and node.high is not None:
            return since(hold, end, node.low, node.high, self.logic.bottom)
        return until(hold, end, node.low, node.high, self.logic.bottom)

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
