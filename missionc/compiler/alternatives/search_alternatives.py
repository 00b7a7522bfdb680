"""Search for alternative plans: restricted missions are planned, and the plans verified, ranked and written.

    in   a checked mission and its verified plan, the number of plans
    out  Found: plans that differ from each other (``monitoring.signature``), each verified, the best first; Compiled
         with ``alternatives``

Each attempt forbids one decision of the plans so far. The backend of the first plan plans the restricted mission with a
fraction of the work, and nothing else of that run is stored. A plan counts only if it differs from every plan before.
The best plans are verified and written against the mission itself. The attempts, and the work of each, are counted, so
that one seed gives the same plans.

Plans are ranked by the preferences that they satisfy, then by margin, then by the objective.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from typing import TypeAlias

from missionc.backends.api import Backend, Budget, Outcome, Planned, discard_plan, discard_snapshot
from missionc.backends.load import load_engines
from missionc.backends.options import Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.deadline import last_call
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.signals import stop_requested
from missionc.base.trace import Trace, counted
from missionc.compiler.alternatives.restriction import Restriction, restrictions
from missionc.compiler.certify_plan import certify_plan
from missionc.compiler.front_end import Checked, Stopwatch
from missionc.compiler.incumbent import RESERVE
from missionc.compiler.plan_request import PlanRequest, StageLog
from missionc.compiler.plan_with_margin import plan_with_margin
from missionc.compiler.redraw import plotted_of, with_attempts
from missionc.compiler.results import Alternative, Compiled, Verified
from missionc.compiler.run_limited import Ended, within
from missionc.compiler.strategy import ALTERNATIVES
from missionc.compiler.wider_margins import with_wider_margins
from missionc.ir import Mission, Objective
from missionc.ir.kernel.nodes import Kernel
from missionc.output.documents.alternatives_json import rows
from missionc.output.with_alternatives import with_alternatives as joined_files
from missionc.verification.monitoring.monitor import least_robustness, monitor
from missionc.verification.monitoring.signature import Signature, Signatures, differences

Quality: TypeAlias = tuple[tuple[bool, ...], float, float]


def quality(mission: Mission, kernel: Kernel, planned: Planned) -> Quality:
    """Rank of a plan, less is better: violated preferences (the heaviest first), missing margin, and value of the
    objective.
    """
    kept = {each.name: each.satisfied for each in monitor(mission, kernel, planned.trace).preferences}
    wishes = sorted(kernel.preferences, key=lambda each: -(each.weight or 0.0))
    unkept = tuple(not kept[each.name] for each in wishes)
    return unkept, 1.0 - planned.report.kept, objective_value(mission, kernel, planned.trace)


def objective_value(mission: Mission, kernel: Kernel, trace: Trace) -> float:
    """Value of a plan that the objective minimises; a maximised robustness is negated.

    Without an objective, it is the path length in metres.
    """
    match mission.objective:
        case Objective.ROBUSTNESS:
            return -least_robustness(mission, kernel, trace)
        case Objective.DURATION:
            return float(trace.lasts)
        case Objective.ENERGY:
            return trace.effort
        case _:
            return trace.metres


UNITS = {Objective.DURATION: "steps", Objective.ENERGY: "m^2/s^3"}


def amount(mission: Mission, kernel: Kernel, trace: Trace) -> str:
    """Text for a plan's value of the objective, with its unit."""
    return f"{abs(objective_value(mission, kernel, trace)):.6g} {UNITS.get(mission.objective, 'm')}"


def plan_restricted(
    backend: Backend,
    mission: Mission,
    kernel: Kernel,
    restriction: Restriction,
    options: Options,
    budget: Budget,
    work: float,
    moment: float,
) -> Outcome | Ended:
    """Outcome of a backend for a restricted mission.

    Args:
        work: work limit of the backend.
        moment: time of interruption, on the clock of ``time.monotonic``.
    """
    short = replace(budget, work=work, on_snapshot=discard_snapshot, resume=None, on_incumbent=discard_plan)
    narrower = restriction.applied(mission, kernel)
    return within(moment, partial(plan_with_margin, backend, *narrower, options, short))


