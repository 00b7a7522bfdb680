"""Driver of the pipeline, from mission text to verified plan; read this file first.

    check     text → findings, and the resolved mission (``front_end``)
    plan      … → a backend → a plan, verified → the files of it
    compile   both
    monitor   a mission and a trace → a judgement of every requirement

Functions take and return values: nothing is printed, and only ``read_file`` opens files. A stage that finds errors is
the last to run. The checks of the resolved mission run together, so that one run reports all findings. Modules that
load a solver or a large library are imported at their use, so that ``check`` stays quick.

A backend plans within the limits of a compilation: it returns its answer, or at a limit its best plan.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from missionc.backends import api
from missionc.backends.choose_backend import Choice
from missionc.backends.foreign_backend import ForeignBackend
from missionc.backends.load import load_engines as load_backend
from missionc.backends.options import Options
from missionc.backends.registry import BACKENDS, is_published, named
from missionc.base.continuous_time import ContinuousTime
from missionc.base.deadline import DEFAULT_TIME_LIMIT, last_call
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.memory import DEFAULT_LIMIT as DEFAULT_MEMORY_LIMIT
from missionc.base.memory import limited
from missionc.base.signals import defer_stop, stop_requested
from missionc.base.source import Source
from missionc.base.trace import StageRun
from missionc.base.units import Seconds
from missionc.compiler import no_plan
from missionc.compiler.ask_cover import BoundSide
from missionc.compiler.certify_plan import certify_plan, reserved_time, to_draw
from missionc.compiler.check_preset import check_preset
from missionc.compiler.checkpoints import Checkpoints, unusable, with_checkpoints
from missionc.compiler.continuous_time import (
    acceptable,
    falls_short,
    plan_in_continuous_time,
    violated_in_flight,
)
from missionc.compiler.described import PLANNER_OPTIONS, described, planner_options
from missionc.compiler.front_end import ANY_BACKEND, Checked, Stopwatch, check
from missionc.compiler.incumbent import CUT_SHORT, Incumbent, cut_short, improved
from missionc.compiler.judge_motion import live_session, monitor
from missionc.compiler.plan_request import NO_EXPLANATION, PlanRequest
from missionc.compiler.plan_with_margin import plan_with_margin
from missionc.compiler.provenance import with_manifest
from missionc.compiler.results import Compiled, CompileOutcome, InvalidMission, Unverified, Verified, with_origins
from missionc.compiler.run_limited import Ended, within
from missionc.compiler.strategy import SEARCH
from missionc.compiler.time_scaling import plan_with_time_scaling
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel

if TYPE_CHECKING:
    from missionc.backends.clot.settings import ClotSettings
    from missionc.backends.smt.settings import SmtSettings
    from missionc.frontend.builder.origins import MissionLike


def ask_backend(
    backend: api.Backend,
    mission: Mission,
    kernel: Kernel,
    request: PlanRequest,
    budget: api.Budget,
    moment: float,
    incumbent: Incumbent,
    covers: bool,
) -> api.Outcome:
    """Outcome of a backend's search; if a limit or a defect ends an improvement, the last plan found.

    Args:
        budget: remaining budget of the request.
        moment: time of interruption, on the clock of ``time.monotonic``.
        incumbent: receives each plan that the search goes on to improve.
        covers: True to use covers too.

    Raises:
        UnusableSnapshot: the run cannot be resumed.
    """
    now = api.Progress("plan" if isinstance(backend, ForeignBackend) else "lower")

    def listen(progress: api.Progress) -> None:
        nonlocal now
        now = progress
        budget.on_progress(progress)
        incumbent.look()

    explain_limit = request.explain_limit
    until = _to_search(budget.deadline, to_draw(explain_limit) if backend.refutes else explain_limit)
    asked_of = replace(budget, deadline=until, on_progress=listen, on_incumbent=incumbent.found)
    search = partial(plan_with_margin, backend, mission, kernel, request.options, asked_of)
    work = partial(search, covers=covers, speed_fraction=request.speed_fraction, log=request.log)
    try:
        answer = within(moment, work)
    except api.UnusableSnapshot:
        raise
    except Exception as error:
        if incumbent.latest is None:
            raise
        incumbent.failed("improving the plan", error)
        return _cut_short(incumbent.latest, api.CutShort.DEFECT)
    if incumbent.latest and isinstance(answer, Ended | api.NotFound):
        best = _cut_short(incumbent.latest, CUT_SHORT.get(answer.reason, api.CutShort.UNFINISHED))
        request.log.searched(backend.name, best)
        return best
    return limit_reached(answer, now) if isinstance(answer, Ended) else answer


def _cut_short(plan: api.Planned, why: api.CutShort) -> api.Planned:
    return replace(plan, report=replace(plan.report.noting(why.note), cut_short=why))


def limit_reached(ended: Ended, now: api.Progress) -> api.NotFound:
    """Outcome of a search that reached a limit before any plan or candidate; it states the current stage."""
    return api.NotFound(ended.reason, f"{ended.during(now.activity)}, before any candidate plan", api.Report())


def _to_search(deadline: float, explain_limit: Seconds) -> float:
    """Time at which a search without a plan must end, before the deadline, to leave time for the explanation."""
    return deadline - min(explain_limit, SEARCH.explanation * max(0.0, deadline - time.monotonic()))


__all__ = [
    "ANY_BACKEND",
    "DEFAULT_MEMORY_LIMIT",
    "DEFAULT_TIME_LIMIT",
    "check",
    "compile",
    "live_session",
    "monitor",
    "plan",
]


@described(PLANNER_OPTIONS)
def compile(
    mission: MissionLike,
    *,
    overrides: Mapping[str, str] | None = None,
    backend: str | api.Backend = "auto",
    settings: Mapping[str, object] | SmtSettings | ClotSettings | None = None,
    vehicle: str = "",
    poses: Path | Source | None = None,
    limits: Limits | None = None,
    seed: int = 0,
    time_limit: float = DEFAULT_TIME_LIMIT,
    memory_limit: int = DEFAULT_MEMORY_LIMIT,
    explain_limit: float = 0.0,
    continuous_time: ContinuousTime = ContinuousTime.WANTED,
    alternatives: int = 1,
    exports: tuple[str, ...] = (),
    listen: Callable[[api.Progress], None] = api.ignore,
    keep: Callable[[bytes], object] | None = None,
    resume: bytes | None = None,
    options: Options | None = None,
    **given: Any,
) -> Compiled:
    """Compile a mission into a verified plan.

    Args:
        mission: a ``Mission``, a path or a text, as for ``check``, like ``overrides``, ``vehicle``, ``poses`` and
            ``limits``.
        backend: name of a backend, ``auto``, or an object of a ``BackendExtension``.
        settings: settings of backends by name, such as ``{"smt.nodes": 400}``, or the settings object of one backend.
        seed: seed of all random numbers.
        time_limit: limit of the compilation, seconds; at the limit, a search ends with its best plan.
        memory_limit: limit for this process and its solvers, bytes.
        explain_limit: part of the time limit for explaining why there is no plan, seconds.
        continuous_time: whether requirements must be satisfied in continuous time too.
        alternatives: number of plans that differ from each other.
        exports: names of further file formats, those of ``missionc export --list``.
        listen: called with each progress report.
        keep: called with the bytes of a checkpoint, from time to time.
        resume: bytes of a checkpoint of the same mission, seed and options.
        options: default values of the options below.

    Returns:
        The compilation: its outcome, and every finding.

    Raises:
        TypeError: there is no such option.
        ValueError: an option does not have such a value.
        ExtensionError: the object is no backend, its name is taken, or the code of an extension failed.
    """
    from missionc.frontend.builder.origins import source_of  # loads the builder of missions, for Python only

    budget = api.Budget(time.monotonic() + time_limit, memory_limit, seed, limits or Limits(), listen)
    if settings:
        from missionc.backends.settings import given as named_settings  # few missions set settings

        overrides = {**(overrides or {}), **named_settings(settings)}
    request = PlanRequest(
        budget,
        planner_options("compile", given, options),
        Checkpoints(keep, resume),
        exports,
        continuous_time,
        Seconds(explain_limit),
        alternatives,
    )
    file = source_of(mission)
    with named(backend) as name:
        checked = check_within(budget, file, overrides=overrides or {}, backend=name, vehicle=vehicle, poses=poses)
        return with_origins(plan(checked, request) if isinstance(checked, Checked) else checked, mission)


def check_within(
    budget: api.Budget,
    file: str | Path | Source,
    *,
    overrides: Mapping[str, str],
    backend: str,
    vehicle: str,
    poses: Path | Source | None = None,
) -> Checked | Compiled:
    """Result of ``check`` within the limits of a compilation, or a failed compilation if a limit is exceeded."""

    def work() -> Checked:
        return check(file, overrides=overrides, backend=backend, limits=budget.limits, vehicle=vehicle, poses=poses)

    with limited(budget.memory_bytes):
        checked = within(last_call(budget.deadline), work)
    if isinstance(checked, Checked):
        return checked
    name = file.name if isinstance(file, Source) else str(file)
    outcome = limit_reached(checked, api.Progress("check"))
    unread = Checked(name, ())
    return Compiled(unread, outcome, (no_plan.not_found(unread, outcome, None),), ())


def plan(checked: Checked, request: PlanRequest) -> Compiled:
    """Compilation of a checked mission, with a verified plan or the reason why there is none.

    It runs the stages of ``strategy``. Backends are not trusted: a result is a plan only after ``verification`` has
    passed it, and ``flight`` its polynomials.
    """
    began = time.monotonic()
    engines = checked.choice.engines if checked.choice else ()
    if checked.mission and engines == ("smt",) and is_published(engines, request.options):
        lacking = check_preset(checked.mission, request.options, request.alternatives) if checked.ok else []
        if lacking:
            return Compiled(checked, InvalidMission(), (*checked.findings, *lacking), checked.seconds)
        request = replace(request, explain_limit=NO_EXPLANATION)
    wanted, secure = request.continuous_time, request.secure
    if wanted is not ContinuousTime.AT_STEPS and checked.mission and checked.kernel:
        judge = partial(violated_in_flight, checked.mission, checked.kernel)
        request = replace(request, budget=replace(request.budget, violated_in_flight=judge))

    def keep(compiled: Compiled) -> None:
        if isinstance(compiled.outcome, Verified) and acceptable(compiled.outcome, wanted):
            secure(cut_short(compiled, api.CutShort.UNFINISHED))

    def widened(compiled: Compiled) -> Compiled:
        from missionc.compiler.wider_margins import plan_with_wider_margins  # only if there is a plan

        widen = partial(plan_with_wider_margins, compiled, replace(request, secure=keep))
        return improved("widening the margins", compiled, widen)

    with limited(request.budget.memory_bytes):
        first = _plan(checked, replace(request, secure=keep))
        first, again = plan_with_time_scaling(first, checked, _plan, request.further, began)
        short = falls_short(first, wanted)
        if short:
            keep(first)
        found, wide = first, widened(first) if short else first  # which may hold between the samples too
        further = partial(plan_in_continuous_time, wide, checked, _plan, again, began)
        first = improved("planning for the time between the samples", wide, further)
        if not isinstance(first.outcome, Verified):
            return first
        from missionc.compiler.redraw import with_attempts  # draws plans, only if there is one

        tried = short and isinstance(wide.outcome, Verified) and wide.outcome.plan.trace is first.outcome.plan.trace
        if not tried:
            found, first = first, widened(first)
        assert isinstance(first.outcome, Verified)
        assert isinstance(found.outcome, Verified)
        first = replace(first, outcome=with_attempts(first.checked, first.outcome, request.log))
        if request.alternatives == 1:
            return first
        keep(first)
        from missionc.compiler.alternatives.search_alternatives import with_alternatives  # only if requested

        more = partial(with_alternatives, first, found.outcome, request)
        return improved("planning alternatives", first, more)


def plan_once(checked: Checked, request: PlanRequest) -> Compiled:
    """Compilation by the stages ``search`` and ``verify`` only, with the mission's engines or the request's backend."""
    with limited(request.budget.memory_bytes):
        return _plan(checked, request)


def _plan(checked: Checked, request: PlanRequest) -> Compiled:
    """Compilation by search and verification.

    An engine whose plan fails verification is dropped, and the others continue.
    """
    first = _plan_by_all(checked, request)
    choice, refused = checked.choice, first.outcome
    if choice is None or not isinstance(refused, Unverified):
        return first
    others = tuple(name for name in choice.engines if name != refused.report.engine)
    late = stop_requested() or time.monotonic() >= request.budget.deadline
    if others in ((), choice.engines) or request.checkpoints.asked or late:
        return first
    rest = replace(checked, choice=replace(choice, engines=others))
    retry = _plan(rest, replace(request.further, backend=None, secure=request.secure))
    if not isinstance(retry.outcome, Verified):
        return first
    report, planner = retry.outcome.report, retry.outcome.plan.backend
    alone = api.Tried(planner, 1, report.work, Seconds(sum(seconds for _, seconds in report.seconds)), "plan found")
    ended = (replace(each, says=UNVERIFIED) for each in refused.report.tried if each.engine == refused.report.engine)
    note = f"`{refused.report.engine}` found {UNVERIFIED}; this is a bug, please report it"
    report = replace(report.noting(note), tried=(*ended, *(report.tried or (alone,))))
    whole = replace(retry.checked, choice=choice)
    return replace(retry, checked=whole, outcome=replace(retry.outcome, report=report))


def _plan_by_all(checked: Checked, request: PlanRequest) -> Compiled:
    """Compilation by one search of all chosen engines together, and verification.

    Covers are not used for a stronger kernel or slower agents, whose infeasibility says nothing about the mission.
    """
    options, budget, checkpoints = request.options, request.budget, request.checkpoints
    watch = Stopwatch(list(checked.seconds))

    def ended(outcome: CompileOutcome, *findings: Diagnostic, checked: Checked = checked) -> Compiled:
        return Compiled(checked, outcome, (*checked.findings, *findings), tuple(watch.seconds))

    mission, kernel, choice = checked.mission, checked.kernel, checked.choice
    if mission is None or kernel is None or choice is None or not checked.ok:
        return ended(InvalidMission())
    backend = request.backend or load_backend(choice.engines, options, checkpoints.asked)
    if isinstance(backend, Diagnostic):
        return ended(InvalidMission(), backend)
    run_budget = with_checkpoints(checked, options, budget, checkpoints)
    if isinstance(run_budget, Diagnostic):
        return ended(InvalidMission(), run_budget)
    moment = last_call(run_budget.deadline)
    left = run_budget.deadline - time.monotonic()
    from missionc.verification.flight.way_missions import has_risen  # only for planning

    reserved = reserved_time(len(mission.agents), mission.steps, left, has_risen(mission))
    whole = replace(run_budget, deadline=run_budget.deadline - reserved)
    bound = BoundSide(mission, kernel, options, whole)
    whole = replace(whole, lower_bound=bound.enough)

    def certified(
        planned: api.Planned, stages: Stopwatch, bound: BoundSide | None, runs: tuple[StageRun, ...]
    ) -> Compiled:
        home = certify_plan(checked, planned, options, run_budget, stages, request.exports, bound, runs)
        return ended(home.outcome, *home.findings, checked=home.checked)

    log = request.log
    incumbent = Incumbent(
        lambda planned: certified(planned, Stopwatch(), None, log.so_far(backend.name, planned)), request.secure
    )
    published = is_published(choice.engines, options)
    try:
        covers = request.kernel is None and request.speed_fraction == 1 and not published
        outcome = ask_backend(backend, mission, request.kernel or kernel, request, whole, moment, incumbent, covers)
    except api.UnusableSnapshot as wrong:
        return ended(InvalidMission(), unusable(checkpoints.name, wrong))
    watch.seconds.extend(outcome.report.seconds)
    if isinstance(outcome, api.Planned):
        defer_stop()

        def brought_home(planned: api.Planned) -> Compiled:
            final = partial(certified, stages=watch, bound=bound, runs=tuple(log.runs))
            home = within(moment, partial(incumbent.timed, planned, final))
            if isinstance(home, Ended):
                late = no_plan.not_brought_home(home, planned, watch.seconds)
                home = ended(late, no_plan.not_found(checked, late, None))
            log.add("verify", planned.report.engine or choice.backend, 0.0, verdict_text(home))
            return home

        compares = weighs_options(mission, outcome, choice) and not published
        home = improved("certifying a later plan", incumbent.best, partial(brought_home, outcome))
        home = incumbent.keep(home, final=not compares)
        if compares and not isinstance(home.outcome, api.NotFound):
            from missionc.compiler.alternatives.compare_options import with_best_option  # only if there are any

            to_compare = replace(whole, deadline=run_budget.deadline - incumbent.reserve(reserved))
            planner = outcome.report.engine or choice.backend
            compare = partial(
                with_best_option, home, checked, outcome, brought_home, planner, options, to_compare, moment, watch, log
            )
            home = incumbent.keep(improved("comparing options", incumbent.best, compare), final=True)
        return replace(home, findings=(*home.findings, *incumbent.findings))
    explained = None
    if request.explain_limit > 0 and (isinstance(outcome, api.Impossible) or outcome.best is not None):
        defer_stop()
        from missionc.compiler.relax.search_relaxations import explain

        try:
            with watch.stage("explain"):
                asked_next = _for_trials(backend, outcome, options)
                why = within(
                    moment, partial(explain, checked, outcome, asked_next, options, whole, request.explain_limit)
                )
            explained = None if isinstance(why, Ended) else why
        except Exception as error:
            incumbent.failed("explaining the result", error)
    finding = (
        no_plan.impossible(mission, outcome, explained)
        if isinstance(outcome, api.Impossible)
        else no_plan.not_found(checked, outcome, explained)
    )
    return with_manifest(replace(ended(outcome, finding, *incumbent.findings), explained=explained), options)


def verdict_text(compiled: Compiled) -> str:
    """Text for the result of the stage ``verify``."""
    match compiled.outcome:
        case Verified():
            return "passed"
        case Unverified():
            return UNVERIFIED
        case api.NotFound(reason=reason):
            return reason.value
        case _:
            codes = sorted({each.code.name for each in compiled.findings if not each.code.warning})
            return f"the plan cannot be flown ({', '.join(codes)})"


def _for_trials(backend: api.Backend, outcome: api.Impossible | api.NotFound, options: Options) -> api.Backend:
    """Backend for plans of changed missions: of a portfolio, the engine that gave the outcome."""
    engine = load_backend((outcome.report.engine,), options) if outcome.report.engine else backend
    return backend if isinstance(engine, Diagnostic) else engine


UNVERIFIED = "a plan that fails verification"
"""Text for the outcome of an engine whose plan was rejected."""


def weighs_options(mission: Mission, planned: api.Planned, choice: Choice) -> bool:
    """Return whether the backend chose disjuncts by an estimate that differs from the mission's objective.

    A schedule estimates path lengths, and its paths ignore moving obstacles.
    """
    spec = BACKENDS.get(planned.report.engine or choice.backend)
    moving = any(not obstacle.constant for obstacle in mission.obstacles)
    asked = mission.objective is not Objective.NONE or moving
    return asked and spec is not None and not spec.optimises_globally and planned.report.cut_short is None
