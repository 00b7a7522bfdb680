"""Whether a plan for some of the agents can exist at all, each of them looked at by itself.

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
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Route,
    Until,
)

STEPS = 5_000
"""After sweeping over so many steps the rest is taken to be possible: a window at every step of a window costs many."""

Onward = Callable[[int, Flags], Flags]
"""What may hold at a step, (states,), from what may hold one step later, (states,)."""


class Outlook:
    """What may hold of agents while those who take part move and the others are nowhere.

    Args:
        ways: for each agent where it can be, (steps + 1, states).
        taking_part: whom others may be linked to.
    """

    def __init__(self, labels: Labels, ways: tuple[Flags, ...], taking_part: frozenset[int]) -> None:
        self.labels, self.ways, self.taking_part = labels, ways, taking_part
        self.roadmap_of = {agent: number for number, each in enumerate(labels.roadmaps) for agent in each.agents}
        self._known: dict[tuple[Node, bool, int, int], Flags] = {}
        self._swept = 0

    def hopeless(self, formulas: Iterable[Node]) -> bool:
        """Whether some formula, asked of step 0, holds in no joint motion of these agents. False says nothing."""
        with deep():
            return not all((self.may(formula, True, 0, 0) & self.ways[0][0]).any() for formula in formulas)

    def may(self, node: Node, positive: bool, agent: int, step: int) -> Flags:
        """In which states, (states,), the formula may hold of the agent at the step; not ``positive``: fail."""
        key = (node, positive, agent, step)
        if key not in self._known:
            self._known[key] = self._may(node, positive, agent, step)
        return self._known[key]

    def _may(self, node: Node, positive: bool, agent: int, step: int) -> Flags:
        states, number = self.ways[agent].shape[1], self.roadmap_of[agent]
        perhaps, never = np.ones(states, dtype=np.bool_), np.zeros(states, dtype=np.bool_)

        def part(body: Node, positive: bool = positive) -> Flags:
            return self.may(body, positive, agent, step)

        match node:
            case Atom(predicate) if self.labels.of_places(predicate):
                return np.asarray(self.labels.states(predicate, number) == positive)
            case Is(members):
                return perhaps if (agent in members) == positive else never
            case Not(body):
                return part(body, not positive)
            case All(parts) | Any(parts):
                every = positive == isinstance(node, All)
                return reduce(np.logical_and if every else np.logical_or, map(part, parts), perhaps if every else never)
            case AtLeast(count, parts):
                count = count if positive else len(parts) - count + 1
                return np.asarray(sum((part(each).astype(np.int64) for each in parts), np.zeros(states)) >= count)
            case At(other, body):
                held = self.may(body, positive, other, step) & self.ways[other][step]
                return perhaps if held.any() else never
            case Always(body, low, high):
                return self._window(body, positive, positive, low, high, agent, step)
            case Eventually(body, low, high):
                return self._window(body, positive, not positive, low, high, agent, step)
            case Until():
                return self._until(node, positive, agent, step)
            case Neighbour(graph) if positive and not self._others(graph.agents, agent):
                return never
            case Reach(graph, through, end):
                if positive and self._others(graph.agents, agent):
                    return part(end) | part(through)
                return part(end)
            case Atom() | Neighbour() | Route() | PathLength():
                return perhaps
            case _:
                assert_never(node)

    def _others(self, linked: tuple[int, ...], agent: int) -> bool:
        return agent in linked and bool(self.taking_part.intersection(linked) - {agent})

    def _window(
        self, body: Node, positive: bool, every: bool, low: int, high: int | None, agent: int, step: int
    ) -> Flags:
        """The body (its negation, where not ``positive``) at every step of the window ahead, or at some."""

        def at(step: int, later: Flags) -> Flags:
            now = self.may(body, positive, agent, step)
            return now & later if every else now | later

        return self._sweep(body, positive, low, high, agent, step, at, lambda step, later: later)

    def _until(self, node: Until, positive: bool, agent: int, step: int) -> Flags:
        def before(step: int, later: Flags) -> Flags:
            hold = self.may(node.hold, positive, agent, step)
            return hold & later if positive else hold | later

        def at(step: int, later: Flags) -> Flags:
            end = self.may(node.end, positive, agent, step)
            return end | before(step, later) if positive else end & before(step, later)

        return self._sweep(node.end, positive, node.low, node.high, agent, step, at, before)

    def _sweep(
        self, last: Node, positive: bool, low: int, high: int | None, agent: int, step: int, at: Onward, before: Onward
    ) -> Flags:
        """Backwards through a window: ``last`` at its end, then what each step makes of the one after it.

        Args:
            at: of a step of the window; ``before``: of one before the window.
        """
        ways, roadmap = self.ways[agent], self.labels.roadmaps[self.roadmap_of[agent]]
        first, final = step + low, len(ways) - 1 if high is None else step + high
        if first > final or final > len(ways) - 1:  # past the last step nothing holds
            return np.full(ways.shape[1], not positive)
        self._swept += final - step
        if self._swept > STEPS:
            return np.ones(ways.shape[1], dtype=np.bool_)
        source, target = roadmap.moves.T
        found = self.may(last, positive, agent, final)
        for now in range(final - 1, step - 1, -1):
            leads = roadmap.allowed[now] & (found & ways[now + 1])[target]
            later: Flags = np.bincount(source[leads], minlength=ways.shape[1]) > 0
            found = at(now, later) if now >= first else before(now, later)
        return found
