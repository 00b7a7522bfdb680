"""Three-valued truth of kernel formulas at every moment of a motion, sound on both sides."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeAlias

import numpy as np

from missionc.ir import Graph, Predicate
from missionc.kernel.analysis import agents_asked, steps_ahead
from missionc.kernel.evaluate import Domain, evaluate
from missionc.kernel.nodes import (
    Atom,
    NeighbourNode,
    Node,
    PathLength,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
)
from missionc.kernel.walk import looks_back, postorder
from missionc.verify.between import links_over_time
from missionc.verify.between.atoms import atom_signals
from missionc.verify.between.interval_sets import (
    Signal,
    asked_until,
    looking_back,
    of_parts,
    sometime,
    throughout,
    until,
)
from missionc.verify.between.links_over_time import Links
from missionc.verify.between.motion_clock import STEP, Motion

OTHERS = -1
"""In the place of an agent: all that are not named."""

Signals: TypeAlias = dict[int, Signal]
"""When a formula holds at each agent that it is asked of."""


class Evaluation(Domain[Signals]):
    """The domain of signals along one motion; those of predicates and links are worked out once."""

    def __init__(self, motion: Motion) -> None:
        self.motion, self.end = motion, motion.end
        self.atoms: dict[tuple[Predicate, int], Signal] = {}
        self.graphs: dict[Graph, Links] = {}
        self.ahead: dict[Node, int] = {}
        self.asked: dict[Predicate, set[int]] = {}
        self.always, self.nowhere = Signal(((0, self.end),), ()), Signal((), ((0, self.end),))

    def of(self, root: Node) -> dict[Node, Signals]:
        """A formula about the team, and whatever is below it, at the agents that it is asked of there."""
        order = postorder((root,))
        asked = agents_asked(root)
        self.ahead, self.asked = steps_ahead((root,)), defaultdict(set)
        for node in order:
            if isinstance(node, Atom):
                self.asked[node.predicate] |= asked[node]
        known = evaluate(order, self)
        return {node: {agent: at(known[node], agent) for agent in sorted(asked[node])} for node in order}

    def links(self, graph: Graph) -> Links:
        """A graph's links."""
        if graph not in self.graphs:
            self.graphs[graph] = links_over_time.links_of(graph, self.motion)
        return self.graphs[graph]

    def atom(self, predicate: Predicate, holds: bool) -> Signals:
        whom = {OTHERS} if predicate.about_team else self.asked[predicate]
        new = sorted(agent for agent in whom if (predicate, agent) not in self.atoms)
        if new:
            anyone = np.maximum(np.array(new, dtype=np.int64), 0)
            signals = atom_signals(predicate, anyone, self.motion)
            self.atoms.update({(predicate, agent): signal for agent, signal in zip(new, signals, strict=True)})
        return _signed({agent: self.atoms[predicate, agent] for agent in whom}, holds)

    def member(self, agents: frozenset[int], holds: bool) -> Signals:
        return _signed({OTHERS: self.nowhere} | dict.fromkeys(agents, self.always), holds)

    def meet(self, parts: Sequence[Signals]) -> Signals:
        return self.at_least(len(parts), parts)

    def join(self, parts: Sequence[Signals]) -> Signals:
        return self.at_least(1, parts)

    def at_least(self, count: int, parts: Sequence[Signals]) -> Signals:
        return self._each(lambda *below: of_parts(count, below, self.end), *parts)

    def window(self, node: WindowNode, body: Signals) -> Signals:
        if looks_back(node):
            back = partial(looking_back, sometime, **_window_back(node), end=self.end)
            return self._dual(node.every, partial(self._each, back), body)
        measure = throughout if node.every else sometime
        return self._each(lambda body: measure(body, *_window(node), self.end), body)

    def until(self, node: UntilNode, hold: Signals, end: Signals) -> Signals:
        if looks_back(node):
            back = partial(looking_back, until, **_window_back(node), end=self.end)
            return self._dual(node.every, partial(self._each, back), hold, end)
        last = last_asked(self.ahead[node.hold], self.end)

        def some(hold: Signal, end: Signal) -> Signal:
            return until(asked_until(last, hold, self.end), end, *_window(node), self.end)

        return self._dual(node.every, partial(self._each, some), hold, end)

    def at(self, agent: int, body: Signals) -> Signals:
        return {OTHERS: at(body, agent)}

    def neighbour(self, node: NeighbourNode, body: Signals) -> Signals:
        def some(body: Signals) -> Signals:
            return {OTHERS: self.nowhere} | self._of_members(node.graph, links_over_time.nearby, body)

        return self._dual(node.every, some, body)

    def reach(self, node: ReachNode, through: Signals, end: Signals) -> Signals:
        def some(through: Signals, end: Signals) -> Signals:
            return end | self._of_members(node.graph, partial(links_over_time.reach, node.hops), through, end)

        return self._dual(node.every, some, through, end)

    def route(self, node: RouteNode, through: Signals, end: Signals) -> Signals:
        def some(through: Signals, end: Signals) -> Signals:
            outside = end if node.low <= 0 else {OTHERS: self.nowhere}
            return outside | self._of_members(
                node.graph, partial(links_over_time.route, node.low, node.high), through, end
            )

        return self._dual(node.every, some, through, end)

    def path_length(self, node: PathLength, holds: bool) -> Signals:
        anyone, target = {OTHERS: self.always}, self.member(frozenset((node.agent,)), True)

        def way(most: float) -> Signals:
            return self._of_members(node.graph, partial(links_over_time.route, 0.0, most), anyone, target)

        near = way(node.high)
        if node.low <= 0:
            return _signed(target | near, holds)
        nearer = way(math.nextafter(node.low, 0.0))
        within = {agent: of_parts(2, [near[agent], nearer[agent].denied], self.end) for agent in near}
        return _signed({OTHERS: self.nowhere} | within, holds)

    def _each(self, measure: Callable[..., Signal], *parts: Signals) -> Signals:
        """What is measured of the parts at each agent that all of them know."""
        named = set[int]().union(*parts) | ({OTHERS} if not parts else set())
        whom = [agent for agent in sorted(named) if all(agent in part or OTHERS in part for part in parts)]
        return {agent: measure(*(at(part, agent) for part in parts)) for agent in whom}

    def _dual(self, every: bool, some: Callable[..., Signals], *below: Signals) -> Signals:
        """What asks for every one is not to have some that fails."""
        return _signed(some(*(_signed(part, not every) for part in below)), not every)

    def _of_members(self, graph: Graph, judge: Callable[..., list[Signal]], *below: Signals) -> Signals:
        """The signals of the graph's agents, from what is below at each of them."""
        operands = [[at(part, agent) for agent in graph.agents] for part in below]
        if not graph.agents:
            return {}
        return dict(zip(graph.agents, judge(self.links(graph), *operands, self.motion), strict=True))


def at(signals: Signals, agent: int) -> Signal:
    """The signal of an agent."""
    return signals[agent if agent in signals else OTHERS]


def last_asked(ahead: int, end: int) -> int:
    """The last moment, in ticks, from which something that looks so many steps ahead does not look past the mission."""
    return end - ahead * STEP


def _signed(signals: Signals, holds: bool) -> Signals:
    return signals if holds else {agent: signal.denied for agent, signal in signals.items()}


def _window(node: WindowNode | UntilNode) -> tuple[int, int | None]:
    return node.low * STEP, None if node.high is None else node.high * STEP


def _window_back(node: WindowNode | UntilNode) -> dict[str, int]:
    """The window in ticks back, the nearer bound first."""
    assert node.high is not None
    return {"low": -node.high * STEP, "high": -node.low * STEP}