class Candidate(Record, eq=False):
    """An alternative plan before verification; ``verified`` is set for the first plan, which is already written."""

    planned: Planned
    signature: Signature
    value: Quality
    seed: int
    verified: Verified | None = None


class Found(Record, eq=False):
    """Alternative plans with their signatures, the best first; ``note`` explains why there are fewer than requested."""

    plans: tuple[tuple[Verified, Signature], ...]
    note: str


@dataclass(slots=True, eq=False)
class _Search:
    mission: Mission
    kernel: Kernel
    signatures: Signatures
    candidates: list[Candidate] = field(default_factory=list)
    waiting: list[tuple[Quality, int, int, Restriction]] = field(default_factory=list)
    seen: set[Hashable] = field(default_factory=set)
    numbers: count[int] = field(default_factory=count)
    work: float = 0.0
    seeds: Iterator[int] = field(default_factory=lambda: iter(range(1, ALTERNATIVES.seeds + 1)))

    def add(self, planned: Planned, seed: int, restriction: Restriction, verified: Verified | None = None) -> None:
        """Add a plan and its restrictions to the search; for a plan equal to an earlier one, only its restrictions."""
        trace = planned.trace
        signature = self.signatures.of(trace)
        value = quality(self.mission, self.kernel, planned)
        if all(differences(each.signature, signature) for each in self.candidates):
            self.candidates.append(Candidate(planned, signature, value, seed, verified))
        for place, each in enumerate(restrictions(restriction, signature, self.mission, trace.position)):
            if each.key not in self.seen:
                self.seen.add(each.key)
                heapq.heappush(self.waiting, (value, place, next(self.numbers), each))

    def next_attempt(self) -> tuple[Restriction, int] | None:
        """Next restriction to plan with, and an increment of the seed; None if no attempt is left.

        Restrictions of the best plan come first. When all are tried, the unrestricted mission is planned with other
        seeds.
        """
        if self.waiting:
            return heapq.heappop(self.waiting)[-1], 0
        more = next(self.seeds, None)
        return None if more is None else (Restriction(), more)


def search_alternatives(
    checked: Checked, first: Verified, found: Verified, request: PlanRequest, watch: Stopwatch
) -> Found:
    """Verified plans that differ from each other, at most as many as requested, the best first.

    The first plan is included unless enough better plans were found.

    Args:
        checked: mission by which the first plan was verified.
        found: the first plan as found, before its margins were widened: plans are ranked as found.
    """
    wanted, options, budget = request.alternatives, request.options, request.budget
    mission, kernel = checked.valid_mission, checked.valid_kernel
    backend = load_engines((first.plan.backend,), options)
    search = _Search(mission, kernel, Signatures(mission, kernel))
    search.add(Planned(found.plan.trace, found.report), budget.seed, Restriction(), first)
    took = dict(watch.seconds)
    kept_back = (wanted + 1) * RESERVE * (took["verify"] + took["emit"])
    until = budget.deadline - min(kept_back, (budget.deadline - time.monotonic()) / 2)
    tries, late = 0, False
    while not isinstance(backend, Diagnostic) and not _enough(len(search.candidates), wanted, tries):
        late = stop_requested() or time.monotonic() >= until
        attempt = None if late else search.next_attempt()
        if attempt is None:
            break
        restriction, more = attempt
        tries += 1
        seed = budget.seed + more
        with watch.stage("alternatives"):
            planned = _planned(backend, search, restriction, options, replace(budget, deadline=until, seed=seed), found)
        if planned is not None:
            search.add(planned, seed, restriction)
    plans: list[tuple[Verified, Signature]] = []
    for each in sorted(search.candidates, key=lambda each: each.value):
        if len(plans) < wanted:
            home = each.verified or within(
                last_call(budget.deadline),
                partial(_certified, checked, each, request, budget, until, watch),
            )
            plans.extend([(home, search.signatures.of(home.plan.trace))] if isinstance(home, Verified) else [])
    if not plans:  # time was up before the better ones were written
        plans.append((first, search.candidates[0].signature))
    request.log.add("alternatives", first.plan.backend, search.work, f"{len(plans)} of {wanted} plans found")
    return Found(tuple(plans), _note(len(plans), wanted, tries, late))


