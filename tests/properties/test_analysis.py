"""How far kernel formulas look ahead, against what the formulas that they came from need."""

from __future__ import annotations

from hypothesis import given, settings

from missionc import ir
from missionc.kernel.analysis import relevance, steps_ahead
from missionc.kernel.nodes import All, Any, Until
from missionc.lower.expand import expand
from tests import reference
from tests.support.random_runs import SPAN, Case, cases, mission_of


def local(formula: ir.Formula) -> bool:
    """Whether it has no spatial operator, and no loss of agents, which may leave an operand out."""
    match formula:
        case ir.Apply(operator, operands):
            return not operator.spatial and all(map(local, operands))
        case ir.AtLeastOf(_, _, _, body) | ir.OfAgent(_, body):
            return local(body)
        case ir.Without():
            return False
        case _:
            return True


@settings(max_examples=200)
@given(cases())
def test_a_formula_in_kernel_form_looks_as_far_as_it_did_before(case: Case) -> None:
    mission = mission_of(len(case.trace.position), case.run.last, ir.Requirement("asked", case.formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    formula = kernel.requirements[0].formula
    found, meant = steps_ahead([formula])[formula], reference.ahead(case.formula)
    assert found <= meant
    if local(case.formula):
        assert found == meant


def test_what_no_step_asks_is_relevant_nowhere() -> None:
    hold, end = Any(()), All(())
    relevant = dict(relevance((Until(hold, end, 0, 0),), agents=2, last=3))
    assert not relevant[hold].any()
    assert relevant[end].tolist() == [[True, False, False, False]] * 2
