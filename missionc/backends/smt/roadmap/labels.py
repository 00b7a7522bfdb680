"""Roadmap labels: states, moves and pairs of states in which each predicate is true, and headings of moves."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from functools import reduce
from typing import TypeAlias

import numpy as np

from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.dynamics import Motions
from missionc.geometry.vectors import distinct, norm
from missionc.ir import DuringMotion, Mission, Predicate
from missionc.ir.kernel.nodes import All, Any, Atom, Is, Node, Not
from missionc.ir.kernel.walk import children
from missionc.ir.language.margins.predicate_margins import holds, least_in_motion, of_pair, of_states


def faced(way: Array, turned_to: Array) -> Array:
    """Heading at the beginning of each move, rad: its direction, or for a waiting agent the heading of its next state.

    Args:
        way: movement, (..., dim), metres.
        turned_to: heading of the move's target state, (...), rad; NaN if arbitrary.
    """
    still = 1e-9  # metres; an agent that moves less in a step keeps its heading
    moves = norm(way[..., :2]) > still
    return np.asarray(np.where(moves, np.arctan2(way[..., 1], way[..., 0]), turned_to))


OwnState: TypeAlias = "tuple[Array, Array, Array | None]"
"""Positions, metres, and velocities, m/s, (..., dim) each, and headings, (...), rad, if needed."""


class Unexpressible(ValueError):
    """Error for a predicate that no state, move, or pair of states decides."""


class Labels:
    """Truth of predicates on roadmap states, cached per predicate.

    ``roadmap_of`` has the index of each agent's roadmap.
    """

    def __init__(self, mission: Mission, roadmaps: tuple[Roadmap, ...]) -> None:
        self.mission, self.roadmaps = mission, roadmaps
        self.roadmap_of = {agent: number for number, roadmap in enumerate(roadmaps) for agent in roadmap.agents}
        self._known: dict[Hashable, Flags] = {}
        self._open: dict[Hashable, Flags] = {}
        self._parts: dict[Predicate, tuple[Predicate, ...]] = {}

    def of_places(self, predicate: Predicate) -> bool:
        """Return true if the state alone decides the predicate, for any agent."""
        return (
            not predicate.others
            and not predicate.reads_past
            and not any(self.of_moves(predicate, number) for number in range(len(self.roadmaps)))
        )

    def of_moves(self, predicate: Predicate, number: int) -> bool:
        """Return true if the predicate depends on the move from a step, not only on the state in the roadmap
        ``number``."""
        first = self.roadmaps[number].agents[0]
        momentum = self.mission.agents[first].dynamics.has_momentum
        return predicate.reads_motion or (predicate.reads_speed and not momentum)

    def places_where(self, predicate: Predicate, truth: bool) -> Flags:
        """Return true for each state of all roadmaps in which the predicate has this truth: (places,)."""
        return np.concatenate([self.states_where(predicate, number, truth) for number in range(len(self.roadmaps))])

    def states_where(self, predicate: Predicate, number: int, truth: bool) -> Flags:
        """Return true for each state of the roadmap ``number`` in which the predicate has this truth: (states,)."""
        holds = self.states(predicate, number)
        return holds if truth else ~holds

    def states(self, predicate: Predicate, number: int) -> Flags:
        """Return true for each state of the roadmap ``number`` in which the predicate is true: (states,)."""
        roadmap = self.roadmaps[number]
        return self._own(predicate, number, "states", lambda: (roadmap.position, roadmap.velocity, None))

    def standing(self, predicate: Predicate, number: int) -> Flags:
        """Return true for each state of the roadmap ``number`` in which the predicate is true for an agent at rest:
        (states,)."""
        position = self.roadmaps[number].position
        return self._own(predicate, number, "standing", lambda: (position, np.zeros_like(position), None))

    def moves(self, predicate: Predicate, number: int, holds: bool, *, at_end: bool) -> Flags:
        """Return true for each move in whose first (``at_end``: last) state the predicate is true, or if not ``holds``,
        false: (moves,).

        The heading of a waiting agent with an arbitrary heading is unknown; the result is then false in both cases.
        """
        roadmap = self.roadmaps[number]
        source, target = roadmap.moves.T
        if isinstance(predicate, DuringMotion):
            return np.equal(self._during_motion(predicate, number, at_end=at_end), holds)

        def states() -> OwnState:
            way = roadmap.position[target] - roadmap.position[source]
            heading = faced(way, roadmap.heading[target]) if predicate.reads_heading else None
            return roadmap.position[target if at_end else source], way / self.mission.step, heading

        there = "ends" if at_end else "begins"
        true = self._own(predicate, number, there, states)
        return true if holds else ~true & ~self._open[predicate, number, there]

    def _during_motion(self, predicate: DuringMotion, number: int, *, at_end: bool) -> Flags:
        """Flags of moves during which it holds, or with ``at_end``, after which it does: (moves,)."""
        roadmap, key = self.roadmaps[number], (predicate, number, at_end)
        if key not in self._known:
            agent, motions = self.mission.agents[roadmap.agents[0]], roadmap.motions(self.mission)
            each = Motions(motions.position[:, None], motions.velocity[:, None], motions.acceleration[:, None])
            body = np.array([agent.radius]), np.array([agent.altitude])
            least = least_in_motion(
                self.mission,
                predicate.at_place,
                lambda shares: each.at(self.mission.step if at_end else (shares * self.mission.step)[..., None]),
                (len(roadmap.moves),),
                *body,
            )
            self._known[key] = np.asarray(holds(predicate, least))
        return self._known[key]

    def parts(self, predicate: Predicate) -> tuple[Predicate, ...]:
        """Predicates about fewer agents whose conjunction equals the predicate; cached."""
        if predicate not in self._parts:
            self._parts[predicate] = predicate.parts
        return self._parts[predicate]

    def pair(self, predicate: Predicate, agents: tuple[int, int], first: int, second: int) -> Flags:
        """Return true for each pair of states in which the predicate is true for the first agent: (states, states).

        Raises:
            Unexpressible: the predicate depends on a speed, or on a third agent.
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
        """Return true for each pair of states in which the predicate has this truth for the first agent: (states,
        states).

        Raises:
            Unexpressible: the predicate depends on a speed, or on a third agent.
        """
        holds = self.pair(predicate, agents, first, second)
        return holds if truth else ~holds

    def _places(self, number: int) -> tuple[Array, Indices]:
        """Distinct positions of a roadmap's states, (places, dim), metres, and for each state the index of its
        position."""
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
    """Nodes whose truth an agent's own state decides; nodes are given children first."""
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
    """Return true for each state, (states,), in which the agent's own state makes the node true."""
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
