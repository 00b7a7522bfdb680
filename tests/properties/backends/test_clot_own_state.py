"""Resources and flags in the transport backend against the reference: their values, and what is pushed on for them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.ir.language.margins.predicate_margins import margin
from tests import reference
from tests.support.random_runs import SPAN, flags_of, mission_of, own_states, positions, run_of, trace_of

torch = pytest.importorskip("torch")

from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.optimise.own_state_residuals import flag_pieces, level_groups
from missionc.backends.clot.optimise.residuals import rows
from missionc.backends.clot.paper.leaf_margins import UNLIMITED
from missionc.backends.clot.paper.motion_batch import States, team
from missionc.backends.clot.paper.robustness import Robustness
from missionc.backends.clot.settings import Spare, Weights

torch.set_num_threads(1)


@given(data=st.data())
def test_own_states_are_worth_what_the_reference_says(data: st.DataObject) -> None:
    size, steps = data.draw(st.integers(1, 3)), data.draw(st.integers(1, 6))
    trace, formula = trace_of(data.draw(positions(size, steps))), data.draw(own_states(size))
    assert isinstance(formula, ir.Holds)
    mission = mission_of(size, steps)
    number = reference.Meaning(run_of(mission, trace), number=True)
    states = States(*(torch.from_numpy(each)[None] for each in (trace.position, trace.velocity)))
    judge = Robustness(team(mission, dtype=torch.float64), states)
    for holds in (True, False):
        found = judge.atom(formula.predicate, holds)[0].expand(size, steps + 1)
        for agent in range(size):
            for step in range(steps + 1):
                expected = max(-UNLIMITED, min(UNLIMITED, number.of(formula, agent, step)))
                assert math.isclose(found[agent, step], expected if holds else -expected, abs_tol=1e-9)


@given(data=st.data())
def test_the_regions_that_a_flag_comes_down_to_are_worth_what_it_is(data: st.DataObject) -> None:
    size, steps = data.draw(st.integers(1, 3)), data.draw(st.integers(0, 6))
    trace, flag = trace_of(data.draw(positions(size, steps))), data.draw(st.sampled_from(flags_of(size)))
    if not flag.agents:
        return
    holds, mission = data.draw(st.booleans()), mission_of(size, steps)
    agent, step = data.draw(st.sampled_from(flag.agents)), data.draw(st.integers(0, steps))
    mask = np.zeros((size, steps + 1), dtype=np.bool_)
    mask[agent, step] = True
    worth = math.inf
    for region, inside, where in flag_pieces(flag, holds, mask, trace.position):
        value = margin(region, mission, trace)
        worth = min(worth, float((value if inside else -value)[where].min()))
    number = reference.Meaning(run_of(mission, trace), number=True)
    expected = number.of(ir.Holds(ir.Flagged(flag), SPAN), agent, step)
    assert math.isclose(worth, expected if holds else -expected, abs_tol=1e-9)


@given(data=st.data())
@settings(max_examples=60)
def test_what_a_level_lacks_most_is_pushed_on(data: st.DataObject) -> None:
    size, steps = data.draw(st.integers(1, 3)), data.draw(st.integers(1, 6))
    trace = trace_of(data.draw(positions(size, steps)))
    formula = data.draw(own_states(size).filter(lambda each: _of_levels_alone(each)))
    assert isinstance(formula, ir.Holds)
    assert isinstance(formula.predicate, ir.Compare)
    mission, holds = mission_of(size, steps), data.draw(st.booleans())
    agent, low = data.draw(st.integers(0, size - 1)), data.draw(st.integers(0, steps))
    mask = np.zeros((size, steps + 1), dtype=np.bool_)
    mask[agent, low:] = True
    made, spare = splines(mission), Spare()
    control = made.through(trace.position)
    asked = (formula.predicate, holds, mask, control, mission, made, Weights(), spare)
    (found,) = (rows(group, control, near=math.inf) for group in level_groups(*asked))
    number = reference.Meaning(run_of(mission, trace), number=True)
    worst = min((1 if holds else -1) * number.of(formula, agent, step) for step in range(low, steps + 1))
    fastest = mission.agents[agent].dynamics.top_speed
    used = max(each.per_metre + each.per_second / fastest for each in _read(formula.predicate))
    assert math.isclose(float(found.value.max()), spare.task - worst / used, rel_tol=1e-9, abs_tol=1e-9)
    assert len(found.arguments) <= steps + 1


def _read(predicate: ir.Compare) -> list[ir.Resource]:
    return [feature.resource for _, feature in predicate.terms if isinstance(feature, ir.Level)]


def _of_levels_alone(formula: ir.Formula) -> bool:
    predicate = formula.predicate if isinstance(formula, ir.Holds) else None
    return isinstance(predicate, ir.Compare) and all(isinstance(each, ir.Level) for _, each in predicate.terms)
