"""Best and shortest routes through a communication graph, for every agent and many steps.

Values are indexed (steps, members), links and lengths (steps, members, members), where the members are the graph's
agents in their order. Both logics use this module: the best route has the best worst part.
"""

from __future__ import annotations

import math
from heapq import heappop, heappush
from itertools import count

import numpy as np

from missionc.base.trace import Array
from missionc.verification.monitoring.logic import Logic, Values


def nearby(links: Values, body: Values) -> Values:
    """Best value of ``body`` among the agents linked to each member: (steps, members)."""
    chosen: Values = np.minimum(links, body[:, None, :]).max(axis=2)
    return chosen


def reach(links: Values, through: Values, end: Values, hops: int) -> Values:
    """Value of each member's best route of at most ``hops`` links over ``through`` to ``end``: (steps, members).

    The iteration stops when more links change nothing.
    """
    best = end
    for _ in range(hops):
        better = np.maximum(best, np.minimum(through, nearby(links, best)))
        if np.array_equal(better, best):
            break
        best = better
    return best


def reach_within(logic: Logic, links: Values, lengths: Array, through: Values, end: Values, bound: float) -> Values:
    """Value of each member's best route with a length of at most ``bound`` metres: (steps, members), metres or boolean.

    A route's value is the worst of its links, its operands and the margin of its length. A route without links has no
    length margin.
    """
    if math.isinf(bound):
        return reach(links, through, end, end.shape[1])
    onward = np.minimum(links, through[:, :, None])
    if end.dtype == np.bool_:
        return shortest(np.where(onward, lengths, np.inf), end) <= bound
    return _best_within(onward, lengths, end, bound)


def shortest(lengths: Array, end: Values) -> Array:
    """Length of each member's shortest path to an end, by the Bellman-Ford algorithm: (steps, members), metres.

    The length is ``inf`` without a path.
    """
    best = np.where(end, 0.0, np.inf)
    while True:
        better = np.minimum(best, (lengths + best[:, None, :]).min(axis=2))
        if np.array_equal(better, best):
            return best
        best = better


def _best_within(links: Array, lengths: Array, end: Array, bound: float) -> Array:
    """Robustness of each member's best route with a length of at most ``bound`` metres: (steps, members), metres.

    Links and ends are added from the best to the worst, separately for each step, so paths to an end only get shorter.
    A shortened path contains nothing worse than the latest addition, so every agent's best value occurs at such a time.
    The search stops when the next addition is worse than every agent's best value.
    """
    steps, members = end.shape
    row = np.arange(steps)
    ways = np.broadcast_to(np.where(np.eye(members, dtype=np.bool_), 0.0, np.inf), (steps, members, members)).copy()
    near = np.full((steps, members), np.inf)
    best = end.astype(np.float64)
    worth = np.concatenate((links, end[:, :, None]), axis=2).reshape(steps, -1)
    for entry in np.argsort(-worth, axis=1, kind="stable").T:
        worst = worth[row, entry]
        if np.all(worst <= best.min(axis=1, initial=np.inf)):
            break
        agent, onto = np.divmod(entry, members + 1)
        ends = onto == members
        onto = np.where(ends, agent, onto)
        ahead = np.where(ends, 0.0, lengths[row, agent, onto])
        left = ahead + np.where(ends, 0.0, near[row, onto])
        near = np.minimum(near, ways[row, :, agent] + left[:, None])
        best = np.maximum(best, np.minimum(worst[:, None], bound - near))
        onward = np.where(ends, np.inf, ahead)[:, None] + ways[row, onto]
        ways = np.minimum(ways, ways[row, :, agent][:, :, None] + onward[:, None, :])
    return best


def bounded_below(
    logic: Logic, links: Values, lengths: Array, through: Values, end: Values, low: float, high: float
) -> Values:
    """Value of each member's best route with a length from ``low`` > 0 to ``high`` metres, without repeated agents.

    Shape: (steps, members), boolean or metres.

    A lower bound makes the problem as hard as the longest-path problem, so routes are enumerated, the most promising
    first. The function is meant for few agents.
    """
    best = np.full(end.shape, logic.bottom)
    for step in range(len(end)):
        hope = reach(links[None, step], through[None, step], end[None, step], end.shape[1])[0]
        search = _BestRoute(logic, links[step], lengths[step], through[step], end[step], hope, low, high)
        best[step] = [search.start_from(member) for member in range(end.shape[1])]
    return best


class _BestRoute:
    """Best-first search for a route at one step: no continuation of a route has a better value than its queue key.

    Values are plain numbers; false and true are 0 and 1.
    """

    def __init__(
        self,
        logic: Logic,
        links: Values,
        lengths: Array,
        through: Values,
        end: Values,
        hope: Values,
        low: float,
        high: float,
    ) -> None:
        self.logic, self.low, self.high = logic, low, high
        self.links = links.astype(np.float64).tolist()
        self.lengths = lengths.tolist()
        self.through, self.end, self.hope = (values.astype(np.float64).tolist() for values in (through, end, hope))

    def start_from(self, start: int) -> float:
        best, top = float(self.logic.bottom), float(self.logic.top)
        serial = count(1)
        queue: list[tuple[float, int, float, tuple[int, ...], float]] = [(-self.hope[start], 0, 0.0, (start,), top)]
        while queue and -queue[0][0] > best:
            _, _, length, route, worst = heappop(queue)
            last = route[-1]
            if len(route) > 1:
                best = max(best, min(worst, self.end[last], self._slack(length - self.low)))
            for after in range(len(self.end)):
                if after in route:
                    continue
                longer = length + self.lengths[last][after]
                onward = min(worst, self.through[last], self.links[last][after], self._slack(self.high - longer))
                hope = min(onward, self.hope[after])
                if hope > best:
                    heappush(queue, (-hope, next(serial), longer, (*route, after), onward))
        return best

    def _slack(self, left: float) -> float:
        return float(self.logic.of_length(np.asarray(left)))
