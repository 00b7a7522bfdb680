"""A backend asked within the limits of a compilation: its answer, or the best plan that it had when a limit came.

in   a backend, Mission, Kernel, Options, Budget
out  its Outcome
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial

from missionc.backends.api import (
    Backend,
    Budget,
    CutShort,
    NotFound,
    Outcome,
    Planned,
    Progress,
    Report,
    UnusableSnapshot,
)
from missionc.backends.options import Options
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.pipeline.certify_plan import to_draw
from missionc.pipeline.incumbent import CUT_SHORT, Incumbent
from missionc.pipeline.plan_with_margin import plan_with_margin
from missionc.pipeline.run_limited import Ended, within

KEPT_BACK = 0.25
"""The share kept back from a search that refuses nothing, and so may take all the time: for why it found no plan."""


def ask_backend(
    backend: Backend,
    mission: Mission,
    kernel: Kernel,
    options: Options,
    budget: Budget,
    explain_limit: Seconds,
    moment: float,
    incumbent: Incumbent,
    covers: bool = True,
    calm: float = 1.0,
) -> Outcome:
    """A backend's answer; the last plan that it had, if a limit or a defect ended the search for a better one.

    Args:
        incumbent: receives each plan that the search goes on to improve.

    Raises:
        UnusableSnapshot: the run to be resumed cannot be.
    """
    now = Progress("lower")

    def listen(progress: Progress) -> None:
        nonlocal now
        now = progress
        budget.listen(progress)
        incumbent.look()

    until = _to_search(budget.deadline, to_draw(explain_limit) if backend.refutes else explain_limit)
    asked_of = replace(budget, deadline=until, listen=listen, found=incumbent.found)
    work = partial(plan_with_margin, backend, mission, kernel, options, asked_of, covers=covers, calm=calm)
    try:
        answer = within(moment, work)
    except UnusableSnapshot:
        raise
    except Exception as error:
        if incumbent.latest is None:
            raise
        incumbent.failed("improving the plan", error)
        return _cut_short(incumbent.latest, CutShort.DEFECT)
    if incumbent.latest and isinstance(answer, Ended | NotFound):
        return _cut_short(incumbent.latest, CUT_SHORT.get(answer.reason, CutShort.UNFINISHED))
    return not_found(answer, now) if isinstance(answer, Ended) else answer


def _cut_short(plan: Planned, why: CutShort) -> Planned:
    return replace(plan, report=replace(plan.report.noting(why.note), cut_short=why))


def not_found(ended: Ended, now: Progress) -> NotFound:
    """A limit came before there was a plan, or a candidate for one; with the stage that was under way."""
    engine = f" of the backend `{now.engine}`" if now.engine else ""
    which = f" (round {now.round})" if now.round > 1 else ""
    return NotFound(ended.reason, f"{ended.during(now.stage)}{engine}{which}; no candidate was finished", Report())


def _to_search(deadline: float, explain_limit: Seconds) -> float:
    """Until when a search goes on that nothing but a plan or the deadline ends: some time is left to explain it."""
    return deadline - min(explain_limit, KEPT_BACK * max(0.0, deadline - time.monotonic()))
