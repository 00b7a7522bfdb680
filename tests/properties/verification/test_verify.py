"""A plan that was tampered with does not pass, wherever and however that happened."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.source import Source
from missionc.base.trace import Plan, Trace
from missionc.base.units import Metres
from missionc.compiler import driver
from missionc.compiler.results import Verified
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.ir.kernel.nodes import Kernel
from missionc.output.folder.file_names import file_names
from missionc.verification.monitoring.read_trace import read_trace
from missionc.verification.plan import clearances
from missionc.verification.plan.clearances import check_obstacles
from missionc.verification.plan.conservative_advancement import least
from missionc.verification.plan.obstacle_bodies import solid
from missionc.verification.verify_plan import verify, verify_polynomials
from tests.support.legal_plans import NOTHING, mission_of, moved, moving, still, straight, wandering

ROOT = Path(__file__).resolve().parents[3]
AGENTS, STEPS = 4, 8


@cache
def legal(seed: int) -> tuple[ir.Mission, Trace]:
    position = wandering(seed, AGENTS, STEPS)
    dynamics = ir.Unicycle(0.0, 1.5, math.inf)
    return mission_of(position[:, 0].tolist(), STEPS, dynamics=dynamics, separation=0.09), straight(position)


plans = st.integers(0, 7).map(legal)
agents = st.integers(0, AGENTS - 1)


@given(plans)
def test_a_legal_plan_passes(plan: tuple[ir.Mission, Trace]) -> None:
    mission, trace = plan
    certificate = verify(mission, NOTHING, trace)
    assert certificate.passed, certificate.failures


@given(plans, st.integers(0, 1_000), st.booleans())
def test_who_is_far_from_an_obstacle_need_not_be_looked_at(
    plan: tuple[ir.Mission, Trace], seed: int, moves: bool
) -> None:
    """The least clearance is the same, whoever is looked at first."""
    mission, trace = plan
    generator = np.random.default_rng(seed)
    corner = generator.uniform(0, 8, 2)
    shape = ir.Box(tuple(corner.tolist()), tuple((corner + generator.uniform(0.1, 2, 2)).tolist()))
    obstacle = moving(shape, [0.0, 4.0, 8.0], [(0.0, 0.0), (3.0, -1.0), (0.0, 0.0)]) if moves else still(shape)
    mission = replace(mission, obstacles=(obstacle,))
    curves = motion(mission, trace)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(clearances, "NEAREST", 1)
        (one,) = check_obstacles(mission, curves)
    (every,) = check_obstacles(mission, curves)
    assert one.margin == pytest.approx(every.margin, abs=2e-6 + 2e-3 * abs(every.margin))
    assert one.passed is every.passed


@given(plans, agents, st.integers(0, STEPS), st.floats(0, 2 * math.pi), st.floats(1e-5, 3.0))
def test_an_agent_that_is_elsewhere_at_one_step_is_noticed(
    plan: tuple[ir.Mission, Trace], agent: int, step: int, direction: float, far: float
) -> None:
    mission, trace = plan
    by = [far * math.cos(direction), far * math.sin(direction)]
    assert not verify(mission, NOTHING, moved(trace, agent, step, by)).passed


@given(plans, agents, agents)
def test_two_agents_in_each_others_place_are_noticed(plan: tuple[ir.Mission, Trace], one: int, other: int) -> None:
    mission, trace = plan
    order = np.arange(AGENTS)
    order[[one, other]] = order[[other, one]]
    swapped = Trace(trace.step, trace.position[order], trace.velocity[order], trace.heading[order])
    assert verify(mission, NOTHING, swapped).passed is (one == other)


@given(plans, st.integers(0, STEPS - 1))
def test_a_step_that_comes_twice_is_noticed(plan: tuple[ir.Mission, Trace], step: int) -> None:
    mission, trace = plan
    order = np.r_[0 : step + 1, step:STEPS]
    repeated = Trace(trace.step, trace.position[:, order], trace.velocity[:, order], trace.heading[:, order])
    assert not verify(mission, NOTHING, repeated).passed


@given(plans, st.integers(1, STEPS))
def test_a_plan_shifted_in_time_is_noticed(plan: tuple[ir.Mission, Trace], by: int) -> None:
    mission, trace = plan
    order = np.minimum(np.arange(STEPS + 1) + by, STEPS)
    late = straight(trace.position[:, order])
    assert "start" in {check.name for check in verify(mission, NOTHING, late).failures}


@given(plans, st.floats(1.01, 5.0))
def test_a_plan_for_slower_time_is_too_fast(plan: tuple[ir.Mission, Trace], factor: float) -> None:
    mission, trace = plan
    fastest = float(np.linalg.norm(trace.velocity, axis=-1).max())
    slow = ir.SingleIntegrator(fastest / factor)
    limited = replace(mission, agents=tuple(replace(agent, dynamics=slow) for agent in mission.agents))
    failures = verify(limited, NOTHING, trace).failures
    assert {check.name for check in failures} == {"speed"}


@given(plans, st.floats(1e-4, 2.0))
def test_bodies_that_need_more_room_than_there_is_are_noticed(plan: tuple[ir.Mission, Trace], more: float) -> None:
    mission, trace = plan
    margin = next(check.margin for check in verify(mission, NOTHING, trace).checks if check.name == "separation")
    wider = replace(mission, separation=Metres(mission.separation + margin + more))
    assert {check.name for check in verify(wider, NOTHING, trace).failures} == {"separation"}


@cache
def real(name: str) -> tuple[ir.Mission, Kernel, Plan, dict[str, bytes]]:
    compiled = driver.compile(ROOT / "missions" / f"{name}.mission")
    assert isinstance(compiled.outcome, Verified)
    mission, kernel = compiled.checked.mission, compiled.checked.kernel
    assert mission is not None
    assert kernel is not None
    return mission, kernel, compiled.outcome.plan, dict(compiled.outcome.files)


@given(st.data())
def test_a_backends_plan_passes_and_does_not_with_one_agent_moved(data: st.DataObject) -> None:
    mission, kernel, plan, _ = real("strel_goal")
    trace = plan.trace
    assert verify(mission, kernel, trace).passed
    agent = data.draw(st.integers(0, len(mission.agents) - 1))
    step = data.draw(st.integers(0, mission.steps))
    direction, far = data.draw(st.floats(0, 2 * math.pi)), data.draw(st.floats(1e-5, 3.0))
    shifted = moved(trace, agent, step, [far * math.cos(direction), far * math.sin(direction)])
    assert not verify(mission, kernel, shifted).passed


def test_the_files_of_a_backends_plan_read_back() -> None:
    mission, kernel, plan, files = real("strel_goal")
    for name in ("plan.json", "trajectories.csv"):
        trace, findings = read_trace(Source(name, files[name].decode()), mission)
        assert findings == []
        assert trace is not None
        assert np.array_equal(trace.position, plan.trace.position)
        assert verify(mission, kernel, trace).passed
    names = file_names(mission.agents)
    flown = {agent.name: files[f"crazyflie/{names[agent.name]}.csv"].decode() for agent in mission.agents}
    assert verify_polynomials(mission, kernel, plan.trace, flown).passed
    first, second = mission.agents[0].name, mission.agents[1].name
    swapped = {**flown, first: flown[second], second: flown[first]}
    assert not verify_polynomials(mission, kernel, plan.trace, swapped).passed


SHAPES = st.recursive(
    st.one_of(
        st.tuples(st.floats(-2, 1), st.floats(-2, 1), st.floats(0.3, 2), st.floats(0.3, 2)).map(
            lambda box: ir.Box((box[0], box[1]), (box[0] + box[2], box[1] + box[3]))
        ),
        st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(0.3, 1.2)).map(
            lambda disc: ir.Disc((disc[0], disc[1]), disc[2])
        ),
        st.just(ir.Polygon(((-1.0, -1.0), (1.5, -0.5), (0.2, 0.1), (0.5, 1.5)))),
    ),
    lambda parts: st.tuples(st.sampled_from([ir.Union, ir.Intersection, ir.Difference]), parts, parts).map(
        lambda shape: shape[0](shape[1], shape[2])
    ),
    max_leaves=4,
)


@settings(max_examples=40)
@given(SHAPES, st.integers(0, 2**32 - 1))
def test_the_distance_to_a_body_is_that_to_its_nearest_point(shape: ir.Shape, seed: int) -> None:
    grid = np.stack(np.meshgrid(*[np.arange(-3.5, 3.5, 0.05)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    distance = solid(shape, 2)
    inside = grid[distance(grid) < 0]
    points = np.random.default_rng(seed).uniform(-3, 3, (20, 2))
    found = distance(points)
    if not len(inside):
        return
    nearest = np.linalg.norm(points[:, None] - inside, axis=-1).min(axis=-1)
    outside = found > 0
    # The grid's nearest point is never nearer than the body, and little further.
    assert (found[outside] <= nearest[outside] + 1e-9).all()
    assert (nearest[outside] - found[outside]).max(initial=0.0) <= 0.5


@settings(max_examples=40)
@given(SHAPES, st.integers(0, 2**32 - 1))
def test_the_distance_to_a_body_changes_no_faster_than_one_moves(shape: ir.Shape, seed: int) -> None:
    generator = np.random.default_rng(seed)
    first = generator.uniform(-3, 3, (200, 2))
    second = first + generator.normal(scale=0.2, size=(200, 2))
    distance = solid(shape, 2)
    if np.isinf(distance(first)).all():
        return
    change = np.abs(distance(first) - distance(second))
    assert (change <= np.linalg.norm(first - second, axis=-1) + 1e-6).all()


@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3), st.floats(0.1, 3.0))
def test_the_proved_bound_is_below_every_value_and_near_the_least(waves: list[float], duration: float) -> None:
    def margin(item: np.ndarray, local: np.ndarray) -> np.ndarray:
        return sum(weight * np.sin((number + 1) * local) for number, weight in enumerate(waves)) + 0.0 * item

    speed = sum(abs(weight) * (number + 1) for number, weight in enumerate(waves))
    found = least(margin, np.array([speed]), np.array([duration]), 1e-4)
    seen = margin(np.zeros(5001), np.linspace(0, duration, 5001)).min()
    assert found.lower[0] <= seen + 1e-12
    assert found.lower[0] >= seen - 1e-4 - 1e-3 * max(seen, 0.0) - speed * duration / 5000
    assert found.upper[0] == pytest.approx(float(margin(np.zeros(1), found.at)[0]))
