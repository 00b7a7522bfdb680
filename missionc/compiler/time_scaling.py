"""Time scaling: replacement of a plan beyond its vehicles' limits by a slower plan.

in   first Compiled, a planning function, PlanRequest
out  Compiled: the first flyable one; else the first of all; and the request with its speed fraction
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from missionc.backends.api import discard_snapshot
from missionc.base.diagnostics.code import NEEDS_MORE_TIME, NOT_FLYABLE
from missionc.base.signals import stop_requested
from missionc.compiler.front_end import Checked
from missionc.compiler.incumbent import noted
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, InvalidMission, Verified
from missionc.compiler.strategy import SEARCH, TIME_SCALING
from missionc.ir.lower.tighten import with_flyable_speeds

HURRY = 1e-6
"""Fraction by which a plan may exceed a speed limit, for rounding only."""


def plan_with_time_scaling(
    first: Compiled,
    checked: Checked,
    plan: Callable[[Checked, PlanRequest], Compiled],
    request: PlanRequest,
    began: float,
) -> tuple[Compiled, PlanRequest]:
    """The first plan, or a slower plan if only that is flyable, together with the request that it answers.

    A plan with the user's time scaling (``Options.stretch``) stays unchanged. So does a plan that is faster than the
    vehicles' limits: no plan was found at their top speed before, so no slower one exists.

    Args:
        began: start of the first planning, on the clock of ``time.monotonic``.
    """
    budget = request.budget
    if not _unflyable(first) or request.options.stretch != 1 or _hurried(first):
        return first, request
    now = time.monotonic()
    until = min(budget.deadline, now + max(TIME_SCALING.least, TIME_SCALING.times * (now - began)))
    for speed_fraction in TIME_SCALING.fractions:
        now = time.monotonic()
        if stop_requested() or now >= until:
            break
        more = replace(budget, deadline=now + (until - now) / 2, on_snapshot=discard_snapshot, resume=None)
        slower = replace(request, speed_fraction=speed_fraction)
        log = request.log.within("time scaling", f"{speed_fraction:.0%} of the vehicles' speed")
        retry = plan(checked, replace(slower, budget=more, log=log))
        if isinstance(retry.outcome, Verified):
            note = f"the first plan exceeds vehicle limits; this plan uses {speed_fraction:.0%} of the top speeds"
            return noted(retry, note), slower
        if not isinstance(retry.outcome, InvalidMission):
            break  # slower agents are not in time either
    return first, request


def _hurried(compiled: Compiled) -> bool:
    """Return whether some agent of a plan moves faster than its vehicle can fly."""
    mission, outcome = compiled.checked.mission, compiled.outcome
    if mission is None or not isinstance(outcome, InvalidMission) or outcome.plan is None:
        return False
    position, step = outcome.plan.position, float(mission.step)
    fastest = (((position[:, 1:] - position[:, :-1]) ** 2).sum(axis=-1) ** 0.5).max(axis=1) / step
    flown = with_flyable_speeds(mission, SEARCH.speeds[-1])
    return any(
        fastest[agent.index] > slow.dynamics.top_speed * (1 + HURRY)
        for agent, slow in zip(mission.agents, flown.agents, strict=True)
        if slow.dynamics != agent.dynamics and not agent.dynamics.has_momentum
    )


def _unflyable(compiled: Compiled) -> bool:
    """Return whether a compilation has a verified trace but no flyable polynomials for it."""
    codes = {finding.code for finding in compiled.findings}
    return isinstance(compiled.outcome, InvalidMission) and bool(codes & {NEEDS_MORE_TIME, NOT_FLYABLE})
