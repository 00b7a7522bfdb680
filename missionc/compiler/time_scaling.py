"""Planning of what vehicles can fly: a plan that is too fast for a flight, or bends too much, is planned again slower.

in   the first Compiled, how to plan again, Options, Budget
out  Compiled: the first of them that can be flown; else the first of all. And how calm that is
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Protocol

from missionc.backends.api import Budget, discard_snapshot
from missionc.backends.options import Options
from missionc.base.diagnostics.code import NEEDS_MORE_TIME, NOT_FLYABLE
from missionc.base.signals import stop_requested
from missionc.base.units import Seconds
from missionc.compiler.front_end import Checked
from missionc.compiler.incumbent import noted
from missionc.compiler.plan_with_margin import FASTER
from missionc.compiler.results import Compiled, InvalidMission, Verified
from missionc.ir.lower.tighten import with_flyable_speeds

LEAST_TIME, TIMES = Seconds(10.0), 3.0
"""Seconds for all further plans at least, or so many times what the first one took."""

HURRY = 1e-6
"""The share of a speed by which a plan may exceed it: rounding, and nothing else."""

CALM = (0.85, 0.7, 0.55, 0.4, 0.25)
"""In turn, shares of what vehicles do at most."""


class PlanAgain(Protocol):
    """Plans once more, no faster than at a share of what vehicles do at most."""

    def __call__(self, checked: Checked, options: Options, budget: Budget, *, calm: float) -> Compiled: ...


def plan_with_time_scaling(
    first: Compiled, checked: Checked, plan_again: PlanAgain, options: Options, budget: Budget, began: float
) -> tuple[Compiled, float]:
    """The first plan, or a slower one where that cannot be flown and this one can; and at which share of the speeds.

    A plan whose pace its user has chosen (``Options.stretch``) stays what it is. So does one that is faster than the
    vehicles fly: at the most that they do no plan was found before it, and every slower one would be one of those.

    Args:
        began: when the first one was asked for, on the clock of ``time.monotonic``.
    """
    if not _unflyable(first) or options.stretch != 1 or _hurried(first):
        return first, 1.0
    now = time.monotonic()
    until = min(budget.deadline, now + max(LEAST_TIME, TIMES * (now - began)))
    for calm in CALM:
        now = time.monotonic()
        if stop_requested() or now >= until:
            break
        more = replace(budget, deadline=now + (until - now) / 2, keep=discard_snapshot, resume=None)
        retry = plan_again(checked, options, more, calm=calm)
        if isinstance(retry.outcome, Verified):
            return noted(retry, f"the first plan cannot be flown; this one can, at {calm:g} of the top speeds"), calm
        if not isinstance(retry.outcome, InvalidMission):
            break  # who is slower still is nowhere in time either
    return first, 1.0


def _hurried(compiled: Compiled) -> bool:
    """Whether a plan has somebody faster than vehicles fly plans at most."""
    mission, outcome = compiled.checked.mission, compiled.outcome
    if mission is None or not isinstance(outcome, InvalidMission) or outcome.plan is None:
        return False
    position, step = outcome.plan.position, float(mission.step)
    fastest = (((position[:, 1:] - position[:, :-1]) ** 2).sum(axis=-1) ** 0.5).max(axis=1) / step
    flown = with_flyable_speeds(mission, FASTER[-1])
    return any(
        fastest[agent.index] > slow.dynamics.top_speed * (1 + HURRY)
        for agent, slow in zip(mission.agents, flown.agents, strict=True)
        if slow.dynamics != agent.dynamics and not agent.dynamics.has_momentum
    )


def _unflyable(compiled: Compiled) -> bool:
    """Whether there is a plan, and no flight of it."""
    codes = {finding.code for finding in compiled.findings}
    return isinstance(compiled.outcome, InvalidMission) and bool(codes & {NEEDS_MORE_TIME, NOT_FLYABLE})
