"""Headings against their meaning in ``tests/reference.py``: the monitor, roadmaps, the optimiser, and between steps."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.backends.smt.lift import lift
from missionc.backends.smt.sat.worker import SAT, CaDiCaL
from missionc.base.trace import Trace
from missionc.base.units import Steps
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.ir.kernel.normal_form import negated
from missionc.ir.language.margins.predicate_margins import margin
from missionc.ir.language.operators import by_name
from missionc.ir.lower.expand import expand
from missionc.verification.between.interval_sets import STEP, Motion
from missionc.verification.between.truth_over_time import TruthOverTime
from missionc.verification.monitoring.monitor import robustness, truth
from tests import reference
from tests.support.random_runs import MAST, SPAN, leaves, mission_of, positions, run_of, trace_of
from tests.support.small_roadmaps import asked, roadmap_of

GRID = [(x / 2, y / 2) for x in range(5) for y in range(5)]
NEAR = 1e-6
"""The reference measures angles by their cosine: nearer to a border than this it says nothing."""

angles = st.integers(-12, 12).map(lambda count: 0.37 * count)
facings = st.builds(ir.Facing, st.one_of(angles, st.just(MAST)), st.sampled_from([0.1, 0.5, 1.2, 1.7, 2.9]))
faced = facings.map(lambda predicate: ir.Holds(predicate, SPAN))


@st.composite
def traces(draw: st.DrawFn) -> Trace:
    size, steps = draw(st.integers(1, 3)), draw(st.integers(1, 5))
    trace = trace_of(draw(positions(size, steps)))
    turned = [[draw(angles) for _ in range(steps + 1)] for _ in range(size)]
    return replace(trace, heading=np.array(turned, dtype=np.float64))


@given(trace=traces(), formula=faced)
@settings(max_examples=200)
def test_the_monitor_means_what_the_reference_says(trace: Trace, formula: ir.Holds) -> None:
    mission = mission_of(len(trace.position), trace.position.shape[1] - 1, ir.Requirement("asked", formula, SPAN))
    run = run_of(mission, trace)
    kernel, _ = expand(mission)
    assert kernel is not None
    node = kernel.requirements[0].formula
    facts, margins = truth(node, mission, trace), robustness(node, mission, trace)
    for agent in range(len(run.position)):
        for step in range(run.last + 1):
            expected = reference.robustness(formula, run, agent, step)
            assert math.isclose(margins[agent, step], expected, abs_tol=NEAR)
            if abs(expected) > NEAR:
                assert facts[agent, step] == reference.truth(formula, run, agent, step)


@given(trace=traces(), predicate=facings, way=st.tuples(angles, st.sampled_from([0.01, 0.2, 1.0])))
def test_a_margin_in_metres_changes_by_no_more_than_the_agent_moves(
    trace: Trace, predicate: ir.Facing, way: tuple[float, float]
) -> None:
    mission, (aside, far) = mission_of(len(trace.position), trace.position.shape[1] - 1), way
    moved = replace(trace, position=trace.position + far * np.array([math.cos(aside), math.sin(aside)]))
    change = np.abs(margin(predicate, mission, moved) - margin(predicate, mission, trace))
    assert change.max() <= (far if isinstance(predicate.towards, ir.Beacon) else 0.0) + 1e-9


@given(data=st.data())
@settings(max_examples=80)
def test_what_a_solver_says_of_a_heading_is_so_where_the_motion_is_lifted(data: st.DataObject) -> None:
    """Both ways; of who stays and may face anywhere it says nothing, and of everything else one or the other."""
    size, steps = data.draw(st.integers(1, 2)), data.draw(st.integers(1, 4))
    places = data.draw(st.lists(st.sampled_from(GRID), min_size=3, max_size=5, unique=True))
    count = len(places)
    headings = [data.draw(st.one_of(angles, st.just(math.nan))) for _ in places]
    states = [
        data.draw(st.lists(st.integers(0, count - 1), min_size=steps + 1, max_size=steps + 1)) for _ in range(size)
    ]
    low = data.draw(st.integers(0, steps))
    window = ir.Window(Steps(low), Steps(data.draw(st.integers(low, steps))), SPAN)
    word = data.draw(st.sampled_from(["always", "eventually", "until"]))
    first, other = data.draw(faced), data.draw(st.one_of(faced, leaves(size)))
    body = ir.Apply(by_name[word], (first, other)[: by_name[word].arity], window, SPAN)
    formula = ir.OfAgent(0, body, SPAN)
    mission = mission_of(size, steps, ir.Requirement("asked", formula, SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    node = kernel.requirements[0].formula
    roadmap = replace(roadmap_of(tuple(range(size)), places, steps), heading=np.array(headings))
    made = asked(mission, (roadmap,), node, negated(node))
    trace = lift(np.array(states), made.motion.own_roadmaps, mission)
    solver = CaDiCaL()
    solver.add(made.clauses.everything().tolist())
    holds, fails = (solver.solve([*made.fixed(states), goal])[0] == SAT for goal in made.lowered.goals)
    true = bool(truth(node, mission, trace)[0, 0])
    assert true or not holds
    assert not (true and fails)
    if not any(math.isnan(heading) for heading in headings):
        assert holds != fails


@given(trace=traces(), formula=faced)
@settings(max_examples=80)
def test_between_the_steps_an_agent_faces_where_it_did_and_a_beacon_moves_past(trace: Trace, formula: ir.Holds) -> None:
    steps = trace.position.shape[1] - 1
    mission = mission_of(len(trace.position), steps, ir.Requirement("asked", ir.OfAgent(0, formula, SPAN), SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    node = kernel.requirements[0].formula
    signal = TruthOverTime(Motion(mission, motion(mission, trace), trace)).of(node)[node][0]
    meaning = reference.Meaning(run_of(mission, trace), number=True)
    assert isinstance(formula.predicate, ir.Facing)
    decided = 0
    for moment in np.linspace(0.0, steps, 16 * steps + 1):
        before = min(int(moment), steps)
        after, share = min(before + 1, steps), moment - before
        place = tuple((1 - share) * trace.position[0, before] + share * trace.position[0, after])
        heading = float(trace.heading[0, before])
        value = meaning.to_spare(place, heading, formula.predicate.towards, formula.predicate.within)
        tick = round(moment * STEP)
        sure = any(low <= tick <= high for low, high in signal.sure)
        never = any(low <= tick <= high for low, high in signal.never)
        decided += sure or never or abs(value) < 1e-3
        assert value > -NEAR or not sure
        assert value < NEAR or not never
    assert decided == 16 * steps + 1
