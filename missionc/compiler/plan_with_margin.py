"""Planning with a robustness margin first, for flights with tracking error; then without a margin.

in   a backend, Mission, Kernel, Options, Budget
out  its Outcome
"""

from __future__ import annotations

import time
from dataclasses import replace
from itertools import product

from missionc.backends import api
from missionc.backends.load import load_straighten
from missionc.backends.options import Options
from missionc.base.diagnostics.model import has_errors
from missionc.base.units import Metres
from missionc.compiler.ask_cover import CoverSide
from missionc.compiler.plan_request import StageLog
from missionc.compiler.strategy import COVERS, LAST_TRY, SEARCH, Try, speed_limited, tries, try_text, urgent_tries
from missionc.frontend.checks.check_world import check_world
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.kernel.normal_form import constant
from missionc.ir.kernel.walk import reads_headings
from missionc.ir.language.operator import TooLarge
from missionc.ir.lower.tighten import (
    ahead_of_time,
    margin_limits,
    tightened,
    tracking_margin,
    with_flyable_speeds,
    with_room_for_delays,
    with_vehicle_room,
)
from missionc.ir.lower.unroll_past import looking_ahead


def plan_with_margin(
    backend: api.Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: api.Budget,
    *,
    covers: bool = False,
    speed_fraction: float = 1.0,
    log: StageLog | None = None,
) -> api.Outcome:
    """Outcome of planning with decreasing robustness margins; a required delay tolerance is tried first.

    Args:
        covers: True to use covers if no plan is found at once.
        speed_fraction: below 1, an upper limit as a fraction of the vehicles' top speeds.
        log: records each attempt.
    """
    log = log or StageLog()
    outcome = _tolerant(backend, mission, kernel, options, budget, speed_fraction, log) or _plan_with_margin(
        backend, mission, kernel, options, budget, log, covers=covers, speed_fraction=speed_fraction
    )
    return _limited(outcome, kernel, options.margin) if isinstance(outcome, api.Planned) and options.margin else outcome


def _tolerant(
    backend: api.Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: api.Budget,
    speed_fraction: float,
    log: StageLog,
) -> api.Planned | None:
    """Plan with time reserves for delayed agents; None if no plan found tolerates the required delays.

    At flyable speeds, a delayed agent has a shorter path to make up than at the dynamics' speeds.
    """
    if not mission.tolerances:
        return None
    from missionc.verification.verify_plan import verify  # judging plans loads scipy

    early = ahead_of_time(mission, kernel)
    flown = with_flyable_speeds(mission, min(speed_fraction, SEARCH.speeds[-1]))
    paces = (flown,) if speed_fraction < 1 or flown is mission else (flown, mission)
    for pace, share in product(paces, SEARCH.delays):
        roomy = with_room_for_delays(pace, share)
        if share and has_errors(check_world(roomy, early)):
            continue
        short = replace(_short(budget, SEARCH.work), on_incumbent=api.discard_plan)
        ahead = log.within(
            log.stage, ", ".join(filter(None, (log.attempt, f"{share:.0%} of the extra separation for delays")))
        )
        outcome = _plan_with_margin(backend, roomy, early, options, short, ahead)
        if isinstance(outcome, api.Planned) and verify(mission, kernel, outcome.trace).passed:
            extra = roomy.separation - mission.separation
            room = f" and {extra:.3g} m more separation" if extra else ""
            return outcome.noting(f"planned with earlier deadlines{room} to tolerate the delays")
    return None


