"""Reservations: fixed trajectories of planned agents, and the roadmap moves that remain free for the others.

Exclusions: mutual exclusion and capacity requirements, which couple agents only when they need the same region.

    in   conjuncts of the requirements; the reservations of planned agents
    out  allowed states of an agent at each step, given the planned agents

``always[0, end] not (at least 2 truck: bridge)`` names every truck, but each truck can be planned separately, one after
the other. Planned agents follow their trajectories, and all others count as absent (a relaxation). A schedule of clot
uses literals over time intervals instead (``mutex_literals``), since it has no agent states yet.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import replace
from functools import reduce

import numpy as np
from scipy.spatial import cKDTree

from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.refine.lazy_constraints import each_step, kinematics, metric, needed
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.dynamics import Motions
from missionc.geometry.relative_motion import closest_approach
from missionc.geometry.vectors import norm
from missionc.ir import Mission
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Node
from missionc.ir.kernel.walk import Conjunct, children, postorder, rebuilt

FIXED = 1 << 17
"""Weight of an agent that must not be displaced: above that of all displaceable agents together."""


class Reservations:
    """Reserved trajectories: joint motion of some agents, in the order of planning.

    ``states``, (agents, steps + 1), contains their motion; entries of other agents are meaningless. Agents in ``alone``
    were planned one by one and may be replanned individually. ``tables`` contains the remaining free moves on each
    roadmap.
    """

    def __init__(self, motion: Motion, mission: Mission) -> None:
        self.motion, self.mission = motion, mission
        self.agents: list[int] = []
        self.alone: set[int] = set()
        self.states = np.zeros((motion.agents, motion.steps + 1), dtype=np.int64)
        self.known: set[int] = set()
        """Agents whose current or last trajectory ``states`` contains."""
        self.moved = np.zeros(motion.agents, dtype=np.int64)
        """Number of times that each agent was displaced, (agents,)."""
        self.tables = [ReservationTable(roadmap, mission) for roadmap in motion.roadmaps]

    def reserve(self, agents: Iterable[int], states: Indices, *, alone: bool = False) -> None:
        """Reserve the trajectories of ``agents`` in ``states``, (agents of the mission, steps + 1)."""
        for agent in agents:
            self.agents.append(agent)
            self.states[agent] = states[agent]
            self.known.add(agent)
            if alone:
                self.alone.add(agent)
            track = self._track(agent, states[agent])
            for table in self.tables:
                table.keep_clear_of(agent, track, int(1 + self.moved[agent]) if alone else FIXED)

    def release(self, agents: Iterable[int]) -> None:
        """Release the reservations of ``agents``."""
        for agent in agents:
            self.agents.remove(agent)
            self.alone.discard(agent)
            for table in self.tables:
                table.release(agent)

    def copy(self) -> Reservations:
        other = copy(self)
        other.agents, other.alone, other.known = list(self.agents), set(self.alone), set(self.known)
        other.states, other.moved = self.states.copy(), self.moved.copy()
        other.tables = [table.copy() for table in self.tables]
        return other

    def emptied(self) -> Reservations:
        """Copy for the same roadmaps without reservations."""
        other = copy(self)
        other.agents, other.alone, other.known = [], set(), set()
        other.states, other.moved = np.zeros_like(self.states), np.zeros_like(self.moved)
        other.tables = [table.emptied() for table in self.tables]
        return other

    @property
    def settled(self) -> set[tuple[int, bytes]]:
        """Planned agents, each with its path."""
        return {(agent, self.states[agent].tobytes()) for agent in self.agents}

    def in_the_way(self, agent: int, way: Indices) -> list[int]:
        """Planned agents that conflict with the agent on this path, states (steps + 1,)."""
        others = np.array(self.agents, dtype=np.int64)
        if not others.size:
            return []
        theirs = kinematics(self.states[others], others, self.motion, self.mission)
        pairs = np.full_like(others, agent), others
        factors = each_step(metric(*pairs, self.mission))
        nearest = closest_approach(self._track(agent, way), theirs, self.mission.step, factors)
        least = needed(*pairs, self.mission)
        met: list[int] = others[(nearest < least[:, None]).any(axis=1)].tolist()
        return met

    def passed(self, agent: int) -> Flags:
        """Return true for each state of an agent that is too close to known paths of others; all false until the agent
        was displaced."""
        roadmap = self.motion.roadmap(agent)
        near = np.zeros(len(roadmap.position), dtype=np.bool_)
        others = sorted(self.known - {agent}) if self.moved[agent] else []
        for other in others:
            pair = np.array([agent]), np.array([other])
            way = np.unique(self.motion.roadmap(other).position[self.states[other]], axis=0)
            factors = metric(*pair, self.mission)
            scale = 1.0 if factors is None else factors[0]
            near |= cKDTree(way * scale).query(roadmap.position * scale)[0] < float(needed(*pair, self.mission)[0])
        return near

    def _track(self, agent: int, way: Indices) -> Motions:
        return kinematics(way[None], np.array([agent]), self.motion, self.mission).take(0)

    def fixed(self, ways: Sequence[Flags]) -> tuple[Flags, ...]:
        """Possible states of all agents, (steps + 1, states) each, with planned agents on their trajectories."""
        settled = set(self.agents)
        fixed = []
        for agent in range(self.motion.agents):
            if agent in settled:
                way = np.zeros_like(self.motion.roadmap(agent).standing)
                way[np.arange(len(way)), self.states[agent]] = True
            else:
                way = ways[agent]
            fixed.append(way)
        return tuple(fixed)

    def open_roadmaps(self) -> tuple[Roadmap, ...]:
        """Roadmaps with only the moves that do not conflict with planned agents."""
        return tuple(table.open_roadmap() for table in self.tables)


class ReservationTable:
    """Reservation table of one roadmap: the moves that are free at each step.

    The blocked cells of each agent are a sparse list; a cell is a step and a move, encoded in one number. ``begins``
    has the index of each state's first move, (states + 1,); ``leads_on``, (moves,), is true for moves other than
    waiting.
    """

    def __init__(self, roadmap: Roadmap, mission: Mission) -> None:
        self.roadmap, self.mission = roadmap, mission
        source, target = roadmap.moves.T
        self.begins = np.searchsorted(source, np.arange(len(roadmap.position) + 1))
        self.sizes = np.diff(self.begins)
        self.leads_on = source != target
        self.moves = roadmap.motions(mission)
        self.length = self.moves.lengths(mission.step)
        self.longest = float(self.length.max(initial=0.0))
        going = np.flatnonzero((roadmap.allowed & self.leads_on).any(axis=1))
        self.over = int(going[-1]) + 1 if going.size else 0
        """Step from which on agents can only wait."""
        shortest = np.min(np.where(roadmap.allowed, self.length, np.inf), axis=1, initial=np.inf)
        self.to_come = np.append(np.cumsum(shortest[::-1])[::-1], 0.0)
        """Least distance that an agent still has to move from each step on, (steps + 1,), metres; 0 if it can wait."""
        self.middle, self.reach = _disc(self.moves, mission.step)
        self._tree = cKDTree(self.middle)
        self._taken = np.zeros(roadmap.allowed.shape, dtype=np.int32)
        """Total weight of the agents that each move conflicts with, (steps, moves)."""
        self._near: dict[int, tuple[Indices, int]] = {}
        """Blocked cells and weight of each planned agent."""

    def copy(self) -> ReservationTable:
        other = copy(self)
        other._taken, other._near = self._taken.copy(), dict(self._near)
        return other

    def emptied(self) -> ReservationTable:
        """Copy for the same roadmap without reservations."""
        other = copy(self)
        other._taken, other._near = np.zeros(self._taken.shape, dtype=self._taken.dtype), {}
        return other

    def keep_clear_of(self, agent: int, track: Motions, weight: int) -> None:
        """Block all moves that come too close to the agent.

        Args:
            track: motions of the agent, (steps).
            weight: ``FIXED`` if the agent must not be displaced.
        """
        pair = np.array([self.roadmap.agents[0]]), np.array([agent])
        least, factors = float(needed(*pair, self.mission)[0]), metric(*pair, self.mission)
        step, move = self.too_near(track, least, factors)
        cells = np.sort(step * len(self.leads_on) + move)
        self._near[agent] = cells, weight
        self._taken.reshape(-1)[cells] += weight

    def too_near(self, others: Motions, least: float, factors: Array | None) -> tuple[Indices, Indices]:
        """Pairs of others' motions and moves that come closer to each other than ``least`` metres, (pairs,) each.

        Args:
            factors: factors on the axes, (..., dim), as for ``closest_approach``.
        """
        (middle, reach), widest = _disc(others, self.mission.step), _within(least, factors)
        around = self._tree.query_ball_point(middle, reach + self.reach.max(initial=0.0) + widest)
        other = np.repeat(np.arange(len(middle)), [len(moves) for moves in around])
        move = np.concatenate([np.array(moves, dtype=np.int64) for moves in around])
        near = norm(self.middle[move] - middle[other]) < self.reach[move] + reach[other] + widest
        other, move = other[near], move[near]
        nearest = closest_approach(self.moves.take(move), others.take(other), self.mission.step, factors)
        return other[nearest < least], move[nearest < least]

    def release(self, agent: int) -> None:
        cells, weight = self._near.pop(agent)
        self._taken.reshape(-1)[cells] -= weight

    def free(self, step: int, move: Indices, *, pushing: bool) -> Flags:
        """Return true for each of these moves, (rows,), that conflicts with no agent at the step, or with ``pushing``,
        with no fixed agent."""
        free: Flags = self.roadmap.allowed[step].take(move) & (self._taken[step].take(move) < (FIXED if pushing else 1))
        return free

    def onward(self, state: Indices) -> tuple[Indices, Indices]:
        """Moves that leave states, (rows,): the row of each move, and the move, (moves,) each."""
        sizes = self.sizes.take(state)
        row = np.arange(len(state)).repeat(sizes)
        return row, np.arange(len(row)) + (self.begins.take(state) - sizes.cumsum() + sizes).take(row)

    def weight(self, step: int, move: Indices) -> Indices:
        """Total weight of the agents that conflict with each move at the step, (rows,)."""
        return np.asarray(self._taken[step].take(move))

    def metres(self, way: Indices) -> float:
        """Length of a path, states (steps + 1,), metres."""
        return float(self.length[self.roadmap.moves_of(way)].sum())

    def open_roadmap(self) -> Roadmap:
        return replace(self.roadmap, allowed=self.roadmap.allowed & (self._taken == 0))


def _within(least: float, factors: Array | None) -> float:
    """Distance, metres, that satisfies the separation ``least`` with these factors, (..., dim), in every direction."""
    return least if factors is None else least / min(1.0, float(factors.min()))


def _disc(motions: Motions, step: float) -> tuple[Array, Array]:
    """Centres and radii of discs that contain motions of one step: (...) -> (..., dim) and (...), metres."""
    reach = norm(motions.velocity) * (step / 2) + norm(motions.acceleration) * (step**2 / 2)
    return motions.at(step / 2), reach


class Exclusion(Record, eq=False):
    """Team formula that requires each agent to avoid some states unless enough other agents avoid their states.

    Args:
        conjunct: formula of the team, with its steps.
        own: its nodes that one agent's own state decides.
        named: agents that it restricts.
    """

    conjunct: Conjunct
    own: frozenset[Node]
    named: frozenset[int]
    labels: Labels

    @staticmethod
    def of(conjunct: Conjunct, labels: Labels) -> Exclusion | None:
        """Conjunct as an exclusion; None if the conjunct has another form."""
        elsewhere = 0.5  # share of states with a property, from which the requirement is to avoid the remaining states
        own = frozenset(own_states(postorder((conjunct.formula,)), labels))
        leaves = _leaves(conjunct, own)
        named = frozenset(who for who, _ in leaves)
        if conjunct.steps is None or len(named) < 2:
            return None
        away = all(states_of(node, who, labels).mean() >= elsewhere for who, node in leaves)
        return Exclusion(conjunct, own, named, labels) if away else None

    def allows(self, agent: int, reservations: Reservations) -> Flags:
        """Allowed states of the agent beside the planned agents, (steps + 1, states), or one row for all steps.

        A state must be allowed one step before and after too: between two steps, no two agents exchange their
        positions.
        """
        now = self._holds(self.conjunct.formula, self.conjunct.agent, agent, reservations)
        before, after = np.concatenate([now[:1], now[:-1]]), np.concatenate([now[1:], now[-1:]])
        return np.asarray(now & before & after)

    def _holds(self, node: Node, who: int | None, agent: int, reservations: Reservations) -> Flags:
        if node in self.own and who is not None:
            if who == agent:
                return states_of(node, who, self.labels)[None, :]
            if who in reservations.agents:
                return np.asarray(states_of(node, who, self.labels)[reservations.states[who]])[:, None]
            return np.ones((1, 1), dtype=np.bool_)
        if isinstance(node, At):
            return self._holds(node.body, node.agent, agent, reservations)
        parts = [self._holds(part, who, agent, reservations) for part in children(node)]
        if isinstance(node, AtLeast):
            return np.asarray(sum(part.astype(np.int64) for part in parts) >= node.count)
        return reduce(np.logical_and if node.every else np.logical_or, parts)

    def among(self, present: frozenset[int]) -> Node | None:
        """Requirement on the present agents if all others avoid the states; None if nothing is required."""
        node, who = self.conjunct.formula, self.conjunct.agent
        asked = self._among(node, who, present)
        return asked if asked is None or who is None else At(who, asked, node.span)

    def _among(self, node: Node, who: int | None, present: frozenset[int]) -> Node | None:
        if node in self.own and who is not None:
            return node if who in present else None
        if isinstance(node, At):
            body = self._among(node.body, node.agent, present)
            return None if body is None else rebuilt(node, (body,))
        parts = [self._among(part, who, present) for part in children(node)]
        left = tuple(part for part in parts if part is not None)
        if isinstance(node, AtLeast):
            count = node.count - (len(parts) - len(left))
            return AtLeast(count, left, node.span) if count > 0 else None
        if isinstance(node, Any) and len(left) < len(parts):
            return None
        return rebuilt(node, left) if left else None


def _leaves(conjunct: Conjunct, own: frozenset[Node]) -> list[tuple[int, Node]]:
    """Agents and nodes about their own states; empty if the conjunct has other parts."""
    leaves: list[tuple[int, Node]] = []
    stack = [(conjunct.agent, conjunct.formula)]
    while stack:
        who, node = stack.pop()
        match node:
            case At(agent, body):
                stack.append((agent, body))
            case _ if node in own and who is not None:
                leaves.append((who, node))
            case All() | Any() | AtLeast():
                stack.extend((who, part) for part in node.parts)
            case _:
                return []
    return leaves


def may_be(exclusions: Sequence[Exclusion], agent: int, reservations: Reservations, may: Flags) -> Flags:
    """Allowed states of an agent, (steps + 1, states), within ``may``, for which all exclusions are satisfied."""
    bound = [each for each in exclusions if agent in each.named]
    if not bound:
        return may
    may = may.copy()
    for each in bound:
        may[each.conjunct.steps] &= np.broadcast_to(each.allows(agent, reservations), may.shape)[each.conjunct.steps]
    return may
