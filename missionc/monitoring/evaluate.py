"""Evaluation of kernel formulas along a trace, in the logic of truth or of robustness.

Sliding windows and *until* along the last axis of an array, for truth and for robustness alike.

``worst`` and ``best`` are ``numpy.minimum`` and ``numpy.maximum``: on truth values
they are *and* and *or*. A window that runs past the last step is ``undefined``
there; the horizon check sees to it that no goal reads such a value.

The first and the last step as two columns, and which of them a window of steps holds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import reduce

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.ir import Graph, Mission, Predicate
from missionc.kernel.evaluate import Domain, evaluate
from missionc.kernel.nodes import NeighbourNode, Node, PathLength, ReachNode, RouteNode, UntilNode, WindowNode
from missionc.language.margins.links import all_links, pieces
from missionc.language.margins.predicate_margins import margin
from missionc.monitoring import graph_routes
from missionc.monitoring.logic import Logic, Values
from missionc.world.signed_distance import distance_between


def sliding(choose: np.ufunc, values: Values, low: int, high: int | None, undefined: object) -> Values:
    """``choose`` over the window of every step: (..., steps) -> (..., steps), in O(steps log window).

    ``high`` None is the last step, from wherever the window starts.
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
    """``end`` at some step of the window, ``hold`` from now up to, not at, that one: (..., steps) -> (..., steps)."""
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
    """``choose`` over the window of every step, which looks back; ``empty`` where it holds no step."""
    steps = values.shape[-1]
    low = max(low, -steps)
    if -high >= steps:
        return np.full_like(values, empty)
    before = np.full((*values.shape[:-1], -low), empty, dtype=values.dtype)
    return _over(choose, np.concatenate((before, values), -1), high - low + 1)[..., :steps]


def since(hold: Values, end: Values, low: int, high: int, bottom: object) -> Values:
    """``until`` with time reversed, in which nothing holds before the first step: (..., steps) -> (..., steps)."""
    hold, end = np.broadcast_arrays(hold, end)
    steps = hold.shape[-1]
    low = max(low, -steps)
    if -high >= steps:
        return np.full_like(end, bottom)
    beyond = np.full((*end.shape[:-1], -low), bottom, dtype=end.dtype)
    hold, end = (np.concatenate((value[..., ::-1], beyond), -1) for value in (hold, end))
    return until(hold, end, -high, -low, bottom)[..., :steps][..., ::-1]


def release(logic: Logic, free: Values, end: Values, low: int, high: int | None) -> Values:
    """The dual of ``until``, and of ``since``: ``end`` at every step of the window, or ``free`` at one before it."""
    if low < 0 and high is not None:
        return np.asarray(logic.negate(since(logic.negate(free), logic.negate(end), low, high, logic.bottom)))
    freed: Values = logic.negate(until(logic.negate(free), logic.negate(end), low, high, logic.bottom))
    steps = freed.shape[-1]
    freed[..., max(steps - (low if high is None else high), 0) :] = logic.bottom
    return freed


def _over(choose: np.ufunc, values: Values, width: int) -> Values:
    """``choose`` over every ``width`` neighbours, by doubling: the result is ``width - 1`` shorter."""
    done = 1
    while 2 * done <= width:
        values = choose(values[..., :-done], values[..., done:])
        done *= 2
    rest = width - done
    return choose(values[..., : values.shape[-1] - rest], values[..., rest:]) if rest else values


