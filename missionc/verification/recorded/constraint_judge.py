"""Constraints of a recorded flight: margins at steps and between samples, on a trace or on live states.

    in   Mission, a Trace or States
    out  Constraint: the smallest margin of each kind, or every violated one; NotJudged

The verifier checks the same constraints on plans, with the same margins. A live flight is evaluated at each step when
the step is settled.

Speeds are those of straight moves from one step to the next. Accelerations and turning rates are differences of these
moves, unless velocities or headings are recorded. In continuous time, a recorded agent moves straight between samples,
including those between the steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.base.constraint import Constraint, NotJudged
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Trace, counted, decimals
from missionc.geometry.curves.piecewise_polynomials import Curves, motion
from missionc.geometry.vectors import norm
from missionc.ir import PLAIN, Agent, InitialSet, Mission
from missionc.verification.certificate import CERTAIN, MOTION
from missionc.verification.monitoring.live.samples import Sample, StepState
from missionc.verification.monitoring.read_trace import ON_TIME, State
from missionc.verification.plan.clearances import needs, state_margins
from missionc.verification.plan.lanes_kept import lane_margins, segments
from missionc.verification.plan.obstacle_bodies import solid
from missionc.verification.plan.starts_and_finishes import check_place
from missionc.verification.plan.step_dynamics import facing_errors, mean_rates, turned
from missionc.verification.recorded.between_margins import (
    Margins,
    Room,
    Tolerance,
    as_flown,
    between_margins,
    separation_margins,
)

STILL = 1e-9
"""Speed, m/s, below which an agent has no direction of motion."""


class States(Record, eq=False):
    """States of the team at consecutive steps.

    Args:
        first: step of the first state.
        position, velocity: (agents, states, dim), metres and m/s.
        heading: (agents, states), rad.
        doubt: (agents, states), metres: maximum distance of an agent from there; 0 if its state is known.
        with_velocity, with_heading: (agents,): True if they are recorded.
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
        """Positions, velocities, headings and position uncertainties.

        Shape: (agents, states, dim), metres and m/s, and (agents, states).
        """
        return self.position, self.velocity, self.heading, self.doubt

    def after(self, before: States) -> States:
        """These states preceded by the last two states of ``before``."""
        first = before.doubt.shape[1] - 2
        position, velocity, heading, doubt = (
            np.concatenate([old[:, first:], new], axis=1) for old, new in zip(before.arrays, self.arrays, strict=True)
        )
        return States(self.first - 2, position, velocity, heading, doubt, self.with_velocity, self.with_heading)


class StateMargins:
    """Computes the margins of a mission's constraints from consecutive states."""

    def __init__(self, mission: Mission, flown: Mission, tolerance: Tolerance) -> None:
        """Prepare the constraints of one mission.

        Args:
            flown: the mission ``as_flown``, for the separation.
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
        """Yield the margins of all constraints at the steps of these states, which follow the previous states."""
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

    def place_margin(self, agent: Agent, name: str, place: InitialSet, position: Array) -> tuple[float, float]:
        """Margin of an agent's position, (dim,), in its start or finish region, and the tolerance of the margin;
        metres.
        """
        check = check_place(agent, name, place, position, 0.0)
        return check.margin, check.tolerance + self.tolerance.position + agent.vehicle.tracking

    def _times(self, states: States) -> Array:
        return float(self.mission.step) * np.arange(states.first, states.first + states.position.shape[1])

    # ------------------------------------------------------ states in sequence

    def _of_motion(self, states: States) -> Iterator[Margins]:
        """Yield the margins of speeds, accelerations and turns, each at the later step of its difference."""
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
        """Turns between known headings: their tolerances, margins and validity, (agents, states) each, rad.

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
    """Margins that account for position uncertainty.

    Args:
        doubt: uncertainty, (subjects, moments), metres.
    """
    if not doubt.any():
        return margins
    most = margins.margin + doubt
    sure = (doubt == 0) | (most < -np.asarray(margins.tolerance))
    return replace(margins, margin=np.where(sure, most, np.inf), lower=margins.margin - doubt)


def recorded_motion(mission: Mission, trace: Trace, states: Iterable[State]) -> Curves:
    """Trajectories through the recorded samples of all agents.

    Agents move straight between samples. With recorded velocities and samples only at the steps, as in a plan, they
    move as their dynamics determine (``motion``).

    Args:
        trace: states at the steps, which the trajectories pass through.
        states: all samples, of every agent from the first to the last step.
    """
    last = float(mission.step * mission.steps)
    own: dict[str, list[State]] = {agent.name: [] for agent in mission.agents}
    for state in sorted(states, key=lambda state: state.time):
        own[state.agent].append(state)
    steps = mission.step * np.arange(mission.steps + 1)
    seen = np.unique([state.time for samples in own.values() for state in samples])
    between = seen[(seen > 0) & (seen < last)]
    between = between[np.abs(between - steps[np.rint(between / mission.step).astype(int)]) > ON_TIME]
    recorded = "velocity" not in trace.derived
    if mission.steps == 0 or (recorded and not between.size):
        return motion(mission, trace)
    apart = np.diff(between, prepend=-np.inf) > ON_TIME
    moments = np.sort(np.concatenate([steps, between[apart]]))
    places = np.stack([_places(samples, moments, "xyz"[: mission.dimension]) for samples in own.values()])
    places[:, np.searchsorted(moments, steps)] = trace.position
    slopes = np.diff(places, axis=1) / np.diff(moments)[:, None]
    return Curves(moments, np.stack([places[:, :-1], slopes], axis=-1))


