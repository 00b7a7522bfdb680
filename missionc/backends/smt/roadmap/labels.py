"""Roadmap labels: the states, moves and pairs of states in which each predicate holds, and the headings of moves."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from functools import reduce
from typing import TypeAlias

import numpy as np

from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.vectors import distinct, norm
from missionc.ir import Mission, Predicate
from missionc.ir.kernel.nodes import All, Any, Atom, Is, Node, Not
from missionc.ir.kernel.walk import children
from missionc.ir.language.margins.predicate_margins import holds, of_pair, of_states


def faced(way: Array, turned_to: Array) -> Array:
    """Where an agent faces as each move begins, rad: along it, or of one that stays where its next state faces.

    Args:
        way: (..., dim), metres.
        turned_to: (...), rad, the heading of the state that the move leads to; NaN where that may be any.
    """
    still = 1e-9  # metres; an agent that moves less in a step keeps its heading
    moves = norm(way[..., :2]) > still
    return np.asarray(np.where(moves, np.arctan2(way[..., 1], way[..., 0]), turned_to))


OwnState: TypeAlias = "tuple[Array, Array, Array | None]"
"""Positions and velocities, (..., dim) each, and headings, (...), where those are asked for."""


class Unexpressible(ValueError):
    """A predicate that neither a state, nor a move, nor the states of two agents decide."""


class Labels:
    """Truth on roadmap states, worked out once for each predicate; ``roadmap_of`` has the number of each agent's."""

    def __init__(self, mission: Mission, roadmaps: tuple[Roadmap, ...]) -> None:
        self.mission, self.roadmaps = mission, roadmaps
        self.roadmap_of = {agent: number for number, roadmap in enumerate(roadmaps) for agent in roadmap.agents}
        self._known: dict[Hashable, Flags] = {}
        self._open: dict[Hashable, Flags] = {}
        self._parts: dict[Predicate, tuple[Predicate, ...]] = {}

    def of_places(self, predicate: Predicate) -> bool:
        """Whether the place alone decides it, whoever stands there."""
        return (
            not predicate.others
            and not predicate.reads_past
            and not any(self.of_moves(predicate, number) for number in range(len(self.roadmaps)))
        )

    def of_moves(self, predicate: Predicate, number: int) -> bool:
        """Whether it depends on the motion that starts at a step, not on the state in that roadmap alone."""
        first = self.roadmaps[number].agents[0]
        return predicate.reads_speed and not self.mission.agents[first].dynamics.has_momentum

    def places_where(self, predicate: Predicate, truth: bool) -> Flags:
        """At which places it holds, or does not: (places,)."""
        return np.concatenate([self.states_where(predicate, number, truth) for number in range(len(self.roadmaps))])

    def states_where(self, predicate: Predicate, number: int, truth: bool) -> Flags:
        """In which states of that roadmap it holds, or does not: (states,)."""
        holds = self.states(predicate, number)
        return holds if truth else ~holds

    def states(self, predicate: Predicate, number: int) -> Flags:
        """In which states of that roadmap it holds: (states,)."""
        roadmap = self.roadmaps[number]
        return self._own(predicate, number, "states", lambda: (roadmap.position, roadmap.velocity, None))

    def standing(self, predicate: Predicate, number: int) -> Flags:
        """In which states of that roadmap it holds of an agent that never moves: (states,)."""
        position = self.roadmaps[number].position
        return self._own(predicate, number, "standing", lambda: (position, np.zeros_like(position), None))

    def moves(self, predicate: Predicate, number: int, holds: bool, *, at_end: bool) -> Flags:
        """During which moves it holds, or does not, in the state they start from or, ``at_end``, end in: (moves,).

        Of the heading of who stays, and may face anywhere, nothing is known: then it does neither.
        """
        roadmap = self.roadmaps[number]
        source, target = roadmap.moves.T

        def states() -> OwnState:
            way = roadmap.position[target] - roadmap.position[source]
            heading = faced(way, roadmap.heading[target]) if predicate.reads_heading else None
            return roadmap.position[target if at_end else source], way / self.mission.step, heading

        there = "ends" if at_end else "begins"
        true = self._own(predicate, number, there, states)
        return true if holds else ~true & ~self._open[predicate, number, there]

    def parts(self, predicate: Predicate) -> tuple[Predicate, ...]:
        """The predicates about fewer agents that it is the conjunction of."""
        if predicate not in self._parts:
            self._parts[predicate] = predicate.parts
        return self._parts[predicate]

    def pair(self, predicate: Predicate, agents: tuple[int, int], first: int, second: int) -> Flags:
        """With the two agents in which states it holds of the first: (states, states).

        Raises:
            Unexpressible: it reads a speed, or a third agent.
        """
        key = (predicate, agents, first, second)
        if key not in self._known:
            (one, own), (other, others) = self._places(first), self._places(second)
            try:
                margins = of_pair(predicate, self.mission, *agents, one[:, None, :], other[None, :, :])
            except ValueError as error:
                raise Unexpressible(f"a comparison: {error}") from error
            self._known[key] = np.asarray(holds(predicate, np.asarray(margins)))[np.ix_(own, others)]
        return self._known[key]

    def pairs_where(self, predicate: Predicate, agents: tuple[int, int], first: int, second: int, truth: bool) -> Flags:
        """With the two agents in which states it holds of the first, or does not: (states, states).

        Raises:
            Unexpressible: it reads a speed, or a third agent.
        """
        holds = self.pair(predicate, agents, first, second)
        return holds if truth else ~holds

    def _places(self, number: int) -> tuple[Array, Indices]:
        """The positions of that roadmap's states, each once, (places, dim), and which of them each state has."""
        position = self.roadmaps[number].position
        first, place = distinct(position)
        return position[first], place

    def _own(self, predicate: Predicate, number: int, what: str, states: Callable[[], OwnState]) -> Flags:
        key = (predicate, number, what)
        if key not in self._known:
            margins = np.asarray(of_states(predicate, self.mission, self.roadmaps[number].agents[0], *states()))
            self._known[key], self._open[key] = np.asarray(holds(predicate, margins)), np.isnan(margins)
        return self._known[key]


def own_states(order: Iterable[Node], labels: Labels) -> set[Node]:
    """The ones of these nodes, each after those below it, that an agent's own state decides."""
    own: set[Node] = set()
    for node in order:
        match node:
            case Atom(predicate):
                known = labels.of_places(predicate)
            case Is():
                known = True
            case Not() | All() | Any():
                known = all(part in own for part in children(node))
            case _:
                known = False
        if known:
            own.add(node)
    return own


def states_of(node: Node, agent: int, labels: Labels) -> Flags:
    """In which states, (states,), an agent's own state makes it true."""
    number = labels.roadmap_of[agent]
    shape = len(labels.roadmaps[number].position)
    match node:
        case Atom(predicate):
            return labels.states(predicate, number)
        case Is(members):
            return np.full(shape, agent in members)
        case Not(body):
            return ~states_of(body, agent, labels)
        case All() | Any():
            join = np.logical_and if node.every else np.logical_or
            return reduce(join, (states_of(part, agent, labels) for part in node.parts), np.full(shape, node.every))
        case _:
            raise AssertionError(node)
