"""Continuous-time satisfaction: repairs and further plans if a requirement fails between the steps.

in   first Compiled, a planning function, PlanRequest
out  Compiled: the first plan satisfied in continuous time; else the first of all, rejected if required
says MC710
"""

from __future__ import annotations

import time
from collections.abc import Callable, Set
from dataclasses import replace

from missionc.backends.api import Budget, discard_snapshot
from missionc.backends.load import load_repair
from missionc.backends.registry import is_published
from missionc.base.continuous_time import ContinuousTime
from missionc.base.diagnostics.code import NOT_TOLERATED
from missionc.base.late_dataclass import Record
from missionc.base.signals import stop_requested
from missionc.base.trace import Trace
from missionc.base.units import Metres
from missionc.compiler import no_plan
from missionc.compiler.front_end import Checked
from missionc.compiler.incumbent import noted
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, InvalidMission, Verified
from missionc.compiler.strategy import CONTINUOUS_TIME, Attempt, StrengthenedSet, attempts
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.lower.tighten import tightened_alone


class Short(Record):
    """Notes on a plan that passes its other checks but lacks continuous-time satisfaction or delay tolerance."""

    no: str
    none: str


BETWEEN = Short("violates a requirement between samples", "satisfies every requirement in continuous time")
DELAYS = Short("does not tolerate the delays", "tolerates the delays, but such a plan may exist")


def falls_short(compiled: Compiled, throughout: ContinuousTime) -> Short | None:
    """Notes on the shortcoming of a plan that satisfies every requirement at the steps; None without a shortcoming."""
    if isinstance(compiled.outcome, Verified):
        wanted = throughout is not ContinuousTime.AT_STEPS
        return BETWEEN if wanted and compiled.outcome.certificate.at_steps_alone else None
    return DELAYS if any(each.code is NOT_TOLERATED for each in compiled.findings) else None


def violated_in_flight(mission: Mission, kernel: Kernel, trace: Trace) -> frozenset[str]:
    """Names of the requirements that hold at the samples of a plan, but not between samples of its polynomials.

    Empty if there are no polynomials for it.
    """
    from missionc.flight.trajectories.crazyflie import Flyable, crazyflie  # loads scipy
    from missionc.verification.verify_plan import verify_between

    flyable = crazyflie(mission, kernel, trace)
    if not isinstance(flyable, Flyable):
        return frozenset()
    return verify_between(mission, kernel, trace, flyable.files).violated_between


def acceptable(verified: Verified, throughout: ContinuousTime) -> bool:
    """Return whether a verified plan may be returned if no better one is found."""
    return throughout is not ContinuousTime.REQUIRED or not verified.certificate.at_steps_alone


def plan_in_continuous_time(
    first: Compiled,
    checked: Checked,
    plan: Callable[[Checked, PlanRequest], Compiled],
    request: PlanRequest,
    began: float,
) -> Compiled:
    """Plan that is satisfied in continuous time, or the first one if none is found.

    The first plan is replaced if it violates a requirement between the steps, or lacks the delay tolerance.

    Args:
        first: compilation with the first plan.
        checked: the mission.
        plan: function that plans a mission again.
        request: limits and options of the compilation.
        began: start of the first planning, on the clock of ``time.monotonic``.
    """
    options, budget, throughout = request.options, request.budget, request.continuous_time
    short = falls_short(first, throughout)
    mission, kernel, choice = checked.mission, checked.kernel, checked.choice
    if short is None or mission is None or kernel is None or choice is None:
        return first
    engine = "" if isinstance(first.outcome, InvalidMission) else first.outcome.report.engine or choice.backend
    others = replace(choice, engines=tuple(name for name in choice.engines if name != engine) or choice.engines)
    same = replace(choice, engines=(engine,))
    found = first.outcome if isinstance(first.outcome, Verified) else None
    repair = load_repair(found.plan.trace, found.report) if found else None
    limited = _limited(first, budget, throughout, began)
    failing, tried = _failing(first), 1
    published = is_published(choice.engines, options)
    for attempt in () if published else attempts(engine, short is DELAYS, repair is not None):
        if stop_requested() or time.monotonic() >= limited.deadline:
            break
        asked_for = _strengthened(mission, kernel, failing, attempt) if short is BETWEEN else None
        by = replace(checked, choice=same if attempt.repaired else others if attempt.others else choice)
        more = replace(limited, seed=budget.seed + attempt.seed, deadline=_until(limited.deadline))
        near = repair if attempt.repaired else None
        log = request.log.within("continuous time", str(attempt))
        retry = plan(by, replace(request, budget=more, kernel=asked_for, backend=near, log=log))
        tried += 1
        if isinstance(retry.outcome, Verified) and falls_short(retry, throughout) is None:
            note = f"the first plan {short.no}; this plan was {'repaired' if attempt.repaired else 'found'} afterwards"
            report = retry.outcome.report
            outcome = replace(retry.outcome, report=replace(report, engine=report.engine or engine))
            return noted(replace(retry, checked=replace(retry.checked, choice=choice), outcome=outcome), note)
        failing |= _failing(retry)
    asked_once = "the preset computes one plan only"
    note = asked_once if published else f"none of {tried} plans {short.none}"
    return _fallen_short(first, short, throughout, note)


