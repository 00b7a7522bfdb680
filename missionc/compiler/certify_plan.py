"""Certification of a backend's trace: time-scaled, verified, fitted and written, or the reason for rejection.

in   a checked mission, the trace of a backend and its report
out  Verified, Unverified, Refused or NotFound, with findings
says MC604 MC608, and the findings of files and exports
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from missionc.backends.api import Budget, NotFound, Planned, Progress, Reason
from missionc.backends.options import Options
from missionc.base.diagnostics.code import NO_WAY
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.trace import Plan, StageRun
from missionc.base.units import Seconds
from missionc.compiler import no_plan
from missionc.compiler.ask_cover import BoundSide
from missionc.compiler.front_end import ANY_BACKEND, Checked, Stopwatch, check
from missionc.compiler.provenance import asked_for, data, given, inputs, packages
from missionc.compiler.results import InvalidMission, Unverified, Verified

STEP_OF_AGENT = 6e-3
"""Time to certify a trace, in seconds per step and agent; an observed maximum."""

LEAST, MOST = Seconds(0.3), 0.25
"""Minimum time reserved for certification, seconds, and its maximum as a fraction of the remaining time."""

WAY_HOME, MOST_HOME = Seconds(3.0), 0.4
"""Additional seconds, and the maximum fraction, for a plan with a return transfer that is planned in flight."""


DRAWING = 3.0
"""Seconds to evaluate, draw and write the closest infeasible candidate."""


class Certified(Record, eq=False):
    """Result of certifying a trace.

    ``checked`` is the mission that the plan was verified against, time-scaled if requested.
    """

    checked: Checked
    outcome: Verified | Unverified | InvalidMission | NotFound
    findings: tuple[Diagnostic, ...] = ()


def reserved_time(agents: int, steps: int, left: float, way_home: bool = False) -> Seconds:
    """Seconds of the remaining time ``left`` that are reserved for the stages after a search."""
    more, most = (WAY_HOME, MOST_HOME) if way_home else (0.0, MOST)
    return Seconds(min(LEAST + more + STEP_OF_AGENT * agents * steps, most * max(0.0, left)))


def to_draw(explain_limit: Seconds) -> Seconds:
    """Seconds of the explanation's time that are reserved for drawing the closest infeasible candidate."""
    return Seconds(min(DRAWING, explain_limit))


def certify_plan(
    checked: Checked,
    planned: Planned,
    options: Options,
    budget: Budget,
    watch: Stopwatch,
    exports: tuple[str, ...] = (),
    bound: BoundSide | None = None,
    runs: tuple[StageRun, ...] = (),
) -> Certified:
    """Verify the plan of a trace and create its files; backends are not trusted.

    Args:
        checked: mission with its kernel and a choice of backend.
        exports: names of further file formats.
        bound: lower bounds; if None, or for a time-scaled plan, only tours are used.
        runs: attempts so far.
    """
    # Imported here: judging and writing plans loads scipy, which `check` does not need.
    from missionc.compiler.plan_ways import plan_ways
    from missionc.compiler.remaining import stops_of, whole_checks, without_home
    from missionc.output.notebook_ground import notebook_ground
    from missionc.output.output_files import Provenance, emit
    from missionc.planning.progression.past_document import past_json
    from missionc.verification.flight.way_missions import has_risen
    from missionc.verification.verify_plan import verify

    checked = _as_meant(checked)
    mission, kernel, choice = checked.valid_mission, checked.valid_kernel, checked.choice
    assert choice is not None
    trace, report = planned.trace, planned.report
    planner = report.engine or choice.backend
    if options.stretch not in (1, checked.stretch):  # a remaining mission is stretched already, with no option
        slower = _slower(checked, options, budget)
        if slower.mission is None or slower.kernel is None or not slower.ok:
            return Certified(
                checked, InvalidMission(), tuple(each for each in slower.findings if not each.code.warning)
            )
        checked, mission, kernel = slower, slower.mission, slower.kernel
        from missionc.geometry.slow_down import slowed

        trace = slowed(mission, trace)
    budget.on_progress(Progress("verify"))
    with watch.stage("verify"):
        certificate = verify(mission, kernel, trace)
        whole = whole_checks(checked.rest, trace)
        certificate = certificate if whole is None else certificate.joined(whole)
    if {check.name for check in certificate.failures} == {"delay"}:
        late = NotFound(Reason.DELAY, Reason.DELAY.value, report)
        return Certified(checked, late, (no_plan.not_tolerated(mission, certificate),))
    if not certificate.passed and options.stretch != 1:
        from missionc.flight.trajectories.refusals import not_slower

        return Certified(
            checked, InvalidMission(), (not_slower(mission, certificate, certificate.judgements, options.stretch),)
        )
    if not certificate.passed:
        return Certified(checked, Unverified(certificate, report), (no_plan.not_verified(certificate, planner),))
    tours = BoundSide(mission, kernel, options, replace(budget, deadline=0.0))
    proven = (tours if bound is None or options.stretch != 1 else bound).proven(trace)
    ground = partial(notebook_ground, mission, kernel)
    runs = (*runs, StageRun("verify", "", planner, 0.0, "passed"))
    verified = Plan(
        mission.name, planner, budget.seed, trace, certificate.judgements, proven, report.solved, runs, ground
    )
    budget.on_progress(Progress("emit"))
    with watch.stage("emit"):
        cut_short = report.cut_short.value if report.cut_short else ""
        provenance = Provenance(
            inputs(checked),
            (*given(checked, options), *asked_for(exports)),
            cut_short,
            options.stretch,
            data(checked),
            past_json(checked.past) if checked.past else "",
            packages(mission, planner, exports),
        )
        stops = stops_of(checked, dict(checked.stops)) if checked.stops else None
        written = partial(emit, exports=exports, plan_ways=partial(plan_ways, budget=budget), stops=stops)
        output = written(mission, kernel, verified, certificate, provenance)
    if isinstance(output, Diagnostic) and output.code is NO_WAY and has_risen(mission):
        # For agents in flight, a plan that ends in the air is better than none: safe ends lead down from it.
        checked = without_home(checked)
        assert checked.past is not None
        mission, provenance = checked.valid_mission, replace(provenance, past=past_json(checked.past))
        with watch.stage("emit"):
            output = written(mission, kernel, verified, certificate, provenance)
    if isinstance(output, Diagnostic):
        return Certified(checked, InvalidMission(trace), (output,))
    report = report.noting(*output.notes)
    return Certified(checked, Verified(verified, output.certificate, report, dict(output.files)), output.findings)


def _as_meant(checked: Checked) -> Checked:
    """Checked mission with the agents' own maximum speeds; a remaining mission may be planned with lower ones."""
    if checked.rest is None or checked.mission is None:
        return checked
    meant = {agent.name: agent for agent in checked.rest.mission.agents}
    agents = tuple(
        replace(agent, dynamics=meant[agent.name].dynamics, vehicle=meant[agent.name].vehicle, course=())
        for agent in checked.mission.agents
    )
    return replace(checked, mission=replace(checked.mission, agents=agents))


def _slower(checked: Checked, options: Options, budget: Budget) -> Checked:
    """The same mission with a longer horizon for time scaling, and the same choice of backend."""
    longer = check(
        checked.sources[0],
        overrides=checked.overrides,
        backend=ANY_BACKEND,
        limits=budget.limits,
        stretch=options.stretch,
        vehicle=checked.vehicle,
        poses=checked.poses,
    )
    return replace(longer, choice=checked.choice, seconds=checked.seconds)
