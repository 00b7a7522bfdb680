"""Single-agent relaxation: a necessary condition for a plan, checked for each agent alone.

    in   formulas, possible states of each agent, participating agents
    out  certainly infeasible, or unknown

A formula may be true for an agent in a state if some path from that state visits the required states. Conditions on
other agents count as true if a suitable agent exists. The check takes one or two sweeps over the moves of a roadmap,
and often avoids solving a problem with too few agents.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache, reduce

import numpy as np

from missionc.backends.smt.encode.lower import deep
from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.trace import Flags
from missionc.ir import Predicate
from missionc.ir.kernel.evaluate import Domain, evaluate
from missionc.ir.kernel.nodes import NeighbourNode, Node, PathLength, ReachNode, RouteNode, UntilNode, WindowNode

May = Callable[[int, int], Flags]
"""Function from an agent and a step to the states, (states,), in which a formula may be true; computed on demand."""

Onward = Callable[[int, int, Flags], Flags]
"""Function from states that may satisfy a formula one step later to states that may satisfy it at a step, (states,)."""


STEPS = 5_000
"""Maximum number of swept steps; the rest counts as possible, since nested windows are expensive."""


class SingleAgentRelaxation(Domain[May]):
    """Domain of possible truth for single agents, while participants move and other agents are absent.

    Args:
        ways: possible states of each agent, (steps + 1, states).
        taking_part: agents that may have links.
    """

    def __init__(self, labels: Labels, ways: Sequence[Flags], taking_part: frozenset[int]) -> None:
        self.labels, self.ways, self.taking_part = labels, ways, taking_part
        self._swept = 0

    def infeasible(self, formulas: Iterable[Node]) -> bool:
        """Return true if no joint motion of the participants satisfies some formula at step 0; False proves nothing."""
        with deep():
            return not all((may(0, 0) & self.ways[0][0]).any() for may in evaluate(formulas, self).values())

    def atom(self, predicate: Predicate, holds: bool) -> May:
        if not self.labels.of_places(predicate):
            return self._perhaps
        return lambda agent, step: self.labels.states(predicate, self.labels.roadmap_of[agent]) == holds

    def member(self, agents: frozenset[int], holds: bool) -> May:
        return lambda agent, step: self._everywhere(agent, (agent in agents) is holds)

    def path_length(self, node: PathLength, holds: bool) -> May:
        return self._perhaps

    def meet(self, parts: Sequence[May]) -> May:
        return cache(
            lambda agent, step: reduce(np.logical_and, _each(parts, agent, step), self._everywhere(agent, True))
        )

    def join(self, parts: Sequence[May]) -> May:
        return cache(
            lambda agent, step: reduce(np.logical_or, _each(parts, agent, step), self._everywhere(agent, False))
        )

    def at_least(self, count: int, parts: Sequence[May]) -> May:
        def may(agent: int, step: int) -> Flags:
            many = sum(_each(parts, agent, step), np.zeros(self.ways[agent].shape[1], dtype=np.int64))
            return np.asarray(many >= count)

        return cache(may)

    def at(self, agent: int, body: May) -> May:
        some = cache(lambda step: bool((body(agent, step) & self.ways[agent][step]).any()))
        return lambda agent, step: self._everywhere(agent, some(step))

    def neighbour(self, node: NeighbourNode, body: May) -> May:
        return lambda agent, step: self._everywhere(agent, node.every or self._others(node.graph.agents, agent))

    def reach(self, node: ReachNode, through: May, end: May) -> May:
        def may(agent: int, step: int) -> Flags:
            ends = end(agent, step)
            return ends if node.every or not self._others(node.graph.agents, agent) else ends | through(agent, step)

        return cache(may)

    def route(self, node: RouteNode, through: May, end: May) -> May:
        return self._perhaps

    def window(self, node: WindowNode, body: May) -> May:
        join = np.logical_and if node.every else np.logical_or
        return self._sweep(
            node, body, lambda agent, step, later: join(body(agent, step), later), lambda agent, step, later: later
        )

    def until(self, node: UntilNode, hold: May, end: May) -> May:
        join, other = (np.logical_and, np.logical_or) if node.every else (np.logical_or, np.logical_and)

        def before(agent: int, step: int, later: Flags) -> Flags:
            return np.asarray(other(hold(agent, step), later))

        def at(agent: int, step: int, later: Flags) -> Flags:
            return np.asarray(join(end(agent, step), before(agent, step, later)))

        return self._sweep(node, end, at, before)

    def _everywhere(self, agent: int, holds: bool) -> Flags:
        return np.full(self.ways[agent].shape[1], holds)

    def _perhaps(self, agent: int, step: int) -> Flags:
        return self._everywhere(agent, True)

    def _others(self, linked: tuple[int, ...], agent: int) -> bool:
        return agent in linked and bool(self.taking_part.intersection(linked) - {agent})

    def _sweep(self, node: WindowNode | UntilNode, last: May, at: Onward, before: Onward) -> May:
        """Possible states of a temporal operator by a backward sweep through its window: ``last`` at its end, then each
        step from the next.

        Args:
            at: rule for a step of the window; ``before``: rule for a step before the window.
        """

        def may(agent: int, step: int) -> Flags:
            ways, roadmap = self.ways[agent], self.labels.roadmaps[self.labels.roadmap_of[agent]]
            first, final = step + node.low, len(ways) - 1 if node.high is None else step + node.high
            if first > final or final > len(ways) - 1:  # past the last step nothing holds
                return self._everywhere(agent, False)
            self._swept += final - step
            if self._swept > STEPS:
                return self._everywhere(agent, True)
            source, target = roadmap.moves.T
            states = last(agent, final)
            for now in range(final - 1, step - 1, -1):
                leads = roadmap.allowed[now] & (states & ways[now + 1])[target]
                later: Flags = np.bincount(source[leads], minlength=ways.shape[1]) > 0
                states = (at if now >= first else before)(agent, now, later)
            return states

        return cache(may)


def _each(parts: Sequence[May], agent: int, step: int) -> Iterable[Flags]:
    return (part(agent, step) for part in parts)
