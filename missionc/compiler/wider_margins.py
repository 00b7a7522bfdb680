"""Wider margins: a verified plan is polished once towards wider normalised margins.

in   Compiled with a verified plan, PlanRequest
out  Compiled: the wider plan if it passes every check and is wider; else the same

The first plan was verified before, and is the answer after any failure of this stage.
"""

from __future__ import annotations

import math
from collections.abc import Set
from dataclasses import replace
from functools import partial

from missionc.backends.acceptance import attempt
from missionc.backends.api import CutShort, Planned
from missionc.backends.clot.settings import clot_settings
from missionc.backends.load import load_widen
from missionc.base.deadline import last_call
from missionc.base.diagnostics.code import IMPROVEMENT_FAILED
from missionc.base.signals import defer_stop, stop_requested
from missionc.base.units import Metres
from missionc.compiler.ask_cover import BoundSide
from missionc.compiler.certify_plan import certify_plan
from missionc.compiler.front_end import Checked, Stopwatch
from missionc.compiler.incumbent import CUT_SHORT, RESERVE, cut_short
from missionc.compiler.plan_request import PlanRequest
from missionc.compiler.results import Compiled, Verified
from missionc.compiler.run_limited import Ended, within
from missionc.compiler.strategy import MARGINS, speed_limited, widens
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.geometry.natural_scale import body
from missionc.ir.language.operator import TooLarge
from missionc.ir.lower.hold_throughout import hold_throughout
from missionc.ir.lower.tighten import tightened, tracking_margin, with_vehicle_room
from missionc.ir.lower.unroll_past import looking_ahead
from missionc.verification.between.between_steps import between_steps
from missionc.verification.monitoring.normalised_margins import Margins

BODIES = ("obstacle", "separation")
"""Checks of a certificate about the distances of bodies."""


def plan_with_wider_margins(first: Compiled, request: PlanRequest) -> Compiled:
    """Compilation with wider margins, if such a plan is found; ``request.secure`` receives the first plan before."""
    if not _narrow(first, request):
        return first
    defer_stop()
    request.secure(first)
    wider = within(last_call(request.budget.deadline), partial(with_wider_margins, first, request))
    return cut_short(first, CUT_SHORT.get(wider.reason, CutShort.UNFINISHED)) if isinstance(wider, Ended) else wider


def with_wider_margins(first: Compiled, request: PlanRequest) -> Compiled:
    """The compilation with a wider plan that passes every check, or the first one.

    Requirements that the first plan or a wider one violates between the samples are strengthened.
    """
    found = first.outcome
    if not isinstance(found, Verified) or not _narrow(first, request):
        return first
    checked, log, engine = first.checked, request.log, found.plan.backend
    bound, watch, took = _bound(checked, found, request), Stopwatch(list(first.seconds)), dict(first.seconds)
    until = request.budget.deadline - RESERVE * (took.get("verify", 0.0) + took.get("emit", 0.0))
    work, failed = MARGINS.work_after(found.report.work), _failing(found)
    most = MARGINS.share * work
    lasting = failed | _fragile(checked, found)
    for _ in range(MARGINS.tries):
        budget = replace(request.budget, deadline=until, work=min(work, most))
        with watch.stage("margins"):
            planned = _widened(checked, found, replace(request, budget=budget), lasting)
        done = planned.report.work - found.report.work
        if planned.trace is found.plan.trace:
            log.add("margins", engine, done, "no plan with wider margins found")
            same = replace(first, seconds=tuple(watch.seconds))
            return cut_short(same, planned.report.cut_short) if planned.report.cut_short else same
        log.add("margins", engine, done, "plan found")
        runs = tuple(log.runs)
        home = certify_plan(checked, planned, request.options, request.budget, watch, request.exports, bound, runs)
        wider = home.outcome
        if isinstance(wider, Verified) and _failing(wider) <= failed and _wider(checked, wider, found):
            log.add("verify", engine, 0.0, "passed")
            kept = (each for each in first.findings if each.code is IMPROVEMENT_FAILED)
            report = replace(wider.report, notes=tuple(dict.fromkeys(wider.report.notes)))
            return replace(
                first,
                checked=home.checked,
                outcome=replace(wider, report=report),
                findings=(*checked.findings, *home.findings, *kept),
                seconds=tuple(watch.seconds),
            )
        log.add("verify", engine, 0.0, "rejected; the plan before is kept")
        work -= done
        if not isinstance(wider, Verified) or _failing(wider) <= lasting:
            break
        lasting |= _failing(wider)
    return replace(first, seconds=tuple(watch.seconds))


def _narrow(first: Compiled, request: PlanRequest) -> bool:
    """Return whether the margins of a verified plan are below the target, and are to be widened."""
    found, checked = first.outcome, first.checked
    if not isinstance(found, Verified) or not widens(checked, request) or found.report.cut_short or stop_requested():
        return False
    return not margins_of(checked, found).wide


def margins_of(checked: Checked, verified: Verified) -> Margins:
    """Normalised margins of a verified plan; those of its bodies from the certificate."""
    mission, certificate = checked.valid_mission, verified.certificate
    bodies = min((each.margin for each in certificate.checks if each.name in BODIES), default=math.inf)
    most = clot_settings(mission).shortening.margin
    return Margins.of(mission, checked.valid_kernel, verified.plan.trace, bodies / max(body(mission), 1e-9), most)


def _widened(checked: Checked, found: Verified, request: PlanRequest, lasting: Set[str]) -> Planned:
    """The plan with wider margins, at its own pace and with its robustness margin; the same if none is found.

    Args:
        lasting: requirements whose parts must last from sample to sample.
    """
    mission, options, budget = checked.valid_mission, request.options, request.budget
    same = Planned(found.plan.trace, found.report)
    kernel = looking_ahead(mission, checked.valid_kernel, budget.limits.formula_nodes)
    if isinstance(kernel, TooLarge):
        return same
    room = with_vehicle_room(mission)
    paces = (pace for _, pace in speed_limited(room, kernel, 1.0, stretched=options.stretch != 1))
    margin = tracking_margin(mission) if options.margin is None else options.margin
    for pace in (*paces, room, mission):
        tight, tighter = tightened(pace, kernel, Metres(found.report.kept * margin))
        if attempt(tight, tighter, same.trace).is_plan:
            return load_widen()(tight, hold_throughout(mission, tighter, lasting), same, budget)
    return same


def _failing(verified: Verified) -> frozenset[str]:
    """Requirements that a verified plan violates between its steps."""
    return frozenset(each.requirement for each in verified.certificate.at_steps_alone)


def _fragile(checked: Checked, verified: Verified) -> frozenset[str]:
    """Requirements that a plan violates between its steps if it is flown straight from state to state."""
    mission, trace = checked.valid_mission, verified.plan.trace
    between = between_steps(mission, checked.valid_kernel, trace, motion(mission, trace))
    return frozenset(each.requirement for each in between if not each.holds)


def _wider(checked: Checked, wider: Verified, found: Verified) -> bool:
    """Return whether a verified plan has wider margins."""
    gain = clot_settings(checked.valid_mission).shortening.wider
    return margins_of(checked, wider).wider(margins_of(checked, found), gain)


def _bound(checked: Checked, found: Verified, request: PlanRequest) -> BoundSide:
    """Lower bounds of a plan, without covers: the bound beside the first plan is known."""
    mission, proven = checked.valid_mission, found.plan.proven
    covered = round(proven.least / mission.step) if proven and proven.unit == "s" else None
    return BoundSide(mission, checked.valid_kernel, request.options, request.budget, covered=covered)
