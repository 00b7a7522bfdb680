"""What the goals leave one agent: whatever it does within that, they hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower_motion import all_ways, lower_motion
from missionc.backends.smt.lift import lift
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.shorten.slack import EvaluatedMotion, Goals, slack
from missionc.ir.kernel.nodes import Node
from missionc.ir.kernel.normal_form import negated
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import truth
from tests.properties.backends.test_encoding import Case, cases
from tests.support.random_runs import SPAN, as_planned


def keeps(case: Case, agent: int, seed: int) -> None:
    requirement = ir.Requirement("asked", case.formula, SPAN)
    kernel, findings = expand(replace(case.mission, requirements=(requirement,)))
    assert kernel is not None, findings
    kernel = as_planned(case.mission, kernel, case.formula)
    motion = lower_motion(case.roadmaps, all_ways(case.roadmaps, {}), frozenset(), Clauses(1_000_000))
    formula: Node = kernel.requirements[0].formula
    if not truth(formula, case.mission, lift(case.states, motion.own_roadmaps, case.mission))[0, 0]:
        formula = negated(formula)
    goals = Goals((formula,), case.mission, motion, Labels(case.mission, case.roadmaps))
    evaluated = EvaluatedMotion.of(goals, case.states)
    assert evaluated.good
    room = slack(goals, agent, evaluated)
    assert room[np.arange(motion.steps + 1), case.states[agent]].all()
    generator = np.random.default_rng(seed)
    for _ in range(5):
        states = case.states.copy()
        states[agent] = [generator.choice(np.flatnonzero(row)) for row in room]
        assert truth(formula, case.mission, lift(states, motion.own_roadmaps, case.mission))[0, 0]


@given(case=cases(), agent=st.integers(0, 3), seed=st.integers(0, 1000))
@settings(max_examples=150)
def test_any_motion_within_the_leeway_keeps_the_goal(case: Case, agent: int, seed: int) -> None:
    keeps(case, agent % len(case.mission.agents), seed)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@given(data=st.data(), seed=st.integers(0, 1000))
@settings(max_examples=15)
def test_any_motion_within_the_leeway_keeps_every_operator(operator: Operator, data: st.DataObject, seed: int) -> None:
    case = data.draw(cases(operator))
    keeps(case, seed % len(case.mission.agents), seed)
