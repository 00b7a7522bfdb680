"""Wider margins: a verified plan is polished once towards wider normalised margins.

in   Compiled with a verified plan, PlanRequest
out  Compiled: the wider plan if it passes every check and is wider; else the same

The first plan was verified before, and is the answer after any failure of this stage.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

from missionc.backends.acceptance import attempt, violated_between_samples
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
from missionc.geometry.natural_scale import body
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.operator import TooLarge
from missionc.ir.lower.hold_throughout import hold_throughout
from missionc.ir.lower.tighten import tightened, tracking_margin, with_vehicle_room
from missionc.ir.lower.unroll_past import looking_ahead
from missionc.verification.monitoring.normalised_margins import Margins

BODIES = ("obstacle", "separation")
"""Checks of a certificate about the distances of bodies."""


def plan_with_wider_margins(first: Compiled, request: PlanRequest) -> Compiled:
    """Compilation with wider margins, if such a plan is found; ``request.secure`` receives the first plan before."""
    margins = _narrow(first, request)
    if margins is None:
        return first
    defer_stop()
    request.secure(first)
    wider = within(last_call(request.budget.deadline), partial(_searched, first, margins, request))
    return cut_short(first, CUT_SHORT.get(wider.reason, CutShort.UNFINISHED)) if isinstance(wider, Ended) else wider


def with_wider_margins(first: Compiled, request: PlanRequest) -> Compiled:
    """The compilation with a wider plan that passes every check, or the first one.

    Requirements that the first plan or a wider one violates between the samples are strengthened.
    """
    margins = _narrow(first, request)
    return first if margins is None else _searched(first, margins, request)


def _searched(first: Compiled, margins: Margins, request: PlanRequest) -> Compiled:
    """Result of the search for a plan with wider margins than ``margins``, those of the first plan."""
    found = first.outcome
    assert isinstance(found, Verified)
    checked, log, engine = first.checked, request.log, found.plan.backend
    bound, watch, took = _bound(checked, found, request), Stopwatch(list(first.seconds)), dict(first.seconds)
    until = request.budget.deadline - RESERVE * (took.get("verify", 0.0) + took.get("emit", 0.0))
    work, failed = MARGINS.work_after(found.report.work), found.certificate.violated_between
    most = MARGINS.share * work
    # Between the samples the plan may be flown straight from state to state, or on its polynomials.
    lasting = failed | violated_between_samples(checked.valid_mission, checked.valid_kernel, found.plan.trace)
    gain = clot_settings(checked.valid_mission).shortening.wider
    with watch.stage("margins"):
        planned, asked = Planned(found.plan.trace, found.report), _as_planned(checked, found, request)
    for _ in range(MARGINS.tries):
        budget = replace(request.budget, deadline=until, work=min(work, most))
        if asked is not None:
            with watch.stage("margins"):
                kernel = hold_throughout(checked.valid_mission, asked[1], lasting)
                planned = load_widen()(asked[0], kernel, Planned(found.plan.trace, found.report), budget)
        done = planned.report.work - found.report.work
        if planned.trace is found.plan.trace:
            log.add("margins", engine, done, "no plan with wider margins found")
            same = replace(first, seconds=tuple(watch.seconds))
            return cut_short(same, planned.report.cut_short) if planned.report.cut_short else same
        log.add("margins", engine, done, "plan found")
        runs = tuple(log.runs)
        home = certify_plan(checked, planned, request.options, request.budget, watch, request.exports, bound, runs)
        wider = home.outcome
        failing = wider.certificate.violated_between if isinstance(wider, Verified) else frozenset[str]()
        if isinstance(wider, Verified) and failing <= failed and margins_of(checked, wider).wider(margins, gain):
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
        if failing <= lasting:
            break
        lasting |= failing
    return replace(first, seconds=tuple(watch.seconds))


def _narrow(first: Compiled, request: PlanRequest) -> Margins | None:
    """Margins of a verified plan if they are below the target and are to be widened; None otherwise."""
    found, checked = first.outcome, first.checked
    if not isinstance(found, Verified) or not widens(checked, request) or found.report.cut_short or stop_requested():
        return None
    margins = margins_of(checked, found)
    return None if margins.wide else margins


def margins_of(checked: Checked, verified: Verified) -> Margins:
    """Normalised margins of a verified plan; those of its bodies from the certificate."""
    mission, certificate = checked.valid_mission, verified.certificate
    bodies = min((each.margin for each in certificate.checks if each.name in BODIES), default=math.inf)
    most = clot_settings(mission).shortening.margin
    return Margins.of(mission, checked.valid_kernel, verified.plan.trace, bodies / max(body(mission), 1e-9), most)


def _as_planned(checked: Checked, found: Verified, request: PlanRequest) -> tuple[Mission, Kernel] | None:
    """Mission and kernel at the plan's own speeds and with its robustness margin; None if there are none."""
    mission, options = checked.valid_mission, request.options
    kernel = looking_ahead(mission, checked.valid_kernel, request.budget.limits.formula_nodes)
    if isinstance(kernel, TooLarge):
        return None
    room = with_vehicle_room(mission)
    paces = (pace for _, pace in speed_limited(room, kernel, 1.0, stretched=options.stretch != 1))
    margin = tracking_margin(mission) if options.margin is None else options.margin
    for pace in (*paces, room, mission):
        strict = tightened(pace, kernel, Metres(found.report.kept * margin))
        if attempt(*strict, found.plan.trace).is_plan:
            return strict
    return None


def _bound(checked: Checked, found: Verified, request: PlanRequest) -> BoundSide:
    """Lower bounds of a plan, without covers: the bound beside the first plan is known."""
    mission, proven = checked.valid_mission, found.plan.proven
    covered = round(proven.least / mission.step) if proven and proven.unit == "s" else None
    return BoundSide(mission, checked.valid_kernel, request.options, request.budget, covered=covered)