def _plan_with_margin(
    backend: api.Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: api.Budget,
    log: StageLog,
    *,
    covers: bool = False,
    speed_fraction: float = 1.0,
) -> api.Outcome:
    """Outcome of planning with decreasing robustness margins, for a flyable plan with the largest margin, or else any
    plan.

    Only infeasibility of the mission itself counts; infeasibility of the tightened mission proves nothing. Checkpoints
    belong to the last attempt. A plan after an attempt that ran out of time is marked as cut short, since more time
    might have given another.
    """
    ahead = looking_ahead(mission, kernel, budget.limits.formula_nodes)
    if isinstance(ahead, TooLarge):
        return api.NotFound(api.Reason.SIZE, _too_large(ahead, budget.limits.formula_nodes), api.Report())
    kernel, meant = ahead, kernel
    cover = CoverSide(mission, kernel, meant, options, budget, log) if covers and not budget.urgent else None
    never = next((goal.name for goal in kernel.requirements if constant(goal.formula) is False), None)
    if never is not None:
        refused = cover.refusal(COVERS.first) if cover is not None else None
        return refused or api.Impossible(
            (never,), "the requirement is false for every motion", api.Report(), api.Scope.MISSION, smallest=True
        )
    wanted = room = with_vehicle_room(mission)
    paces = speed_limited(room, kernel, speed_fraction, stretched=options.stretch != 1)
    if speed_fraction < 1:
        if not paces:
            return api.NotFound(api.Reason.SOLVER, "no agent can be in time at a lower speed", api.Report())
        wanted = paces[0][1]
    margin = tracking_margin(mission) if options.margin is None else Metres(options.margin)
    late = False
    planned = tries(wanted, paces, margin, speed_fraction)
    soonest: api.Planned | None = None
    if budget.urgent:
        first = _planned(backend, wanted, kernel, options, replace(budget, on_incumbent=api.discard_plan))
        log.searched(backend.name, first, LAST_TRY)
        if not isinstance(first, api.Planned):
            return first  # there is no plan with a margin then either
        soonest, planned = first, urgent_tries(wanted, paces, margin, backend.name)
        budget.on_incumbent(_noted(first, margin, 0.0) if margin > 0 else first)
    failed = 1.0  # least share of the margin without a plan
    for each in planned:
        tight = tightened(each.mission, kernel, Metres(each.margin * margin))
        fastest = with_flyable_speeds(room, SEARCH.speeds[-1]) if each.mission is not room else room
        outcome = _planned(backend, *tight, options, _short(budget, each.work), under_way=fastest)
        log.searched(backend.name, outcome, try_text(each, margin))
        if isinstance(outcome, api.Planned):
            share = each.margin
            if options.margin is not None and share < failed:
                wider = (each, failed, fastest)
                outcome, share = _bisected(backend, kernel, options, budget, margin, outcome, *wider, log)
            return _after(outcome if share == 1.0 or margin <= 0 else _noted(outcome, margin, share), late)
        failed = min(failed, each.margin)
        late = late or (isinstance(outcome, api.NotFound) and outcome.reason is api.Reason.TIME)
        refused = cover.refusal(COVERS.first, outcome.report) if cover is not None else None
        if refused is not None:
            return refused
    outcome = soonest or _planned(backend, wanted, kernel, options, budget, cover)
    if soonest is None and cover is None:
        log.searched(backend.name, outcome, LAST_TRY if speed_fraction == 1 else "no margin")
    if not isinstance(outcome, api.Planned):
        return outcome
    share = 0.0
    if options.margin and soonest is None:
        last = (Try(wanted, None, share, SEARCH.work), failed, room)
        outcome, share = _bisected(backend, kernel, options, budget, margin, outcome, *last, log)
    return _after(_noted(outcome, margin, share) if margin > 0 else outcome, late)


def _bisected(
    backend: api.Backend,
    kernel: Kernel,
    options: Options,
    budget: api.Budget,
    margin: Metres,
    planned: api.Planned,
    found: Try,
    failed: float,
    under_way: Mission,
    log: StageLog,
) -> tuple[api.Planned, float]:
    """The plan with the largest fraction of the margin that bisection finds, and this fraction.

    Args:
        planned: the plan of the attempt ``found``; ``failed`` is a larger fraction, for which there was no plan.
    """
    share = found.margin
    for _ in range(SEARCH.bisections):
        budget.on_incumbent(_noted(planned, margin, share))
        middle = replace(found, margin=(share + failed) / 2)
        tight = tightened(found.mission, kernel, Metres(middle.margin * margin))
        outcome = _planned(backend, *tight, options, _short(budget, found.work), under_way=under_way)
        log.searched(backend.name, outcome, try_text(middle, margin))
        if isinstance(outcome, api.Planned):
            planned, share = outcome, middle.margin
        else:
            failed = middle.margin
    return planned, share


