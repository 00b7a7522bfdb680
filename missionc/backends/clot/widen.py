"""Widening: a plan of any engine becomes one with wider normalised margins that is little longer.

    in   Mission, its kernel, a plan's trace, and work units
    out  another plan with wider margins; the same plan if none was found

The alternatives that satisfy each requirement in the plan are fixed (``goal_terms.Demand.witness``). Under them, the
plan is polished towards a share of the natural scale of each margin, and descended again under the wider margins.
Agents that then violate a condition return to their previous motion. The shares are bisected: a smaller one after a
candidate that is no wider or too long, and a larger one after a wider plan with margins still below the target.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from missionc.backends.acceptance import attempt
from missionc.backends.api import Budget, Planned, Progress
from missionc.backends.clot.cost_weights import AIMS, WIDE, spare, with_room
from missionc.backends.clot.optimise.control_points import splines, trace
from missionc.backends.clot.optimise.convex_descent import descend
from missionc.backends.clot.optimise.improve import MEASURES, as_many, duration, margins_of, rested, travelled
from missionc.backends.clot.optimise.levenberg_marquardt import polish
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.settings import clot_settings
from missionc.backends.clot.straighten import violating, witnessed
from missionc.backends.run_account import Account, polish_work
from missionc.base.signals import stop_requested
from missionc.base.trace import Array, Trace, then_polished
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel


def widen(mission: Mission, kernel: Kernel, planned: Planned, budget: Budget) -> Planned:
    """Widen the margins of a plan within the work of the budget; the same plan if none with wider margins is found.

    A plan of a similar kernel is widened too, if it becomes a plan of this one.
    """
    account = Account()

    def in_time() -> bool:
        budget.on_progress(Progress("margins"))
        return time.monotonic() < budget.deadline and not stop_requested()

    if mission.steps < 2:
        return planned
    with account.stage("margins"):
        widening = _Widening(mission, kernel, planned.trace, budget.work, in_time)
        widening.search()
    report, changed = planned.report, widening.best is not planned.trace
    if not in_time():
        account.cut()
    return Planned(
        widening.best,
        replace(
            report,
            seconds=(*report.seconds, *account.report().seconds),
            work=report.work + widening.done,
            cut_short=report.cut_short or account.cut_short,
            solved=then_polished(report.solved, mission.names) if changed else report.solved,
        ),
    )


class _Widening:
    def __init__(self, mission: Mission, kernel: Kernel, plan: Trace, work: float, go_on: Callable[[], bool]) -> None:
        self.mission, self.kernel, self.plan, self.best = mission, kernel, plan, plan
        self.work, self.done, self.go_on = work, 0.0, go_on
        made = splines(mission)
        if mission.objective is Objective.DURATION:
            made = replace(made, rest=duration(plan))
        self.control = made.at_rest(made.joined(plan.position, plan.velocity))
        self.demand = witnessed(mission, kernel, plan, *made.states(self.control))
        self.aim = AIMS.get(mission.objective, (WIDE,))[-1]
        self.settings = clot_settings(mission)
        self.costs = Costs(mission, made, self.settings.weights, spare(mission))
        self.measure = MEASURES.get(mission.objective, travelled)

    def search(self) -> None:
        """Bisect the share of the wanted margins."""
        limits = self.settings.shortening
        margins = margins_of(self.kernel, self.costs, self.control, self.plan)
        share, least, most = 1.0, 0.0, 1.0
        for _ in range(limits.wide_tries):
            if margins.wide or self.done >= self.work or not self.go_on():
                break
            found = self.candidate(share)
            wider = margins if found is None else margins_of(self.kernel, self.costs, *found)
            stuck, reached = wider.least <= margins.least, wider.least >= share * limits.margin / 2
            if found is not None and wider.wider(margins, limits.wider):
                self.control, self.best = found
                margins = wider
                if stuck or (reached and share == most):
                    break
                least = share if reached else least
            else:
                reached = False
            most = most if reached else share
            share = (least + most) / 2
        if self.best is not self.plan and self.go_on():
            costs = replace(self.costs, spare=with_room(self.mission, share))
            self.control, self.best = rested(
                self.control, self.best, self.kernel, costs, self.demand, self.accepted, self.go_on
            )

    def candidate(self, share: float) -> tuple[Array, Trace] | None:
        """Control points, (agents, points, dim), metres, and motion of a plan with a share of the wanted margins."""
        limits, aim = self.settings.shortening, self.aim
        most, roomy = self.iterations(limits.iterations), replace(self.costs, spare=with_room(self.mission, share))
        polished = polish(self.control, roomy, self.demand, most, self.go_on)
        self.done += polish_work(self.mission, polished.iterations)
        if not (polished.control != self.control).any():
            return None
        # A descent may use half of a target, so that this target keeps the margin.
        kept = with_room(self.mission, 2 * share * limits.margin / limits.wide)
        costs = replace(self.costs, spare=kept, weights=aim.weights(self.settings.weights))
        tried = descend(polished.control, costs, self.demand, aim.steps, aim.gain, aim.cuts, self.descends)
        for _ in range(limits.restores):
            motion = trace(self.mission, self.costs.splines, tried)
            come_to = attempt(self.mission, self.kernel, motion)
            if come_to.is_plan:
                return (tried, motion) if self.short(motion) else None
            tried = np.where(violating(self.mission, come_to)[:, None, None], self.control, tried)
        return None

    def descends(self) -> bool:
        """Count a step of a descent; return whether there is work for it."""
        harder = 3  # work of a step of descent, in iterations of a polish
        self.done += polish_work(self.mission, harder)
        return self.done < self.work and self.go_on()

    def iterations(self, most: int) -> int:
        """Number of iterations of a polish, at most ``most``, for which there is work."""
        return max(0, min(most, int((self.work - self.done) / polish_work(self.mission, 1))))

    def short(self, motion: Trace) -> bool:
        """Return whether a plan is little longer than the first one, no later, and satisfies as many preferences."""
        longest = self.measure(self.plan) * (1 + self.settings.shortening.longer_margin)
        late = self.mission.objective is Objective.DURATION and duration(motion) > duration(self.plan)
        return self.measure(motion) <= longest and not late and as_many(self.mission, self.kernel, self.plan, motion)

    def accepted(self, tried: Array) -> Trace | None:
        """The motion of control points, (agents, points, dim), metres, if it is a plan and short."""
        motion = trace(self.mission, self.costs.splines, tried)
        return motion if attempt(self.mission, self.kernel, motion).is_plan and self.short(motion) else None
