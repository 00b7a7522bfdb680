"""What is forecast by the plan is what the offline monitor says of the motion that was flown and the plan after it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.trace import Trace
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.language.operator import Operator
from missionc.ir.language.operators import OPERATORS
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.live.samples import StepState
from missionc.verification.monitoring.live.session import PlanForecast
from missionc.verification.monitoring.monitor import monitor
from tests.support.random_runs import SPAN, Case, cases


def asked(case: Case) -> tuple[ir.Mission, Kernel]:
    mission = case.run.mission
    everybody = ir.AgentSet("drone", tuple(range(len(mission.agents))), SPAN)
    wanted = ir.AtLeastOf("every", len(mission.agents), everybody, case.formula, SPAN)
    mission = replace(mission, requirements=(ir.Requirement("0", wanted, SPAN),))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    return mission, kernel


def check(case: Case, seed: int) -> None:
    """What is forecast along a run that keeps near its plan, with samples missing, is what the monitor says."""
    mission, kernel = asked(case)
    generator = np.random.default_rng(seed)
    plan = case.trace
    flown = plan.position + generator.uniform(-1, 1, plan.position.shape)
    forecast = PlanForecast(mission, kernel, plan)
    together = plan.position.copy(), plan.velocity.copy()
    for step in range(case.run.last + 1):
        velocity = generator.uniform(-1, 1, plan.position[:, 0].shape)
        missing = tuple(np.flatnonzero(generator.integers(0, 4, len(mission.agents)) == 0).tolist())
        seen = [agent for agent in range(len(mission.agents)) if agent not in missing]
        together[0][seen, step], together[1][seen, step] = flown[seen, step], velocity[seen]
        state = StepState(step, flown[:, step], velocity, plan.heading[:, step], np.zeros(len(mission.agents)), missing)
        if generator.integers(0, 4) == 0:
            assert forecast.take(state, []) == {}
            continue
        margins = forecast.take(state, [0])
        expected = monitor(mission, kernel, Trace(plan.step, *together, plan.heading))
        assert margins[0] == pytest.approx(expected.requirements[0].robustness, abs=1e-9)
    assert plan.position is case.trace.position


@given(cases(), st.integers(0, 2**32 - 1))
def test_a_forecast_is_the_verdict_on_what_was_flown_and_the_rest_of_the_plan(case: Case, seed: int) -> None:
    check(case, seed)


@pytest.mark.parametrize("operator", OPERATORS, ids=lambda operator: operator.name)
@settings(max_examples=5)
@given(data=st.data(), seed=st.integers(0, 2**32 - 1))
def test_so_it_is_of_every_operator(operator: Operator, data: st.DataObject, seed: int) -> None:
    check(data.draw(cases(operator)), seed)
