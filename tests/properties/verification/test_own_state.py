"""Resources and flags against their meaning in ``tests/reference.py``, on random small runs and roadmaps."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.backends.smt.sat.worker import SAT, CaDiCaL
from missionc.base.units import Steps
from missionc.frontend.checks.check_resources import check_resources
from missionc.frontend.checks.free_space import FreeSpace
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.ir.kernel.normal_form import negated
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from missionc.verification.between.interval_sets import STEP, Motion
from missionc.verification.between.truth_over_time import TruthOverTime
from missionc.verification.monitoring.monitor import robustness, truth
from tests import reference
from tests.support.random_runs import (
    FIELD,
    REGIONS,
    SPAN,
    flags_of,
    mission_of,
    own_states,
    positions,
    remembering,
    resources_of,
    run_of,
    trace_of,
)
from tests.support.small_roadmaps import asked, roadmap_of

GRID = [(x / 2, y / 2) for x in range(5) for y in range(5)]


@cache
def flagged(size: int) -> st.SearchStrategy[ir.Formula]:
    return st.sampled_from(flags_of(size)).map(lambda flag: ir.Holds(ir.Flagged(flag), SPAN))


@st.composite
def runs(draw: st.DrawFn) -> tuple[reference.Run, ir.Formula]:
    size, steps = draw(st.integers(1, 3)), draw(st.integers(1, 6))
    trace = trace_of(draw(positions(size, steps)))
    return run_of(mission_of(size, steps), trace), draw(
        st.one_of(own_states(size), remembering(size, steps, own_states(size)))
    )


@given(drawn=runs())
@settings(max_examples=150)
def test_the_monitor_means_what_the_reference_says(drawn: tuple[reference.Run, ir.Formula]) -> None:
    run, formula = drawn
    mission = mission_of(len(run.position), run.last, ir.Requirement("asked", formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    node, trace = kernel.requirements[0].formula, trace_of(run.position)
    facts, margins = truth(node, mission, trace), robustness(node, mission, trace)
    for agent in range(len(run.position)):
        for step in range(run.last + 1 - reference.ahead(formula)):
            expected = reference.robustness(formula, run, agent, step)
            assert facts[agent, step] == reference.truth(formula, run, agent, step)
            assert margins[agent, step] == expected or math.isclose(margins[agent, step], expected, abs_tol=1e-9)


@given(data=st.data())
@settings(max_examples=60)
def test_a_flag_can_be_asked_of_a_solver_for_exactly_where_it_is_set(data: st.DataObject) -> None:
    size, steps = data.draw(st.integers(1, 3)), data.draw(st.integers(0, 4))
    places = data.draw(st.lists(st.sampled_from(GRID), min_size=4, max_size=7, unique=True))
    states = [data.draw(st.lists(st.integers(0, 3), min_size=steps + 1, max_size=steps + 1)) for _ in range(size)]
    formula = data.draw(remembering(size, steps, flagged(size)))
    mission = mission_of(size, steps, ir.Requirement("asked", formula, SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    node = kernel.requirements[0].formula
    made = asked(mission, (roadmap_of(tuple(range(size)), places, steps),), node, negated(node))
    run = run_of(mission, trace_of([[places[state] for state in row] for row in states]))
    solver = CaDiCaL()
    solver.add(made.clauses.everything().tolist())
    holds, fails = (solver.solve([*made.fixed(states), goal])[0] == SAT for goal in made.lowered.goals)
    assert holds == reference.truth(formula, run, 0, 0)
    assert fails != holds


@given(data=st.data())
@settings(max_examples=60)
def test_between_the_steps_a_flag_stays_and_a_resource_changes_evenly(data: st.DataObject) -> None:
    steps = data.draw(st.integers(1, 5))
    trace = trace_of(data.draw(positions(2, steps)))
    formula = data.draw(own_states(2))
    mission = mission_of(2, steps, ir.Requirement("asked", ir.OfAgent(1, formula, SPAN), SPAN))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    node = kernel.requirements[0].formula
    signal = TruthOverTime(Motion(mission, motion(mission, trace), trace)).of(node)[node][0]
    run = run_of(mission, trace)
    for spans, wanted in ((signal.sure, True), (signal.never, False)):
        for low, high in spans:
            for step in range(-(-low // STEP), high // STEP + 1):
                assert reference.truth(formula, run, 1, step) == wanted
    assert isinstance(formula, ir.Holds)
    if isinstance(formula.predicate, ir.Flagged):
        known = sum(high - low + 1 for low, high in (*signal.sure, *signal.never))
        assert known == steps * STEP + 1
        return
    terms = formula.predicate.terms
    if all(isinstance(feature, ir.Level) for _, feature in terms):
        meaning = reference.Meaning(run, number=True)
        value = np.array(
            [
                formula.predicate.constant + sum(w * meaning.feature(feature, 1, step) for w, feature in terms)
                for step in range(steps + 1)
            ]
        )
        for moment in np.linspace(0.0, steps, 8 * steps + 1):
            there = np.interp(moment, np.arange(steps + 1), value)
            tick = round(moment * STEP)
            if any(low <= tick <= high for low, high in signal.sure):
                assert there > -1e-9
            if any(low <= tick <= high for low, high in signal.never):
                assert there < 1e-9


@given(data=st.data())
@settings(max_examples=150)
def test_no_run_keeps_a_resource_of_which_check_says_that_it_runs_out(data: st.DataObject) -> None:
    size, steps = data.draw(st.integers(1, 2)), data.draw(st.integers(1, 6))
    track = data.draw(positions(size, steps))
    resource = replace(
        data.draw(st.sampled_from(resources_of(size))),
        start=data.draw(st.sampled_from([1.0, 2.0, 3.0])),
        per_metre=data.draw(st.sampled_from([0.0, 0.5, 2.0])),
        refills=data.draw(st.sampled_from([(), (ir.Refill(FIELD, 2.0),)])),
    )
    bound = ir.Holds(
        ir.Compare(((1.0, ir.Level(resource)),), data.draw(st.sampled_from([0.0, -0.5, -1.0])), False), SPAN
    )
    low = data.draw(st.integers(0, steps))
    kept = ir.Apply(
        by_name["always"], (bound,), ir.Window(Steps(low), Steps(data.draw(st.integers(low, steps))), SPAN), SPAN
    )
    place = ir.Holds(ir.Inside(data.draw(st.sampled_from(REGIONS)), False), SPAN)
    there = ir.Apply(by_name["eventually"], (place,), ir.Window(Steps(0), Steps(steps), SPAN), SPAN)
    both = ir.Apply(by_name["and"], (kept, there), None, SPAN)
    team = ir.AgentSet("drone", tuple(range(size)), SPAN)
    formula = ir.AtLeastOf("every", size, team, data.draw(st.sampled_from([kept, both])), SPAN)
    mission = mission_of(size, steps, ir.Requirement("asked", formula, SPAN))
    agents = tuple(
        replace(agent, start=ir.InitialSet(SPAN, track[agent.index][0]), dynamics=ir.SingleIntegrator(3.0))
        for agent in mission.agents
    )
    mission = replace(mission, agents=agents, resources=(resource,))
    kernel, findings = expand(mission)
    assert kernel is not None, findings
    run = run_of(mission, trace_of(track))
    assume(all(math.hypot(*velocity) <= 3.0 for agent in run.velocity for velocity in agent))
    if reference.truth(formula, run, 0, 0):
        assert check_resources(mission, kernel, FreeSpace.of(mission)) == []