def _until_within(hold: Values, end: Values, width: int) -> Values:
    """``until`` over the first ``width`` steps from every step; the result is ``width - 1`` shorter.

    A stretch of steps is summed up by two values: ``hold`` all along it, and
    the until within it. Two neighbouring stretches join into one, so that a
    stretch of any width is made of stretches that double.
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


FIRST, LAST = 0, 1
"""The two steps that are known, as columns."""

MOST_NODES = 5_000
"""Formulas in kernel form that are looked at; of more, nothing is said."""


def columns(last: int, low: int, high: int | None, column: int) -> tuple[list[int], bool]:
    """The known steps in a window that stands at one of them, and whether it holds no others.

    Args:
        last: the mission's last step.
    """
    if low < 0 and high is not None:
        at = last if column == LAST else 0
        begin, end = max(at + low, 0), at + high
        known = [each for each, step in ((FIRST, 0), (LAST, last)) if begin <= step <= end]
        known = [column] * (high == 0) if last == 0 else known
        return known, max(end - begin + 1, 0) == len(known)
    if column == LAST:
        return ([LAST], True) if low == 0 and high in (0, None) else ([], False)
    end = last if high is None else high
    known = [FIRST] * (low == 0) + [LAST] * (last > 0 and low <= last <= end)
    return known, end - low + 1 == len(known)


class Evaluation(Domain[Values]):
    """The domain of values along a trace: (agents, steps + 1), or 1 in place of either where it does not matter.

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
        return evaluate(roots, self)

    def atom(self, predicate: Predicate, holds: bool) -> Values:
        if predicate not in self.margins:
            self.margins[predicate] = np.atleast_2d(margin(predicate, self.mission, self.trace))
        return self._signed(self.logic.of_predicate(predicate, self.margins[predicate]), holds)

    def member(self, agents: frozenset[int], holds: bool) -> Values:
        logic = self.logic
        return np.array([[logic.top if (agent in agents) is holds else logic.bottom] for agent in self._agents()])

    def meet(self, parts: Sequence[Values]) -> Values:
        return reduce(np.minimum, parts, np.full((1, 1), self.logic.top))

    def join(self, parts: Sequence[Values]) -> Values:
        return reduce(np.maximum, parts, self._nowhere())

    def at_least(self, count: int, parts: Sequence[Values]) -> Values:
        """The ``count``-th largest of the parts, agent by agent to hold few of them at once."""
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
            return graph_routes.nearby(self._links(node.graph, piece), body)

        some = self._along(node.graph, (self._signed(body, not node.every),), self._nowhere(), measure)
        return self._signed(some, not node.every)

    def reach(self, node: ReachNode, through: Values, end: Values) -> Values:
        through, end = (self._signed(value, not node.every) for value in (through, end))

        def measure(piece: slice, through: Values, end: Values) -> Values:
            return graph_routes.reach(self._links(node.graph, piece), through, end, node.hops)

        return self._signed(self._along(node.graph, (through, end), end, measure), not node.every)

    def route(self, node: RouteNode, through: Values, end: Values) -> Values:
        graph, low, high, logic = node.graph, node.low, node.high, self.logic
        through, end = (self._signed(value, not node.every) for value in (through, end))

        def shorter(piece: slice, through: Values, end: Values) -> Values:
            links, lengths = self._links(graph, piece), self._lengths(graph, piece)
            return graph_routes.reach_within(logic, links, lengths, through, end, high)

        def longer(piece: slice, through: Values, end: Values) -> Values:
            links, lengths = self._links(graph, piece), self._lengths(graph, piece)
            return graph_routes.bounded_below(logic, links, lengths, through, end, low, high)

        if low > 0:
            some = self._along(graph, (through, end), self._nowhere(), longer)
        else:
            some = self._along(graph, (through, end), end, shorter)
        return self._signed(some, not node.every)

    def path_length(self, node: PathLength, holds: bool) -> Values:
        """No longer than the upper bound, and not shorter than the lower one."""
        graph, logic = node.graph, self.logic
        target = self.member(frozenset((node.agent,)), True)

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

        outside = target if node.low <= 0 else self._nowhere()
        return self._signed(self._along(graph, (target,), outside, measure), holds)

    def _signed(self, value: Values, holds: bool) -> Values:
        """The value, or that of the negation."""
        return value if holds else np.asarray(self.logic.negate(value))

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
