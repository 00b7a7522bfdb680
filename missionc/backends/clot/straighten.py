"""Straightening: a plan from a roadmap becomes a shorter, smoother plan in continuous space with more clearance.

    in   Mission, its kernel and a plan's trace
    out  another plan, with the same satisfied preferences and no longer paths; the same plan if none was found

The choices (part, step and link) by which the plan satisfies each requirement are fixed
(``goal_terms.Demand.witness``). With them, a descent reduces length and bend, local optimisation increases the
clearance if there is free space, and a second descent follows. Agents that then violate a condition return to their
previous trajectory. The effort is counted in steps, so that the result is deterministic.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from missionc.backends.acceptance import attempt
from missionc.backends.api import Attempt, Budget, Planned, Progress
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.cost_weights import METRES, STRAIGHT, spare, with_room
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.convex_descent import descend
from missionc.backends.clot.optimise.improve import as_many, duration, rested, travelled
from missionc.backends.clot.optimise.levenberg_marquardt import polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.own_state_stays import with_stays
from missionc.backends.clot.settings import Spare, clot_settings
from missionc.backends.run_account import Account
from missionc.base.signals import stop_requested
from missionc.base.trace import Array, Flags, Trace, then_polished
from missionc.geometry.dynamics import can_wait
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.monitor import monitor


def straighten(mission: Mission, kernel: Kernel, planned: Planned, budget: Budget) -> Planned:
    """Straightened plan if the result is a plan, otherwise the original plan, which is reported as an intermediate plan
    first."""
    if mission.steps < 2 or planned.report.cut_short or not attempt(mission, kernel, planned.trace).is_plan:
        return planned
    budget.on_incumbent(planned)
    account = Account()

    def in_time() -> bool:
        budget.on_progress(Progress("straighten"))
        return time.monotonic() < budget.deadline and not stop_requested()

    with account.stage("straighten"):
        straight = straightened(mission, kernel, planned.trace, in_time)
    if straight is not planned.trace:
        before, after = travelled(planned.trace), travelled(straight)
        account.notes.append(f"distance {after:.6g} m after straightening, {before:.6g} m on the roadmap")
    if not in_time():
        account.cut()
    report, more = planned.report, account.report()
    seconds, notes = (*report.seconds, *more.seconds), (*report.notes, *more.notes)
    solved = report.solved if straight is planned.trace else then_polished(report.solved, mission.names)
    return Planned(straight, replace(report, seconds=seconds, notes=notes, cut_short=more.cut_short, solved=solved))


def straightened(mission: Mission, kernel: Kernel, plan: Trace, go_on: Callable[[], bool] = lambda: True) -> Trace:
    """Trace after straightening, which satisfies as much as the plan with no longer paths; the plan's own trace if none
    is found."""
    return _Straightened(mission, kernel, plan, go_on).best


class _Straightened:
    def __init__(self, mission: Mission, kernel: Kernel, plan: Trace, go_on: Callable[[], bool]) -> None:
        self.mission, self.kernel, self.go_on = mission, kernel, go_on
        made = splines(mission)
        if mission.objective is Objective.DURATION:
            made = replace(made, rest=duration(plan))
        self.made, self.plan, self.best = made, plan, plan
        self.aim = METRES if mission.objective is Objective.DISTANCE else STRAIGHT
        self.control = start = made.at_rest(made.joined(plan.position, plan.velocity))
        self.demand = witnessed(mission, kernel, plan, *made.states(start))
        least = spare(mission)
        if not self.consider(self.descended(start, least)):
            self.consider_wider(least)
        self.consider_wider(with_room(mission, 0.0))
        self.stand(least)

    def steps(self, most: int) -> int:
        """Number of descent or optimisation steps for the size of the problem, at most ``most``."""
        return min(most, clot_settings(self.mission).shortening.straighten // max(1, self.control.size))

    def costs(self, room: Spare) -> Costs:
        return Costs(self.mission, self.made, self.aim.weights(clot_settings(self.mission).weights), room)

    def descended(self, start: Array, room: Spare) -> Array:
        """Control points with less length and bend, (agents, points, dim), metres, and no less clearance than
        ``start``."""
        aim = self.aim
        return descend(start, self.costs(room), self.demand, self.steps(aim.steps), aim.gain, aim.cuts, self.go_on)

    def consider_wider(self, room: Spare) -> None:
        """Optimise the plan for more clearance, and accept the result of a further descent if it is a better plan."""
        steps = self.steps(clot_settings(self.mission).shortening.straighten_polish)
        wider = polish(self.control, self.costs(room), self.demand, steps, self.go_on).control
        if (wider != self.control).any():
            self.consider(self.descended(wider, room))

    def accepted(self, tried: Array) -> Trace | None:
        """Trace of control points, (agents, points, dim), metres, if it is an equally good plan; None otherwise."""
        motion = trace(self.mission, self.made, tried)
        return motion if attempt(self.mission, self.kernel, motion).is_plan and self.no_worse(motion) else None

    def stand(self, room: Spare) -> None:
        """Keep agents at rest that need not move, if the plan stays as good."""
        costs, accept = self.costs(room), self.accepted
        self.control, self.best = rested(self.control, self.best, self.kernel, costs, self.demand, accept, self.go_on)

    def consider(self, tried: Array) -> bool:
        """Accept a candidate, (agents, points, dim), metres, with violating agents on their current trajectories;
        return true if no agent was violating."""
        whole = True
        for _ in range(clot_settings(self.mission).shortening.restores):
            tried = self.calmed(tried)
            if not (tried != self.control).any():
                break
            motion = trace(self.mission, self.made, tried)
            come_to = attempt(self.mission, self.kernel, motion)
            if come_to.is_plan:
                if self.no_worse(motion):
                    self.control, self.best = tried, motion
                return whole
            whole = False
            tried = np.where(violating(self.mission, come_to)[:, None, None], self.control, tried)
        return False

    def calmed(self, control: Array) -> Array:
        """Control points, (agents, points, dim), metres, with tiny movements replaced by waiting."""
        still = 1e-3  # share of its longest step, below which an agent that can wait is at rest
        calm = control.copy()
        for agent in self.mission.agents:
            if agent.dynamics.has_momentum or not can_wait(agent.dynamics):
                continue
            least = still * agent.dynamics.top_speed * self.mission.step
            fixed, points = self.made.fixed[agent.index], calm[agent.index]
            for step in range(1, self.mission.steps + 1):
                if not fixed[step] and np.linalg.norm(points[step] - points[step - 1]) < least:
                    points[step] = points[step - 1]
        return calm

    def no_worse(self, motion: Trace) -> bool:
        """Return true if a plan satisfies all preferences that the best plan satisfies, and is not longer by any
        objective."""
        before = self.best
        return (
            travelled(motion)
            <= min(travelled(self.plan), travelled(before) * (1 + clot_settings(self.mission).shortening.longer))
            and (self.mission.objective is not Objective.DURATION or duration(motion) <= duration(before))
            and as_many(self.mission, self.kernel, before, motion)
        )


def violating(mission: Mission, come_to: Attempt) -> Flags:
    """Return true for each agent that violates a constraint or requirement, (agents,)."""
    names = {name for fault in come_to.faults for name in fault.agents}
    names |= {name for judged in come_to.violated for name in judged.agents}
    return np.array([agent.name in names for agent in mission.agents])


def witnessed(mission: Mission, kernel: Kernel, plan: Trace, position: Array, velocity: Array) -> Demand:
    """Demand on motions near a plan: its requirements and satisfied preferences, in the way in which it satisfies them.

    Args:
        position: positions of the plan, (agents, steps, dim), metres; ``velocity`` in m/s.
    """
    graph = build(kernel)
    kept = {each.name for each in monitor(mission, kernel, plan).preferences if each.satisfied}
    goals = (*graph.requirements, *(each for each in graph.preferences if each.name in kept))
    roots = tuple(each.formula for each in goals)
    choices = Demand.of(mission, roots, {}, mission.steps).witness(position, velocity)
    return with_stays(Demand.of(mission, roots, choices, mission.steps), position, velocity)