def _failing(compiled: Compiled) -> frozenset[str]:
    """Names of the requirements that a verified plan violates between its steps."""
    if not isinstance(compiled.outcome, Verified):
        return frozenset()
    return compiled.outcome.certificate.violated_between


def _limited(first: Compiled, budget: Budget, throughout: ContinuousTime, began: float) -> Budget:
    """Budget for further plans: all remaining time if continuous time is required, little if only wanted."""
    quiet = replace(budget, on_snapshot=discard_snapshot, resume=None)
    if not isinstance(first.outcome, Verified) or throughout is not ContinuousTime.WANTED:
        return quiet
    now = time.monotonic()
    until = min(budget.deadline, now + max(CONTINUOUS_TIME.least, CONTINUOUS_TIME.times * (now - began)))
    return replace(
        quiet,
        deadline=until,
        work=min(budget.work, max(CONTINUOUS_TIME.least_work, CONTINUOUS_TIME.times * first.outcome.report.work)),
    )


def _until(deadline: float) -> float:
    """Deadline of the next attempt: half of the remaining time, or all of it if little is left."""
    now = time.monotonic()
    return min(deadline, now + max(CONTINUOUS_TIME.least, (deadline - now) / 2))


def _strengthened(mission: Mission, kernel: Kernel, failing: Set[str], attempt: Attempt) -> Kernel:
    """Stronger kernel whose plans at the steps satisfy the given kernel in continuous time.

    Args:
        failing: names of the requirements that failed between steps.
    """
    from missionc.ir.lower.hold_throughout import hold_throughout

    furthest = mission.step * max(agent.dynamics.top_speed for agent in mission.agents)
    tighter = tightened_alone(kernel, failing, Metres(attempt.margin * furthest))
    every = frozenset(goal.name for goal in kernel.requirements)
    names = {StrengthenedSet.NONE: frozenset[str](), StrengthenedSet.FAILING: failing, StrengthenedSet.ALL: every}[
        attempt.lasting
    ]
    return hold_throughout(mission, tighter, names)


def _fallen_short(first: Compiled, short: Short, throughout: ContinuousTime, note: str) -> Compiled:
    """The first plan with its shortcoming noted, or rejected if continuous time is required."""
    outcome, mission = first.outcome, first.checked.mission
    if not isinstance(outcome, Verified) or mission is None:
        late = (
            replace(each, notes=(*each.notes, note)) if each.code is NOT_TOLERATED else each for each in first.findings
        )
        return replace(first, findings=tuple(late))
    if throughout is ContinuousTime.REQUIRED:
        refused = no_plan.not_between(mission, outcome.certificate)
        with_note = (replace(each, notes=(*each.notes, note)) for each in refused)
        return replace(first, outcome=InvalidMission(), findings=(*first.checked.findings, *with_note))
    return noted(first, note)