def _enough(found: int, wanted: int, tries: int) -> bool:
    least, most = ALTERNATIVES.least_tries * (wanted - 1), ALTERNATIVES.tries * (wanted - 1)
    return tries >= most or (found >= wanted and tries >= least)


def _planned(
    backend: Backend, search: _Search, restriction: Restriction, options: Options, budget: Budget, first: Verified
) -> Planned | None:
    """Plan of the restricted mission; None if none is found within the work of one attempt."""
    work = ALTERNATIVES.work_after(first.report.work)
    moment = last_call(budget.deadline)
    outcome = plan_restricted(backend, search.mission, search.kernel, restriction, options, budget, work, moment)
    search.work += 0.0 if isinstance(outcome, Ended) else outcome.report.work
    if not isinstance(outcome, Planned):
        return None
    return replace(outcome, report=replace(outcome.report, engine=outcome.report.engine or backend.name))


def _certified(
    checked: Checked, candidate: Candidate, request: PlanRequest, budget: Budget, until: float, watch: Stopwatch
) -> Verified | None:
    """The plan of a candidate with wider margins if that passes every check, else as found.

    Args:
        until: end of the search for wider margins, on the clock of ``time.monotonic``.
    """
    planned, of_its_own = candidate.planned, replace(budget, seed=candidate.seed)
    runs = request.log.within("alternatives", "").so_far(planned.report.engine, planned)
    first = certify_plan(checked, planned, request.options, of_its_own, watch, request.exports, runs=runs)
    if not isinstance(first.outcome, Verified):
        return None
    own = replace(
        request.further, budget=replace(of_its_own, deadline=until), log=StageLog(list(first.outcome.plan.runs))
    )
    home = with_wider_margins(Compiled(first.checked, first.outcome, (), tuple(watch.seconds)), own).outcome
    assert isinstance(home, Verified)
    refused = request.continuous_time is ContinuousTime.REQUIRED and home.certificate.at_steps_alone
    return None if refused else home


def _note(found: int, wanted: int, tries: int, late: bool) -> str:
    if found >= wanted:
        return ""
    why = "time limit reached after" if late else "no further different plan in"
    return f"{found} of {wanted} plans found: {why} {counted(tries, 'attempt')}"


def with_alternatives(first: Compiled, found: Verified, request: PlanRequest) -> Compiled:
    """Compilation with alternative plans, at most as many as requested; the best plan is its outcome.

    A note reports a smaller number of plans.

    Args:
        found: the first plan as found, before its margins were widened.
    """
    checked, outcome = first.checked, first.outcome
    assert isinstance(outcome, Verified)
    watch = Stopwatch(list(first.seconds))
    plans_found = search_alternatives(checked, outcome, found, request, watch)
    plans = [verified for verified, _ in plans_found.plans]
    plans[0] = with_attempts(checked, plans[0], request.log)
    with watch.stage("emit"):
        table = rows(
            [signature for _, signature in plans_found.plans],
            [each.plan.trace for each in plans],
            [each.certificate for each in plans],
        )
        plots = [plotted_of(checked, each) for each in plans]
        files = joined_files(plots, [each.files for each in plans], table, request.alternatives)
    notes = (*plans[0].report.notes, *((plans_found.note,) if plans_found.note else ()))
    best = replace(plans[0], files=files, report=replace(plans[0].report, notes=notes, tried=outcome.report.tried))
    alternatives = tuple(Alternative(row, each) for row, each in zip(table, [best, *plans[1:]], strict=True))
    return replace(first, outcome=best, seconds=tuple(watch.seconds), alternatives=alternatives)
