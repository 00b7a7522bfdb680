"""Single-agent relaxation: a necessary condition for a plan of some agents, each looked at by itself.

    in   formulas, where each agent can be, who takes part
    out  no, for certain; or perhaps

A formula may hold of an agent in a state where some way onwards leads through
the states that it asks for. What it asks of other agents is taken to be so
wherever there is one whom it can be asked of. That takes a sweep or two over the moves of
a roadmap, and often saves lowering and solving a problem with too few agents.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import reduce
from typing import assert_never

import numpy as np

from missionc.backends.smt.encode.lower import deep
from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.trace import Flags
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

STEPS = 5_000
"""After sweeping over so many steps the rest is taken to be possible: a window at every step of a window costs many."""

Onward = Callable[[int, Flags], Flags]
"""What may hold at a step, (states,), from what may hold one step later, (states,)."""


class SingleAgentRelaxation:
    """A may analysis of agents: what can hold while those who take part move and the others are nowhere.

    Args:
        ways: for each agent where it can be, (steps + 1, states).
        taking_part: whom others may be linked to.
    """

    def __init__(self, labels: Labels, ways: tuple[Flags, ...], taking_part: frozenset[int]) -> None:
        self.labels, self.ways, self.taking_part = labels, ways, taking_part
        self.roadmap_of = {agent: number for number, each in enumerate(labels.roadmaps) for agent in each.agents}
        self._known: dict[tuple[Node, int, int], Flags] = {}
        self._swept = 0

    def infeasible(self, formulas: Iterable[Node]) -> bool:
        """Whether some formula, asked of step 0, holds in no joint motion of these agents. False says nothing."""
        with deep():
            return not all((self.may(formula, 0, 0) & self.ways[0][0]).any() for formula in formulas)

    def may(self, node: Node, agent: int, step: int) -> Flags:
        """In which states, (states,), the formula may hold of the agent at the step."""
        key = (node, agent, step)
        if key not in self._known:
            self._known[key] = self._may(node, agent, step)
        return self._known[key]

    def _may(self, node: Node, agent: int, step: int) -> Flags:
        states, number = self.ways[agent].shape[1], self.roadmap_of[agent]
        perhaps, never = np.ones(states, dtype=np.bool_), np.zeros(states, dtype=np.bool_)

        def part(body: Node) -> Flags:
            return self.may(body, agent, step)

        match node:
            case Atom(predicate) if self.labels.of_places(predicate):
                return self.labels.states(predicate, number)
            case Not(Atom(predicate)) if self.labels.of_places(predicate):
                return ~self.labels.states(predicate, number)
            case Is(members):
                return perhaps if agent in members else never
            case Not(Is(members)):
                return never if agent in members else perhaps
            case All(parts):
                return reduce(np.logical_and, map(part, parts), perhaps)
            case Any(parts):
                return reduce(np.logical_or, map(part, parts), never)
            case AtLeast(count, parts):
                return np.asarray(sum((part(each).astype(np.int64) for each in parts), np.zeros(states)) >= count)
            case At(other, body):
                held = self.may(body, other, step) & self.ways[other][step]
                return perhaps if held.any() else never
            case Always() | Eventually():
                return self._window(node, agent, step)
            case Until() | Release():
                return self._until(node, agent, step)
            case Neighbour(graph) if not self._others(graph.agents, agent):
                return never
            case Reach(graph, through, end) if self._others(graph.agents, agent):
                return part(end) | part(through)
            case Reach(_, _, end) | EveryReach(_, _, end):
                return part(end)
            case Atom() | Not() | Neighbour() | EveryNeighbour() | Route() | EveryRoute() | PathLength():
                return perhaps
            case _:
                assert_never(node)

    def _others(self, linked: tuple[int, ...], agent: int) -> bool:
        return agent in linked and bool(self.taking_part.intersection(linked) - {agent})

    def _window(self, node: Always | Eventually, agent: int, step: int) -> Flags:
        """The body at every step of the window ahead, or at some."""

        def at(step: int, later: Flags) -> Flags:
            now = self.may(node.body, agent, step)
            return now & later if isinstance(node, Always) else now | later

        return self._sweep(node.body, node.low, node.high, agent, step, at, lambda step, later: later)

    def _until(self, node: Until | Release, agent: int, step: int) -> Flags:
        some = isinstance(node, Until)

        def before(step: int, later: Flags) -> Flags:
            hold = self.may(node.hold, agent, step)
            return hold & later if some else hold | later

        def at(step: int, later: Flags) -> Flags:
            end = self.may(node.end, agent, step)
            return end | before(step, later) if some else end & before(step, later)

        return self._sweep(node.end, node.low, node.high, agent, step, at, before)

    def _sweep(
        self, last: Node, low: int, high: int | None, agent: int, step: int, at: Onward, before: Onward
    ) -> Flags:
        """Backwards through a window: ``last`` at its end, then what each step makes of the one after it.

        Args:
            at: of a step of the window; ``before``: of one before the window.
        """
        ways, roadmap = self.ways[agent], self.labels.roadmaps[self.roadmap_of[agent]]
        first, final = step + low, len(ways) - 1 if high is None else step + high
        if first > final or final > len(ways) - 1:  # past the last step nothing holds
            return np.zeros(ways.shape[1], dtype=np.bool_)
        self._swept += final - step
        if self._swept > STEPS:
            return np.ones(ways.shape[1], dtype=np.bool_)
        source, target = roadmap.moves.T
        found = self.may(last, agent, final)
        for now in range(final - 1, step - 1, -1):
            leads = roadmap.allowed[now] & (found & ways[now + 1])[target]
            later: Flags = np.bincount(source[leads], minlength=ways.shape[1]) > 0
            found = at(now, later) if now >= first else before(now, later)
        return found
