"""What planners are given in the place of formulas that look back: the same at step 0 of every run."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.units import Steps
from missionc.ir.kernel.walk import looks_back, postorder
from missionc.ir.language.operator import Bounds, Operator, TooLarge
from missionc.ir.language.operators import OPERATORS, by_name
from missionc.ir.lower.expand import expand
from missionc.ir.lower.unroll_past import looking_ahead
from missionc.verification.monitoring.monitor import robustness, truth
from tests import reference
from tests.support.random_runs import SPAN, Case, applied, as_planned, cases, mission_of

PAST = [operator for operator in OPERATORS if operator.bounds is Bounds.PAST]


def same(case: Case, formula: ir.Formula) -> None:
    mission = mission_of(len(case.trace.position), case.run.last, ir.Requirement("asked", formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    ahead = as_planned(mission, kernel, formula)
    written, planned = (each.requirements[0].formula for each in (kernel, ahead))
    assert not any(map(looks_back, postorder((planned,))))
    if reference.ahead(formula) <= case.run.last:
        for judge in (truth, robustness):
            assert judge(planned, mission, case.trace)[0, 0] == judge(written, mission, case.trace)[0, 0]


@st.composite
def past_below(draw: st.DrawFn, operator: Operator) -> Case:
    """A case whose formula has operators of the past as operands, and those operands of their own."""
    case = draw(cases(operator))
    size, formula = len(case.trace.position), case.formula
    if not isinstance(formula, ir.Apply):
        return case
    inside = tuple(draw(applied(draw(st.sampled_from(PAST)), size, 0, 2)) for _ in formula.operands)
    asked = ir.Apply(operator, inside, formula.bounds, SPAN, formula.comparison, formula.number)
    return Case(case.run, case.trace, asked)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=60)
@given(data=st.data())
def test_what_looks_back_is_worth_the_same_where_it_looks_ahead(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(past_below(operator))
    same(case, case.formula)
    same(case, ir.Apply(by_name["not"], (case.formula,), None, SPAN))


@given(cases())
def test_any_formula_is_worth_the_same_where_it_looks_ahead(case: Case) -> None:
    same(case, case.formula)


def test_a_kernel_without_the_past_stays_the_object_it_is() -> None:
    mission = mission_of(1, 3, ir.Requirement("asked", ir.Truth(True, SPAN), SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    assert looking_ahead(mission, kernel, 10) is kernel


def test_what_grows_too_large_is_said_to() -> None:
    window = ir.Window(Steps(0), Steps(40), SPAN)
    once = ir.Apply(by_name["once"], (ir.Truth(True, SPAN),), window, SPAN)
    always = ir.Apply(by_name["always"], (once,), window, SPAN)
    mission = mission_of(1, 40, ir.Requirement("asked", always, SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    found = looking_ahead(mission, kernel, 20)
    assert isinstance(found, TooLarge)
    assert found.nodes > 20
