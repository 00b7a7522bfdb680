"""What a backend is asked for, in which order, and what is said of the plan that comes of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from missionc.backends.api import Budget, CutShort, Impossible, NotFound, Outcome, Planned, Reason, Report
from missionc.backends.options import Options
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.pipeline.front_end import check
from missionc.pipeline.plan_with_margin import plan_with_margin
from tests.support.small_missions import SMALL

STILL = np.zeros((2, 7, 2))
PLAN = Planned(Trace(Seconds(1.0), STILL, STILL, STILL[..., 0]), Report())
LATE = NotFound(Reason.TIME, "", Report())
REFUSED = Impossible(("visit",), "", Report())


@dataclass
class Told:
    """A backend that answers what it is told to, and remembers what it was asked."""

    answers: list[Outcome]
    asked: list[float] = field(default_factory=list)
    name: str = "told"

    def plan(self, mission: Mission, kernel: Kernel, options: Options, budget: Budget) -> Outcome:
        self.asked.append(budget.deadline)
        return self.answers[len(self.asked) - 1]


@pytest.mark.parametrize(
    ("answers", "cut_short"),
    [
        ([PLAN], None),
        ([REFUSED, PLAN], None),
        ([REFUSED, REFUSED, PLAN], None),
        ([LATE, PLAN], CutShort.TIME),
        ([LATE, REFUSED, PLAN], CutShort.TIME),
        ([REFUSED, LATE, PLAN], CutShort.TIME),
    ],
)
def test_a_plan_after_a_try_that_time_ended_is_cut_short(answers: list[Outcome], cut_short: CutShort | None) -> None:
    checked = check(Source("small.mission", SMALL))
    assert checked.mission is not None
    assert checked.kernel is not None
    backend = Told(answers)
    found = plan_with_margin(backend, checked.mission, checked.kernel, Options(margin=0.05), Budget(deadline=1e9))
    assert isinstance(found, Planned)
    assert found.report.cut_short is cut_short
    assert len(backend.asked) == len(answers)
    assert backend.asked[-1] == 1e9 or len(answers) < 3