def _short(budget: api.Budget, work: float) -> api.Budget:
    """Budget of an attempt without checkpoints: a fraction of the remaining time, and at most ``work`` units."""
    left = budget.deadline - time.monotonic()
    scarce = SEARCH.scarce_time if left < SEARCH.scarce else SEARCH.time
    share = SEARCH.urgent_time if budget.urgent else scarce
    deadline = budget.deadline - (1 - share) * left
    return replace(budget, deadline=deadline, work=work, on_snapshot=api.discard_snapshot, resume=None)


def _too_large(ahead: TooLarge, room: int) -> str:
    return (
        f"expanded past operators have at least {ahead.nodes} parts; the limit is {room}"
        " (`--limit formula_nodes=VALUE`)"
    )


def _planned(
    backend: api.Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: api.Budget,
    cover: CoverSide | None = None,
    under_way: Mission | None = None,
) -> api.Outcome:
    """Outcome of a backend. A portfolio's plan from a generated roadmap is straightened.

    Missions with headings are excluded: a waiting agent has a heading on the roadmap, but none in motion.

    If straightening violates requirements between samples that the plan satisfied, it is repeated with these stronger,
    or left out.

    Args:
        under_way: mission with the speeds for straightening: a gentle start is compensated later.
    """
    if cover is None:
        outcome = backend.plan(mission, kernel, options, budget)
    else:
        outcome = cover.searched(backend, mission, kernel, budget, LAST_TRY)
    if not isinstance(outcome, api.Planned):
        return outcome
    straighten = load_straighten(outcome.report.engine)
    if straighten is None or mission.solve.roadmap is not None or reads_headings(kernel):
        return outcome
    from missionc.backends.acceptance import violated_between_samples  # judging plans loads numpy
    from missionc.ir.lower.hold_throughout import hold_throughout

    faster = replace(mission, agents=(under_way or mission).agents)
    straight = straighten(faster, kernel, outcome, budget)
    if budget.violated_in_flight is None or straight.trace is outcome.trace:
        return straight
    failing = violated_between_samples(mission, kernel, straight.trace)
    if not failing or violated_between_samples(mission, kernel, outcome.trace):
        return straight
    straight = straighten(faster, hold_throughout(mission, kernel, failing), outcome, budget)
    return outcome if violated_between_samples(mission, kernel, straight.trace) else straight


def _after(planned: api.Planned, late: bool) -> api.Planned:
    """The plan, marked as cut short if an attempt before it ran out of time."""
    if not late or planned.report.cut_short:
        return planned
    return replace(planned, report=replace(planned.report, cut_short=api.CutShort.TIME))


def _limited(planned: api.Planned, kernel: Kernel, margin: float) -> api.Planned:
    """The plan with a note on the regions, ranges and tolerances that are too small for its margin."""
    asked = planned.report.kept * margin
    small = [f"{kept * 100:g} cm for `{name}`" for name, kept in margin_limits(kernel, Metres(asked)).items()]
    note = f"robustness margin {', '.join(small)}, not {asked * 100:g} cm: sizes and ranges shrink by at most half"
    return planned.noting(note) if small else planned


def _noted(planned: api.Planned, margin: Metres, part: float) -> api.Planned:
    achieved = f"; this plan was found with {part * margin * 100:g} cm" if part else ""
    note = f"no plan was found with a robustness margin of {margin * 100:g} cm{achieved}"
    return replace(planned, report=replace(planned.report.noting(note), kept=part))
