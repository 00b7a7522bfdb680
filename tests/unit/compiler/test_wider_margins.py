"""The stage of wider margins: a wider plan replaces the first one only if it passes every check."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.api import Budget, CutShort, Planned
from missionc.base.deadline import OutOfTime
from missionc.base.diagnostics.code import IMPROVEMENT_FAILED
from missionc.base.source import Source
from missionc.compiler import driver, wider_margins
from missionc.compiler.plan_request import PlanRequest, StageLog
from missionc.compiler.results import Compiled, Verified
from missionc.compiler.wider_margins import margins_of, plan_with_wider_margins
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from tests.support.small_missions import SMALL


@cache
def first() -> Compiled:
    """A plan on a roadmap, without the stage."""
    checked = driver.check(Source("small.mission", SMALL))
    return driver.plan_once(checked, PlanRequest(Budget(time.monotonic() + 600)))


def verified(compiled: Compiled) -> Verified:
    assert isinstance(compiled.outcome, Verified), compiled.outcome
    return compiled.outcome


def widened(log: StageLog | None = None, secured: list[Compiled] | None = None) -> Compiled:
    request = PlanRequest(Budget(time.monotonic() + 600), log=log or StageLog())
    return plan_with_wider_margins(first(), replace(request, secure=(secured if secured is not None else []).append))


def test_the_wider_plan_is_verified_and_the_first_one_is_secured_before() -> None:
    log, secured = StageLog(), list[Compiled]()
    wider = widened(log, secured)
    before, after = (margins_of(each.checked, verified(each)) for each in (first(), wider))
    assert before.least < 0.15
    assert after.wider(before, 0.01)
    assert verified(wider).certificate.passed
    assert verified(wider).plan.trace.metres <= 1.1 * verified(first()).plan.trace.metres
    assert [each.outcome for each in secured] == [first().outcome]
    assert [(run.stage, run.outcome) for run in log.runs] == [("margins", "plan found"), ("verify", "passed")]


def test_a_wide_plan_stays() -> None:
    wider = widened()
    assert margins_of(wider.checked, verified(wider)).wide
    assert plan_with_wider_margins(wider, PlanRequest(Budget(time.monotonic() + 600))) is wider


def through_walls(mission: Mission, kernel: Kernel, planned: Planned, budget: Budget) -> Planned:
    """A motion that is no plan."""
    return replace(planned, trace=replace(planned.trace, position=np.zeros_like(planned.trace.position)))


def unchanged(mission: Mission, kernel: Kernel, planned: Planned, budget: Budget) -> Planned:
    """The plan after half of the work, when time was up."""
    return replace(planned, report=replace(planned.report, work=planned.report.work + 0.5, cut_short=CutShort.TIME))


def late(mission: Mission, kernel: Kernel, planned: Planned, budget: Budget) -> Planned:
    raise OutOfTime


@pytest.mark.parametrize(
    ("widen", "ended", "rows"),
    [
        (through_walls, None, ["plan found", "rejected; the plan before is kept"]),
        (unchanged, CutShort.TIME, ["no plan with wider margins found"]),
        (late, CutShort.TIME, []),
    ],
)
def test_the_first_plan_is_the_answer_if_no_wider_one_passes(
    monkeypatch: pytest.MonkeyPatch, widen: object, ended: CutShort | None, rows: list[str]
) -> None:
    monkeypatch.setattr(wider_margins, "load_widen", lambda: widen)
    log = StageLog()
    same = verified(widened(log))
    assert same.plan is verified(first()).plan
    assert same.report.cut_short is ended
    assert [run.outcome for run in log.runs] == rows


def test_a_defect_in_the_stage_is_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(mission: Mission, kernel: Kernel, planned: Planned, budget: Budget) -> Planned:
        raise ZeroDivisionError

    monkeypatch.setattr(wider_margins, "load_widen", lambda: broken)
    compiled = driver.compile(Source("small.mission", SMALL))
    assert verified(compiled).certificate.passed
    assert IMPROVEMENT_FAILED in [each.code for each in compiled.findings]
