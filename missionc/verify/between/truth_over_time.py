"""Three-valued truth of kernel formulas at every moment of a motion, sound on both sides."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import assert_never

import numpy as np

from missionc.ir import Graph, InFormation, Predicate
from missionc.kernel.analysis import steps_ahead
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
from missionc.verify.between import links_over_time
from missionc.verify.between.atoms import atom_signals
from missionc.verify.between.interval_sets import Signal, asked_until, of_parts, sometime, throughout, until
from missionc.verify.between.links_over_time import Links
from missionc.verify.between.motion_clock import STEP, Motion

TEAM = -1
"""In the place of an agent, where none is asked."""

Signals = dict[int, Signal]
"""When a formula holds at each agent that it is asked of."""


class Evaluation:
    """Signals along one motion; those of predicates and links are worked out once."""

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.atoms: dict[tuple[Predicate, int], Signal] = {}
        self.graphs: dict[Graph, Links] = {}

    def of(self, root: Node) -> dict[Node, Signals]:
        """A formula about the team, and whatever is below it, at the agents that it is asked of there."""
        order = postorder((root,))
        asked = _asked(root, order)
        ahead = steps_ahead((root,))
        known: dict[Node, Signals] = {}
        for node in order:
            below = [known[child] for child in children(node)]
            agents = sorted(asked[node])
            match node:
                case Release() | EveryNeighbour() | EveryReach() | EveryRoute():
                    denied = [{agent: each.denied for agent, each in part.items()} for part in below]
                    found = self._signals(dual(node, children(node)), agents, denied, ahead)
                    known[node] = {agent: signal.denied for agent, signal in found.items()}
                case _:
                    known[node] = self._signals(node, agents, below, ahead)
        return known

    def links(self, graph: Graph) -> Links:
        """A graph's links."""
        if graph not in self.graphs:
            self.graphs[graph] = links_over_time.links_of(graph, self.motion)
        return self.graphs[graph]

    def _signals(self, node: Node, agents: list[int], below: list[Signals], ahead: dict[Node, int]) -> Signals:
        end = self.motion.end
        always, nowhere = Signal(((0, end),), ()), Signal((), ((0, end),))
        match node:
            case Atom(predicate):
                return self._atom(predicate, agents)
            case Is(members):
                return {agent: always if agent in members else nowhere for agent in agents}
            case Not():
                return {agent: below[0][agent].denied for agent in agents}
            case All():
                return {agent: of_parts(len(below), [part[agent] for part in below], end) for agent in agents}
            case Any():
                return {agent: of_parts(1, [part[agent] for part in below], end) for agent in agents}
            case AtLeast(count):
                return {agent: of_parts(count, [part[agent] for part in below], end) for agent in agents}
            case Always(_, low, high):
                return {agent: throughout(below[0][agent], *_window(low, high), end) for agent in agents}
            case Eventually(_, low, high):
                return {agent: sometime(below[0][agent], *_window(low, high), end) for agent in agents}
            case Until(hold, _, low, high):
                last = last_asked(ahead[hold], end)
                held = {agent: asked_until(last, below[0][agent], end) for agent in agents}
                return {agent: until(held[agent], below[1][agent], *_window(low, high), end) for agent in agents}
            case At(other):
                return dict.fromkeys(agents, below[0][other])
            case Neighbour(graph):
                outside = dict.fromkeys(agents, nowhere)
                return outside | self._of_members(graph, links_over_time.nearby, below)
            case Reach(graph, _, _, hops):
                return below[1] | self._of_members(graph, partial(links_over_time.reach, hops), below)
            case Route(graph, _, _, low, high):
                outside = below[1] if low <= 0 else dict.fromkeys(agents, nowhere)
                return outside | self._of_members(graph, partial(links_over_time.route, low, high), below)
            case PathLength(graph, target, low, high):
                itself = always if low <= 0 else nowhere
                outside = {agent: itself if agent == target else nowhere for agent in agents}
                ends = {agent: always if agent == target else nowhere for agent in graph.agents}
                anyone = dict.fromkeys(graph.agents, always)
                near = self._of_members(graph, partial(links_over_time.route, 0.0, high), [anyone, ends])
                if low <= 0:
                    return outside | near
                below_low = math.nextafter(low, 0.0)
                nearer = self._of_members(graph, partial(links_over_time.route, 0.0, below_low), [anyone, ends])
                return outside | {agent: of_parts(2, [near[agent], nearer[agent].denied], end) for agent in near}
            case Release() | EveryNeighbour() | EveryReach() | EveryRoute():
                raise AssertionError("judged as what their duals are not")
            case _:
                assert_never(node)

    def _atom(self, predicate: Predicate, agents: list[int]) -> Signals:
        """The signals of a predicate about the team, one for all."""
        if isinstance(predicate, InFormation):
            key = (predicate, TEAM)
            if key not in self.atoms:
                self.atoms[key] = atom_signals(predicate, np.zeros(1, dtype=np.int64), self.motion)[0]
            return dict.fromkeys(agents, self.atoms[key])
        new = [agent for agent in agents if (predicate, agent) not in self.atoms]
        if new:
            found = atom_signals(predicate, np.array(new, dtype=np.int64), self.motion)
            self.atoms.update({(predicate, agent): signal for agent, signal in zip(new, found, strict=True)})
        return {agent: self.atoms[predicate, agent] for agent in agents}

    def _of_members(self, graph: Graph, judge: Callable[..., list[Signal]], below: Sequence[Signals]) -> Signals:
        """The signals of the graph's agents, from what is below at each of them."""
        operands = [[part[agent] for agent in graph.agents] for part in below]
        if not graph.agents:
            return {}
        return dict(zip(graph.agents, judge(self.links(graph), *operands, self.motion), strict=True))


def last_asked(ahead: int, end: int) -> int:
    """The last moment, in ticks, from which something that looks so many steps ahead does not look past the mission."""
    return end - ahead * STEP


def _window(low: int, high: int | None) -> tuple[int, int | None]:
    return low * STEP, None if high is None else high * STEP


def _asked(root: Node, order: list[Node]) -> dict[Node, set[int]]:
    """The agents that each formula is asked of, where the root is asked of the first."""
    asked: dict[Node, set[int]] = {node: set() for node in order}
    asked[root].add(0)
    for node in reversed(order):
        match node:
            case At(agent, body):
                asked[body].add(agent)
            case Neighbour(graph, body) | EveryNeighbour(graph, body):
                asked[body].update(graph.agents)
            case Reach(graph) | EveryReach(graph) | Route(graph) | EveryRoute(graph):
                asked[node.through].update(graph.agents)
                asked[node.end].update(graph.agents, asked[node])
            case _:
                for child in children(node):
                    asked[child] |= asked[node]
    return asked
