"""A backend asked within the limits of a compilation: its answer, or the best plan that it had when a limit came.

in   a backend, Mission, Kernel, Options, Budget
out  its Outcome
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial

from missionc.backends.api import Backend, Budget, CutShort, NotFound, Outcome, Planned, Progress, Reason, Report
from missionc.backends.options import Options
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.pipeline.certify_plan import to_draw
from missionc.pipeline.plan_with_margin import plan_with_margin
from missionc.pipeline.run_limited import Ended, within

KEPT_BACK = 0.25
"""The share kept back from a search that refuses nothing, and so may take all the time: for why it found no plan."""

CUT_SHORT = {Reason.TIME: CutShort.TIME, Reason.MEMORY: CutShort.MEMORY}


def ask_backend(
    backend: Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: Budget,
    explain_limit: Seconds,
    moment: float,
    covers: bool = True,
    calm: float = 1.0,
) -> Outcome:
    """A backend's answer; the last plan that it had, where a limit ended the search for a better one.

    Raises:
        UnusableSnapshot: the run that is to go on cannot.
    """
    plans: list[Planned] = []
    stage = "lower"

    def listen(progress: Progress) -> None:
        nonlocal stage
        stage = progress.stage
        budget.listen(progress)

    until = _to_search(budget.deadline, to_draw(explain_limit) if backend.refutes else explain_limit)
    asked_of = replace(budget, deadline=until, listen=listen, found=plans.append)
    answer = within(
        moment, partial(plan_with_margin, backend, mission, kernel, options, asked_of, covers=covers, calm=calm)
    )
    if plans and isinstance(answer, Ended | NotFound) and answer.reason in CUT_SHORT:
        return _cut_short(plans[-1], CUT_SHORT[answer.reason])
    return not_found(answer, stage) if isinstance(answer, Ended) else answer


def _cut_short(plan: Planned, why: CutShort) -> Planned:
    report = plan.report
    return replace(plan, report=replace(report, notes=(*report.notes, why.note), cut_short=why))


def not_found(ended: Ended, stage: str) -> NotFound:
    """A limit came before there was a plan. Which stage was under way when time ended depends on the machine alone."""
    timed = ended.reason is Reason.TIME
    return NotFound(ended.reason, ended.reason.value if timed else ended.during(stage), Report())


def _to_search(deadline: float, explain_limit: Seconds) -> float:
    """Until when a search goes on that nothing but a plan or the deadline ends: some time is left to explain it."""
    return deadline - min(explain_limit, KEPT_BACK * max(0.0, deadline - time.monotonic()))