def _places(samples: list[State], moments: np.ndarray, axes: str) -> np.ndarray:
    """Interpolated positions of an agent at times (moments,), seconds: (moments, dim), metres."""
    times = [state.time for state in samples]
    return np.stack([np.interp(moments, times, [state.numbers[axis] for state in samples]) for axis in axes], axis=-1)


KINDS = (
    "world, fence, height, clearance, separation, speed, lowest speed, sideways speed, vertical speed, acceleration, "
    "turn, heading, lane, finish"
)
"""Names of all constraints in the order of reports; a name listed alone precedes its combinations."""

UNSEEN = (
    (("acceleration", "jerk", "tilt", "thrust", "yaw_rate", "endurance"), "positions at the samples do not show it"),
    (("vertical_speed", "height", "downwash_height"), "a two-dimensional recording has no heights"),
)
"""Limits of vehicles that a recording cannot verify, with the reasons; the last entry applies to plane missions only.
"""

Places: TypeAlias = Callable[[list[int], float], Array]
"""Function from agents (mission indices) and a time in seconds to their positions, (agents, dim), metres."""


def judge_constraints(
    mission: Mission, trace: Trace, *, between: Curves | None = None, tolerance: float = 0.0
) -> tuple[tuple[Constraint, ...], tuple[NotJudged, ...]]:
    """Verdicts on the constraints of a mission for a trace of the mission's length, and the constraints that it cannot
    decide.

    Args:
        between: continuous-time trajectories, to be checked between the steps too.
        tolerance: error of recorded positions, metres.
    """
    judge = ConstraintJudge(mission, tolerance)
    agents, count, _ = trace.position.shape
    recorded = (np.full(agents, name not in trace.derived) for name in ("velocity", "heading"))
    judge.take(States(0, trace.position, trace.velocity, trace.heading, np.zeros((agents, count)), *recorded))
    if between is not None and count > 1:
        judge.take_between(between)
    return judge.constraints(), judge.not_judged()


