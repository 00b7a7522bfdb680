"""Every operator's kernel form against its meaning in ``tests/reference.py``, on random small runs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.ir.kernel.nodes import Node
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS, by_name
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import robustness, truth
from tests import reference
from tests.support.random_runs import SPAN, Case, cases, mission_of, snapshots

SPATIAL = [operator for operator in OPERATORS if operator.spatial]


def expanded(case: Case, formula: ir.Formula) -> Node:
    """Its kernel form; the mission asks for it as its only requirement, whomever it is about."""
    mission = mission_of(len(case.trace.position), case.run.last, ir.Requirement("asked", formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    return kernel.requirements[0].formula


def compare(case: Case, formula: ir.Formula) -> None:
    node = expanded(case, formula)
    flags = truth(node, case.run.mission, case.trace)
    margins = robustness(node, case.run.mission, case.trace)
    assert flags.shape == margins.shape == case.trace.position.shape[:2]
    fact = reference.Meaning(case.run, number=False)
    number = reference.Meaning(case.run, number=True)
    steps = case.run.last + 1 - reference.ahead(formula)
    for agent in range(len(flags)):
        for step in range(steps):
            assert flags[agent, step] == fact.of(formula, agent, step), (agent, step)
            expected = number.of(formula, agent, step)
            assert math.isclose(margins[agent, step], expected, rel_tol=0.0, abs_tol=1e-9) or (
                margins[agent, step] == expected
            ), (agent, step, margins[agent, step], expected)
    assert np.all(flags[:, :steps][margins[:, :steps] > 1e-9])
    assert not np.any(flags[:, :steps][margins[:, :steps] < -1e-9])


def test_every_operator_has_a_meaning_in_the_reference() -> None:
    assert set(reference.MEANINGS) == {operator.name for operator in OPERATORS}


def test_operators_are_found_by_their_names() -> None:
    assert list(by_name.values()) == list(OPERATORS)
    assert all(by_name[operator.name] is operator for operator in OPERATORS)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=40)
@given(data=st.data())
def test_an_operator_means_what_the_reference_says(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(cases(operator))
    compare(case, case.formula)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=40)
@given(data=st.data())
def test_an_operator_denied_means_the_contrary(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(cases(operator))
    compare(case, ir.Apply(by_name["not"], (case.formula,), None, SPAN))


@pytest.mark.parametrize("operator", SPATIAL, ids=lambda operator: operator.name)
@given(data=st.data())
def test_a_lower_bound_means_what_the_reference_says(operator: Operator, data: st.DataObject) -> None:
    case = data.draw(snapshots(operator))
    compare(case, case.formula)


@given(cases())
def test_any_formula_means_what_the_reference_says(case: Case) -> None:
    compare(case, case.formula)
