"""Constraints of a recorded flight: judged on a whole trace, or on states as they come.

    in   Mission, a Trace or States
    out  Constraint: of each kind the tightest, or every violated one; NotJudged

Nothing is judged here that the verifier does not judge of plans, with the same margins. A flight that goes on is judged
at each step when it is settled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from missionc.base.constraint import Constraint, NotJudged
from missionc.base.figures import counted, decimals
from missionc.base.trace import Array, Flags, Trace
from missionc.curves.piecewise_polynomials import Curves
from missionc.ir import PLAIN, Agent, Mission
from missionc.monitoring.live.samples import Sample, StepState
from missionc.verify.recorded.between_margins import between_margins
from missionc.verify.recorded.margins import Margins, Tolerance, as_flown
from missionc.verify.recorded.state_margins import StateMargins, States
from missionc.verify.tolerances import CERTAIN

KINDS = (
    "world, fence, height, clearance, separation, speed, lowest speed, sideways speed, vertical speed, acceleration, "
    "turn, heading, lane, finish"
)
"""All constraints, in the order in which they are reported; each name stands first where it stands alone."""

UNSEEN = (
    (("acceleration", "jerk", "tilt", "thrust", "yaw_rate", "endurance"), "positions at the steps do not show it"),
    (("vertical_speed", "height", "downwash_height"), "heights are not recorded in a plane"),
)
"""Figures of vehicles that are not judged, and why; the last ones in a plane alone."""

Places: TypeAlias = Callable[[list[int], float], Array]
"""Positions of agents at a time: mission indices, seconds -> (agents, dim), metres."""


def judge_constraints(
    mission: Mission, trace: Trace, *, between: Curves | None = None, tolerance: float = 0.0
) -> tuple[tuple[Constraint, ...], tuple[NotJudged, ...]]:
    """Judge a trace of the mission's length.

    Args:
        between: the motion in continuous time, to be judged between the steps too.
        tolerance: how far a recorded position may be from the true one, metres.
    """
    judge = ConstraintJudge(mission, tolerance)
    agents, count, _ = trace.position.shape
    recorded = (np.full(agents, name not in trace.derived) for name in ("velocity", "heading"))
    judge.take(States(0, trace.position, trace.velocity, trace.heading, np.zeros((agents, count)), *recorded))
    if between is not None and count > 1:
        judge.take_between(between)
    return judge.constraints(), judge.not_judged()


class ConstraintJudge:
    """The constraints of one mission, from states that come one after the other."""

    def __init__(self, mission: Mission, tolerance: float = 0.0) -> None:
        self.mission, self.flown = mission, as_flown(mission)
        self.tolerance = Tolerance.of(self.flown, tolerance)
        self.margins = StateMargins(mission, self.flown, self.tolerance)
        self.tightest: dict[str, tuple[float, Constraint]] = {}
        self.violated: dict[tuple[str, ...], Constraint] = {}
        self.undecided: dict[str, Constraint] = {}
        self.missing: dict[int, int] = {}
        self.elsewhere: dict[str, float] = {}
        """Agents that do not begin at their starts, and how far from them they do, metres."""
        self.with_heading: Flags = np.ones(len(mission.agents), dtype=np.bool_)

    def take(self, states: States) -> list[Constraint]:
        """Take in the next states; return the constraints that are violated for the first time."""
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
        """Take in the motion between the states."""
        found = between_margins(self.flown, self.margins.rooms, curves, self.tolerance)
        return self._fold(found, lambda agents, time: curves.at(np.array([time]))[agents, 0])

    def constraints(self) -> tuple[Constraint, ...]:
        """The verdicts on what was taken in: the tightest of each kind, or all violated ones."""
        failed = sorted(self.violated.values(), key=lambda each: (each.since or 0.0, each.agents))
        names = {each.name for each in failed}
        others = {name: each for name, (_, each) in self.tightest.items()} | self.undecided
        kept = [each for name, each in others.items() if name not in names]
        return tuple(sorted((*failed, *kept), key=lambda each: KINDS.index(each.name)))

    def not_judged(self) -> tuple[NotJudged, ...]:
        """The constraints that states at the steps, or these states, do not show."""
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
        yield from self._unseen(["heading"], bare, "no `yaw` is recorded")
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
    """The constraints of one mission while it is flown; work and memory do not grow with its length.

    A velocity or heading of an agent counts as recorded as long as every sample of it has one.
    """

    def __init__(self, mission: Mission, tolerance: float = 0.0) -> None:
        super().__init__(mission, tolerance)
        self.recorded = np.ones((2, len(mission.agents)), dtype=np.bool_)

    def hear(self, sample: Sample) -> None:
        """Take note of what a sample records."""
        self.recorded[:, sample.agent] &= bool(sample.velocity), not math.isnan(sample.heading)

    def judge_step(self, state: StepState) -> list[Constraint]:
        """Judge a step; return the constraints that are violated for the first time."""
        arrays = (state.position, state.velocity, state.heading, state.doubt)
        position, velocity, heading, doubt = (each[:, None] for each in arrays)
        return self.take(States(state.step, position, velocity, heading, doubt, *self.recorded))
