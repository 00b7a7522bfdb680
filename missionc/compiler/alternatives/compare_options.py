"""Comparison of discrete decisions: disjuncts and orders of a plan are forbidden in turn, and the best plan is
selected.

    in   a plan of a backend that chooses options before planning
    out  the same plan or a better one, with notes on the others

A lower bound excludes decisions that cannot be better. The work is bounded and counted, so that one seed gives one
plan.
"""

from __future__ import annotations

import heapq
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count, islice

from missionc.backends.api import Budget, CutShort, NotFound, Planned, Reason
from missionc.backends.load import load_engines
from missionc.backends.options import Options
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.signals import stop_requested
from missionc.compiler.alternatives.restriction import Restriction, restrictions
from missionc.compiler.alternatives.search_alternatives import amount, objective_value, plan_restricted, quality
from missionc.compiler.front_end import Checked, Stopwatch
from missionc.compiler.plan_request import StageLog
from missionc.compiler.results import Compiled, Verified
from missionc.compiler.run_limited import Ended
from missionc.compiler.strategy import COMPARISON
from missionc.frontend.checks.lower_bounds import lower_bounds
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.signature import Signature, Signatures, differences


def with_best_option(
    first: Compiled,
    checked: Checked,
    planned: Planned,
    certify: Callable[[Planned], Compiled],
    engine: str,
    options: Options,
    budget: Budget,
    moment: float,
    watch: Stopwatch,
    log: StageLog,
) -> Compiled:
    """Compilation with the best plan over other disjuncts and orders of events.

    Args:
        first: compilation of the first plan.
        checked: mission that was planned.
        planned: first plan.
        certify: verifies a better plan and creates its files.
        engine: name of the planning backend.
        moment: time of interruption, on the clock of ``time.monotonic``.
        log: records the comparison.
    """
    mission, kernel = checked.valid_mission, checked.valid_kernel
    with watch.stage("compare"):
        best = compare_options(mission, kernel, planned, engine, options, budget, moment)
    if best is not planned:
        kept = "the first plan is the best" if best.trace is planned.trace else "better plan found"
        log.add("options", engine, best.report.work - planned.report.work, kept)
    if best.trace is not planned.trace or best.report.cut_short is not planned.report.cut_short:
        return certify(best)
    if not isinstance(first.outcome, Verified):
        return first
    notes = first.outcome.report.notes
    report = replace(best.report, notes=(*notes, *(each for each in best.report.notes if each not in notes)))
    return replace(first, outcome=replace(first.outcome, report=report), seconds=tuple(watch.seconds))


def compare_options(
    mission: Mission,
    kernel: Kernel,
    planned: Planned,
    engine: str,
    options: Options,
    budget: Budget,
    moment: float,
) -> Planned:
    """The best plan among the given one and plans with other disjuncts or orders of events.

    Args:
        engine: name of the planning backend.
        moment: time of interruption, on the clock of ``time.monotonic``.
    """
    backend = load_engines((engine,), options)
    if isinstance(backend, Diagnostic):
        return planned
    signatures = Signatures(mission, kernel)
    compared = [(planned, signatures.of(planned.trace))]
    waiting: list[tuple[float, int, Restriction]] = []
    numbers = count()
    left, late = COMPARISON.work_after(planned.report.work), False

    def wait_for(restriction: Restriction, of: Planned, signature: Signature) -> None:
        best = min(objective_value(mission, kernel, each.trace) for each, _ in compared)
        for each in _decided(restriction, signature, mission, of):
            bound = _bound(mission, kernel, each)
            if bound < best:
                heapq.heappush(waiting, (bound, next(numbers), each))

    wait_for(Restriction(), planned, compared[0][1])
    tries = 0
    while waiting and tries < COMPARISON.most and left > 0:
        late = late or stop_requested() or time.monotonic() >= budget.deadline
        if late:
            break
        _, _, restriction = heapq.heappop(waiting)
        tries += 1
        outcome = plan_restricted(backend, mission, kernel, restriction, options, budget, left, moment)
        if isinstance(outcome, Ended) or (isinstance(outcome, NotFound) and outcome.reason is Reason.TIME):
            late = True
            break
        left -= outcome.report.work
        if isinstance(outcome, Planned):
            signature = signatures.of(outcome.trace)
            compared.append((outcome, signature))
            wait_for(restriction, outcome, signature)
    return _best(mission, kernel, compared, late)


def _decided(before: Restriction, signature: Signature, mission: Mission, planned: Planned) -> Iterator[Restriction]:
    return islice(restrictions(before, signature, mission, planned.trace.position, sides=False), COMPARISON.bounded)


def _bound(mission: Mission, kernel: Kernel, restriction: Restriction) -> float:
    """Lower bound on the objective over all plans of a restricted mission."""
    if mission.objective is Objective.ROBUSTNESS:
        return -math.inf
    if mission.objective is Objective.ENERGY or mission.world.flat:
        return 0.0
    bounds = lower_bounds(*restriction.applied(mission, kernel))
    return float(bounds.steps) if mission.objective is Objective.DURATION else bounds.metres


def _best(mission: Mission, kernel: Kernel, compared: list[tuple[Planned, Signature]], late: bool) -> Planned:
    """Best of the compared plans, with the total work in its report, and notes on the plans that differ from it."""
    first = compared[0][0]
    best, own = min(compared, key=lambda each: quality(mission, kernel, each[0]))
    notes = [
        f"{words[0]}: {amount(mission, kernel, each.trace)}"
        for each, signature in compared
        if each is not best and (words := differences(own, signature))
    ]
    report = replace(
        best.report,
        notes=(*best.report.notes, *([f"other options: {'; '.join(notes)}"] if notes else [])),
        seconds=first.report.seconds,
        work=sum(each.report.work for each, _ in compared),
        tried=first.report.tried,
        engine=first.report.engine,
        cut_short=CutShort.TIME
        if late and not stop_requested()
        else CutShort.SIGNAL
        if late
        else best.report.cut_short,
    )
    return replace(best, report=report) if len(compared) > 1 or late else best
