"""Margins of all constraints at the steps, from the team's states as a trace or a stream has them.

    in   States: one after the other, or all at once
    out  Margins

Speeds are those of straight moves from one step to the next. Accelerations and turning rates are differences of these
moves, unless velocities or headings are recorded.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Array, Flags
from missionc.curves.piecewise_polynomials import Curves
from missionc.ir import Agent, Mission, Place
from missionc.verify.plan.lanes_kept import lane_margins, segments
from missionc.verify.plan.obstacle_bodies import solid
from missionc.verify.plan.obstacle_clearance import needs, state_margins
from missionc.verify.plan.starts_and_finishes import check_place
from missionc.verify.plan.step_dynamics import facing_errors, mean_rates, turned
from missionc.verify.recorded.between_margins import separation_margins
from missionc.verify.recorded.margins import Margins, Room, Tolerance
from missionc.verify.tolerances import MOTION
from missionc.world.vectors import norm

STILL = 1e-9
"""m/s: an agent that moves no faster has no direction."""


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """The team's states at consecutive steps.

    Args:
        first: the step of the first state.
        position: (agents, states, dim), metres; ``velocity`` likewise, m/s.
        heading: (agents, states), rad.
        doubt: (agents, states), metres: how far an agent may be from there; 0 if its state is known.
        with_velocity, with_heading: (agents,): the agents that have them recorded.
    """

    first: int
    position: Array
    velocity: Array
    heading: Array
    doubt: Array
    with_velocity: Flags
    with_heading: Flags

    @property
    def arrays(self) -> tuple[Array, Array, Array, Array]:
        """The arrays of the states, in the order of the fields."""
        return self.position, self.velocity, self.heading, self.doubt

    def after(self, before: States) -> States:
        """These states, and the two before them."""
        first = before.doubt.shape[1] - 2
        position, velocity, heading, doubt = (
            np.concatenate([old[:, first:], new], axis=1) for old, new in zip(before.arrays, self.arrays, strict=True)
        )
        return States(self.first - 2, position, velocity, heading, doubt, self.with_velocity, self.with_heading)


class StateMargins:
    """The margins of a mission's constraints, from states that come one after the other."""

    def __init__(self, mission: Mission, flown: Mission, tolerance: Tolerance) -> None:
        """
        Args:
            flown: the mission ``as_flown``, of which the separation is judged.
        """
        self.mission, self.flown, self.tolerance = mission, flown, tolerance
        self.rooms = Room.all_of(mission)
        self.everyone = np.arange(len(mission.agents))[:, None]
        self.distances = [solid(obstacle.shape, mission.dimension) for obstacle in mission.obstacles]
        self.needs = needs(mission)
        lanes, step = mission.solve.roadmap, float(mission.step)
        self.lanes = [] if lanes is None else [segments(agent, lanes, step) for agent in mission.agents]
        dynamics, vehicles = [each.dynamics for each in mission.agents], [each.vehicle for each in mission.agents]
        self.fastest = np.array([[each.top_speed] for each in dynamics])
        self.slowest = np.array([[each.lowest_speed or -np.inf] for each in dynamics])
        self.acceleration = np.array([[each.top_acceleration] for each in dynamics])
        self.turn = np.array([[each.top_turn] for each in dynamics])
        self.momentum = np.array([[each.has_momentum] for each in dynamics])
        self.faces_ahead = np.array([[each.faces_ahead] for each in dynamics])
        self.sideways = np.array([[each.speed] for each in vehicles])
        self.vertical = np.array([[each.vertical_speed] for each in vehicles])
        unknown = np.zeros((len(self.everyone), 2))
        place, none = np.zeros((*unknown.shape, mission.dimension)), np.zeros(len(self.everyone), dtype=np.bool_)
        self.before = States(-2, place, place, unknown, unknown + np.inf, none, none)
        self.turned: list[NDArray[Any]] = [none[:, None], unknown[:, :1], unknown[:, :1], unknown[:, :1]]

    def take(self, states: States) -> Iterator[Margins]:
        """The margins at the steps of these states, which follow those before."""
        yield from self._of_places(states)
        yield from self._of_motion(states)

    # -------------------------------------------------------------- one state

    def _of_places(self, states: States) -> Iterator[Margins]:
        mission, tolerance, doubt = self.mission, self.tolerance, states.doubt
        times = self._times(states)

        def found(name: str, margin: Array, obstacle: str = "") -> Margins:
            agents = self.everyone
            return _doubted(Margins(name, "m", tolerance.contact, agents, margin, times, obstacle), doubt)

        for room in self.rooms:
            low, high = room.low[:, None], room.high[:, None]
            yield found(room.name, np.minimum(states.position - low, high - states.position).min(axis=-1))
        for obstacle, distance in zip(mission.obstacles, self.distances, strict=True):
            margin = state_margins(obstacle, distance, self.needs, times, states.position)
            yield found("clearance", margin, obstacle.name)
        still = np.stack([states.position, np.zeros_like(states.position)], axis=-1)
        held = Curves(np.append(times, times[-1] + float(mission.step)), still)
        spares = (None, float(2 * doubt.max())) if doubt.any() else (None,)
        for spare in spares:
            for each in separation_margins(self.flown, held, tolerance, spare):
                column = np.searchsorted(times, each.time[0, 0])
                yield _doubted(each, doubt[each.agents, column].sum(axis=1, keepdims=True))
        column = int(mission.steps) - states.first
        for agent in mission.agents if 0 <= column < len(times) else ():
            if agent.finish is not None:
                one, time = np.array([[agent.index]]), times[column : column + 1]
                depth, allowed = self.place_margin(agent, "finish", agent.finish, states.position[agent.index, column])
                yield _doubted(Margins("finish", "m", allowed, one, np.array([[depth]]), time), doubt[one, column])

    def place_margin(self, agent: Agent, name: str, place: Place, position: Array) -> tuple[float, float]:
        """How far an agent is inside its start or finish, and the tolerance of that; metres."""
        check = check_place(agent, name, place, position, 0.0)
        return check.margin, check.tolerance + self.tolerance.position + agent.vehicle.tracking

    def _times(self, states: States) -> Array:
        return float(self.mission.step) * np.arange(states.first, states.first + states.position.shape[1])

    # ------------------------------------------------------ states in sequence

    def _of_motion(self, states: States) -> Iterator[Margins]:
        """Each at the later step of what it is the difference of."""
        step, count, tolerance = float(self.mission.step), states.position.shape[1], self.tolerance
        whole = self.before = states.after(self.before)
        known = whole.doubt == 0
        moved = known[:, 1:] & known[:, :-1]
        moves, recorded = np.diff(whole.position, axis=1), states.with_velocity[:, None]
        mean, flown = mean_rates(whole.position, step), mean_rates(whole.velocity, step)
        differences = mean_rates(moves / step, step)
        of_moves = moved[:, 1:] & moved[:, :-1] & ~recorded
        speed, push = tolerance.speed, tolerance.acceleration

        def found(name: str, unit: str, allowed: float | Array, margin: Array, known: Flags) -> Iterator[Margins]:
            margin = np.where(known, margin, np.inf)[:, -count:]
            if np.isfinite(margin).any():
                yield Margins(name, unit, allowed, self.everyone, margin, self._times(states))

        yield from found("speed", "m/s", speed, self.fastest - mean, moved)
        yield from found("speed", "m/s", speed, self.fastest - norm(whole.velocity), known & recorded & self.momentum)
        yield from found("lowest speed", "m/s", speed, mean - self.slowest, moved)
        yield from found("acceleration", "m/s^2", push, self.acceleration - flown, moved & recorded)
        yield from found("acceleration", "m/s^2", push, self.acceleration - differences, of_moves)
        flat = mean_rates(whole.position[..., :2], step)
        yield from found("sideways speed", "m/s", speed, self.sideways - flat, moved)
        if self.mission.dimension == 3:
            climb = np.abs(moves[..., 2]) / step
            yield from found("vertical speed", "m/s", speed, self.vertical - climb, moved)
        if self.faces_ahead.any():
            faces = moved & states.with_heading[:, None] & self.faces_ahead
            error = facing_errors(whole.position, whole.heading[:, :-1])
            yield from found("heading", "m", 2 * tolerance.move, -error, faces)
            yield from found("turn", "rad", *self._turns(states, moves[:, -count:], moved[:, -count:]))
        for agent, along in enumerate(self.lanes):
            margin = np.full(moved.shape, np.inf)
            margin[agent] = lane_margins(along, whole.position[agent])
            yield from found("lane", "m", tolerance.move, margin, moved)

    def _turns(self, states: States, moves: Array, moved: Flags) -> tuple[Array, Array, Flags]:
        """From each known heading to the next one: tolerance, margin, and where there is one; (agents, states) each.

        The heading is the direction of the move that ends at a step, unless headings are recorded.
        """
        step, recorded = float(self.mission.step), states.with_heading[:, None]
        length, ahead = norm(moves[..., :2]), np.arctan2(moves[..., 1], moves[..., 0])
        steps = np.arange(states.first, states.first + moves.shape[1], dtype=np.float64)
        fresh = (
            np.where(recorded, states.doubt == 0, moved & (length > STILL * step)),
            np.where(recorded, states.heading, ahead),
            np.broadcast_to(steps, length.shape),
            np.where(recorded, 0.0, self.tolerance.direction(length)),
        )
        parts = [np.concatenate(pair, axis=1) for pair in zip(self.turned, fresh, strict=True)]
        last = np.maximum.accumulate(np.where(parts[0], np.arange(1 + moves.shape[1]), 0), axis=1)
        before = [part[self.everyone, last[:, :-1]] for part in parts]
        known, heading, since, doubt = (part[:, 1:] for part in parts)
        self.turned = [part[self.everyone, last[:, -1:]] for part in parts]
        both = known & before[0] & np.isfinite(self.turn)
        allowed = np.where(both, self.turn, 0.0) * step * (since - before[2])
        return MOTION + doubt + before[3], allowed - turned(heading - before[1]), both


def _doubted(margins: Margins, doubt: Array) -> Margins:
    """Margins of agents that may be so far from where they are taken to be: (subjects, moments), metres."""
    if not doubt.any():
        return margins
    most = margins.margin + doubt
    sure = (doubt == 0) | (most < -np.asarray(margins.tolerance))
    return replace(margins, margin=np.where(sure, most, np.inf), lower=margins.margin - doubt)