class ConstraintJudge:
    """Evaluates one mission's constraints on consecutive states."""

    def __init__(self, mission: Mission, tolerance: float = 0.0) -> None:
        self.mission, self.flown = mission, as_flown(mission)
        self.tolerance = Tolerance.of(self.flown, tolerance)
        self.margins = StateMargins(mission, self.flown, self.tolerance)
        self.tightest: dict[str, tuple[float, Constraint]] = {}
        self.violated: dict[tuple[str, ...], Constraint] = {}
        self.undecided: dict[str, Constraint] = {}
        self.missing: dict[int, int] = {}
        self.elsewhere: dict[str, float] = {}
        """Distance in metres from the start, for each agent that does not begin at its start."""
        self.with_heading: Flags = np.ones(len(mission.agents), dtype=np.bool_)

    def take(self, states: States) -> list[Constraint]:
        """Process the next states; return the constraints that are violated for the first time."""
        self.with_heading &= states.with_heading
        for agent in np.flatnonzero((states.doubt > 0).any(axis=1)).tolist():
            self.missing[agent] = self.missing.get(agent, 0) + int((states.doubt[agent] > 0).sum())

        for each in self.mission.agents if states.first == 0 else ():
            margin, allowed = self.margins.place_margin(each, "start", each.start, states.position[each.index, 0])
            if margin + allowed < 0 and not states.doubt[each.index, 0]:
                self.elsewhere[each.name] = -margin

        def places(agents: list[int], time: float) -> Array:
            return states.position[agents, round(time / self.mission.step) - states.first]

        return self._fold(self.margins.take(states), places)

    def take_between(self, curves: Curves) -> list[Constraint]:
        """Process the trajectories between the states; return the constraints that are violated for the first time."""
        found = between_margins(self.flown, self.margins.rooms, curves, self.tolerance)
        return self._fold(found, lambda agents, time: curves.at(np.array([time]))[agents, 0])

    def constraints(self) -> tuple[Constraint, ...]:
        """Verdicts on the processed states: all violated constraints, and the smallest margin of each other kind."""
        failed = sorted(self.violated.values(), key=lambda each: (each.since or 0.0, each.agents))
        names = {each.name for each in failed}
        others = {name: each for name, (_, each) in self.tightest.items()} | self.undecided
        kept = [each for name, each in others.items() if name not in names]
        return tuple(sorted((*failed, *kept), key=lambda each: KINDS.index(each.name)))

    def not_judged(self) -> tuple[NotJudged, ...]:
        """Constraints that cannot be evaluated from these states, or from states at the steps."""
        return tuple(self._not_judged())

    def _fold(self, found: Iterable[Margins], places: Places) -> list[Constraint]:
        fresh: dict[tuple[str, ...], None] = {}
        for each in found:
            slack, time = each.margin + each.tolerance, np.broadcast_to(each.time, each.margin.shape)
            subject, moment = np.unravel_index(int(slack.argmin()), slack.shape)
            least = float(slack[subject, moment])
            if np.isfinite(least) and least < self.tightest.get(each.name, (np.inf,))[0]:
                self.tightest[each.name] = least, self._constraint(each, int(subject), int(moment), places)
            failed = np.asarray((slack < 0).any(axis=1))
            for row in np.flatnonzero(failed).tolist():
                worst = self._constraint(each, row, int(slack[row].argmin()), places)
                key = (worst.name, *worst.agents, worst.obstacle)
                before = self.violated.get(key)
                since = float(time[row][slack[row] < 0].min())
                if before is None:
                    fresh[key] = None
                elif before.margin + before.tolerance <= worst.margin + worst.tolerance:
                    worst = before
                if before is not None and before.since is not None:
                    since = min(since, before.since)
                self.violated[key] = replace(worst, satisfied=False, since=since)
            if each.lower is not None and each.name not in self.undecided:
                unproven = np.argwhere((each.lower + each.tolerance < -CERTAIN) & ~failed[:, None])
                for row, column in unproven[:1].tolist():
                    found_open = self._constraint(replace(each, margin=each.lower), row, column, places)
                    self.undecided[each.name] = replace(found_open, satisfied=None)
        return [self.violated[key] for key in fresh]

    def _constraint(self, margins: Margins, subject: int, moment: int, places: Places) -> Constraint:
        step = float(self.mission.step)
        time = float(np.broadcast_to(margins.time, margins.margin.shape)[subject, moment])
        agents = margins.agents[subject].tolist()
        return Constraint(
            margins.name,
            True,
            float(margins.margin[subject, moment]),
            margins.unit,
            float(np.broadcast_to(margins.tolerance, margins.margin.shape)[subject, moment]),
            time,
            int(np.floor(time / step + 1e-9)),
            tuple(self.mission.agents[agent].name for agent in agents),
            tuple(tuple(place) for place in places(agents, time).tolist()),
            margins.obstacle,
        )

    def _not_judged(self) -> Iterable[NotJudged]:
        agents = self.mission.agents
        bare = [each for each in agents if each.dynamics.faces_ahead and not self.with_heading[each.index]]
        yield from self._unseen(["heading"], bare, "the recording has no `yaw`")
        for kind in dict.fromkeys(type(each.dynamics) for each in agents if each.dynamics.rules):
            moved = [each for each in agents if type(each.dynamics) is kind]
            yield from self._unseen([*kind.rules], moved, f"a rule of `{kind.word}`, which is checked for plans only")
        for names, reason in UNSEEN if self.mission.dimension == 2 else UNSEEN[:1]:
            limited = {
                name: [each for each in agents if getattr(each.vehicle, name) != getattr(PLAIN, name)] for name in names
            }
            some = [name.replace("_", " ") for name in names if limited[name]]
            yield from self._unseen(
                some, [each for each in agents if any(each in own for own in limited.values())], reason
            )
        if self.elsewhere:
            how_far = f"the flight begins up to {decimals(max(self.elsewhere.values()))} m from it"
            yield from self._unseen(["start"], [each for each in agents if each.name in self.elsewhere], how_far)
        for agent, steps in self.missing.items():
            yield from self._unseen(["motion"], [agents[agent]], f"missing at {counted(steps, 'step')}")

    def _unseen(self, names: list[str], agents: list[Agent], reason: str) -> Iterable[NotJudged]:
        everyone = len(agents) == len(self.mission.agents)
        if agents:
            yield NotJudged(tuple(names), () if everyone else tuple(each.name for each in agents), reason)


class LiveConstraints(ConstraintJudge):
    """Online evaluation of one mission's constraints in flight; work and memory do not grow with the flight's length.

    A velocity or heading of an agent counts as recorded if every sample so far has one.
    """

    def __init__(self, mission: Mission, tolerance: float = 0.0) -> None:
        super().__init__(mission, tolerance)
        self.recorded = np.ones((2, len(mission.agents)), dtype=np.bool_)

    def hear(self, sample: Sample) -> None:
        """Register whether a sample records a velocity and a heading."""
        self.recorded[:, sample.agent] &= bool(sample.velocity), not math.isnan(sample.heading)

    def judge_step(self, state: StepState) -> list[Constraint]:
        """Evaluate a step; return the constraints that are violated for the first time."""
        arrays = (state.position, state.velocity, state.heading, state.doubt)
        position, velocity, heading, doubt = (each[:, None] for each in arrays)
        return self.take(States(state.step, position, velocity, heading, doubt, *self.recorded))
