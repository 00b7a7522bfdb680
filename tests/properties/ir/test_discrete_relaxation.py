"""What a roadmap is asked for follows from the mission: whatever has all of it has that."""

from __future__ import annotations

import pytest
from hypothesis import given, settings

from missionc import ir
from missionc.ir.kernel.nodes import Goal
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import truth
from tests import reference
from tests.support.random_runs import SPAN, Case, as_planned, cases, mission_of

pytest.importorskip("torch")

from missionc.backends.hybrid.backend import discrete


def truths(case: Case, formula: ir.Formula) -> tuple[bool, list[bool], bool]:
    """Of the formula, of what is asked of a roadmap, and whether that is all of the formula."""
    mission = mission_of(len(case.trace.position), case.run.last, ir.Requirement("asked", formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    kernel = as_planned(mission, kernel, formula)
    asked = discrete(kernel, case.run.last, case.run.last)

    def holds(goal: Goal) -> bool:
        return bool(truth(goal.formula, mission, case.trace)[0, 0])

    return holds(kernel.requirements[0]), [holds(goal) for goal in asked.kernel.requirements], bool(asked.whole)


@settings(max_examples=200)
@given(cases())
def test_what_is_asked_of_a_roadmap_follows_from_the_formula_and_from_its_negation(case: Case) -> None:
    if reference.ahead(case.formula) > case.run.last:
        return
    from missionc.ir.language.operators import by_name

    for formula in (case.formula, ir.Apply(by_name["not"], (case.formula,), None, SPAN)):
        wanted, asked, whole = truths(case, formula)
        if wanted:
            assert all(asked)
        if whole:
            assert wanted == all(asked)
