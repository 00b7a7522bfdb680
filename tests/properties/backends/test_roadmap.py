"""What a roadmap promises, for every kind of dynamics and on the real missions, checked by dense sampling."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from missionc.backends.smt.roadmap.roadmap import NoRoadmap, Roadmap, build_roadmaps
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.frontend.resolve.resolve_mission import resolve
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import unread
from missionc.ir import DoubleIntegrator, Mission, Unicycle
from missionc.ir import Path as Motion
from missionc.ir.distances.signed_distance import signed_distance

Array = NDArray[np.float64]

MISSIONS = Path(__file__).resolve().parents[3] / "missions"
REAL = sorted([*MISSIONS.glob("strel_*.mission"), MISSIONS / "wildfire.mission"])

KINDS = {
    "flies on": ("1 s", "unicycle(speed 1..2 m/s)"),
    "may wait": ("1 s", "unicycle(speed 0..2 m/s)"),
    "turns by a right angle": ("1 s", "unicycle(speed 1..2 m/s, turn <= 90 deg/s)"),
    "turns slowly": ("1 s", "unicycle(speed 1..2 m/s, turn <= 45 deg/s)"),
    "turns slowly and may wait": ("1 s", "unicycle(speed 0..2 m/s, turn <= 60 deg/s)"),
    "has one speed": ("1 s", "unicycle(speed 1..1 m/s)"),
    "single integrator": ("1 s", "single_integrator(speed <= 1.5 m/s)"),
    "single integrator, small steps": ("0.1 s", "single_integrator(speed <= 5 m/s)"),
    "double integrator": ("1 s", "double_integrator(speed <= 2 m/s, acceleration <= 1 m/s^2)"),
    "double integrator, half steps": ("0.5 s", "double_integrator(speed <= 2 m/s, acceleration <= 2 m/s^2)"),
}

PLANE = """
mission plane
time  step {step}, horizon 20 s
world (0, 0) to (10, 8)
region   base = box (0.5, 0.5) to (3, 3)
region   pad  = disc at (8.6, 6.4) radius 0.8
region   hook = polygon (6, 1), (9.6, 1), (9.6, 2), (7, 2), (7, 3.4), (6, 3.4)
region   rest = box (3.4, 6) to (5.4, 7.6) - disc at (3.4, 7.6) radius 1 m
obstacle wall  = box (4, 0) to (4.6, 4.4)
obstacle pond  = disc at (2.4, 5.6) radius 0.7
obstacle rock  = polygon (6.4, 4.4), (8, 4.8), (6.8, 5.8) + disc at (8, 4) radius 0.3
obstacle truck = disc at (1, 4) radius 0.4 along (0 s: 0, 0), (3.3 s: 4, 0), (9 s: 4, 3)
clearance 0.1 m
separation 0.2 m
team drone[4] {{ radius 0.15 m  dynamics {dynamics}  start in base  finish in pad }}
require there: every drone: eventually[0, 20 s] (pad or hook or rest or base)
"""

VOLUME = """
mission volume
time  step {step}, horizon 20 s
world (0, 0, 0) to (6, 5, 3)
region   base = box (0.4, 0.4) to (2, 2) height 0.3..1
region   roof = ball at (5, 4, 2.3) radius 0.5 m
obstacle wall = box (2.6, 0) to (3.2, 5) height 0..1.4
obstacle mast = cylinder at (4.4, 1.4) radius 0.3 height 0..3
obstacle bulb = ball at (1.2, 3.6, 1.5) radius 0.6
obstacle lift = box (4.6, 2.4, 0) to (5.2, 3, 0.6) moving (0, 0, 0.1) m/s
team drone[3] {{ radius 0.1 m  dynamics {dynamics}  start in base }}
require there: every drone: eventually[0, 20 s] (roof or base)
"""


def resolved(text: str) -> Mission:
    program, slips = parse(Source("test.mission", text), Limits(), unread)
    assert program is not None, slips
    mission, findings = resolve(program, {}, Limits())
    assert mission is not None, [finding.message for finding in findings]
    return mission


def built(mission: Mission, nodes: int = 90, seed: int = 0) -> Roadmap:
    roadmaps = build_roadmaps(mission, nodes, 6, np.random.default_rng(seed))
    assert not isinstance(roadmaps, NoRoadmap), roadmaps.statement
    assert len(roadmaps) == 1
    return roadmaps[0]


def along(mission: Mission, roadmap: Roadmap, part: float) -> Array:
    """Where every move is after a part of its step: (moves, dim)."""
    source, target = roadmap.moves.T
    start, end = roadmap.position[source], roadmap.position[target]
    if not isinstance(mission.agents[0].dynamics, DoubleIntegrator):
        return np.asarray(start + (end - start) * part)
    before, after, time = roadmap.velocity[source], roadmap.velocity[target], part * mission.step
    return np.asarray(start + before * time + (after - before) * (time * time / (2 * mission.step)))


def moved(path: Motion, time: float) -> Array:
    return np.array([np.interp(time, path.times, axis) for axis in np.transpose(path.offsets)])


def turned(before: Array, after: Array) -> Array:
    return np.asarray(np.abs(np.angle(np.exp(1j * (after - before)))))


@pytest.fixture(
    scope="module",
    params=[*((PLANE, kind) for kind in KINDS), (VOLUME, "may wait"), (VOLUME, "double integrator")],
    ids=lambda param: f"{param[1]}, in {'the plane' if param[0] is PLANE else 'a volume'}",
)
def case(request: pytest.FixtureRequest) -> tuple[Mission, Roadmap]:
    text, kind = request.param
    step, dynamics = KINDS[kind]
    mission = resolved(text.format(step=step, dynamics=dynamics))
    return mission, built(mission)


def test_every_move_obeys_the_dynamics_in_one_step(case: tuple[Mission, Roadmap]) -> None:
    mission, roadmap = case
    dynamics, step = mission.agents[0].dynamics, mission.step
    source, target = roadmap.moves.T
    start, end = roadmap.position[source], roadmap.position[target]
    if isinstance(dynamics, DoubleIntegrator):
        before, after = roadmap.velocity[source], roadmap.velocity[target]
        assert np.allclose(end, start + (before + after) * step / 2, atol=1e-9)
        assert np.linalg.norm(after - before, axis=1).max() <= dynamics.acceleration * step + 1e-9
        assert np.linalg.norm(roadmap.velocity, axis=1).max() <= dynamics.speed + 1e-9
        return
    speed = np.linalg.norm(end - start, axis=1) / step
    assert speed.max() <= dynamics.top_speed + 1e-8
    if isinstance(dynamics, Unicycle):
        assert speed.min() >= dynamics.slowest - 1e-8
    assert not roadmap.velocity.any()


def test_every_heading_is_that_of_the_motion_that_ended_there_and_turns_little_enough(
    case: tuple[Mission, Roadmap],
) -> None:
    mission, roadmap = case
    dynamics = mission.agents[0].dynamics
    if not isinstance(dynamics, Unicycle) or dynamics.turn * mission.step >= math.pi:
        assert np.isnan(roadmap.heading).all()
        return
    source, target = roadmap.moves.T
    way = roadmap.position[target] - roadmap.position[source]
    going = np.linalg.norm(way, axis=1) > 0
    assert np.allclose(turned(np.arctan2(way[going, 1], way[going, 0]), roadmap.heading[target[going]]), 0, atol=1e-6)
    known = ~np.isnan(roadmap.heading[source])
    assert known.sum() > 100
    assert not np.isnan(roadmap.heading[target[known]]).any()
    turns = turned(roadmap.heading[source[known]], roadmap.heading[target[known]])
    assert turns.max() <= dynamics.turn * mission.step + 1e-9


def test_every_move_keeps_clear_of_what_stands_still_and_in_the_world(case: tuple[Mission, Roadmap]) -> None:
    mission, roadmap = case
    keep = mission.agents[0].radius + mission.clearance
    for part in np.linspace(0, 1, 41):
        position = along(mission, roadmap, part)
        assert np.all((position >= mission.world.low) & (position <= mission.world.high))
        for obstacle in mission.obstacles:
            if not isinstance(obstacle.motion, Motion):
                assert np.min(signed_distance(np, obstacle.shape, position)) >= keep - 1e-9, obstacle.name


def test_moves_and_places_are_open_when_moving_obstacles_are_away(case: tuple[Mission, Roadmap]) -> None:
    mission, roadmap = case
    keep = mission.agents[0].radius + mission.clearance
    mover = next(obstacle for obstacle in mission.obstacles if isinstance(obstacle.motion, Motion))
    assert isinstance(mover.motion, Motion)
    assert not roadmap.allowed.all()
    assert not roadmap.standing.all()
    for step in range(mission.steps + 1):
        gap = signed_distance(np, mover.shape, roadmap.position - moved(mover.motion, step * mission.step))
        assert np.all(gap[roadmap.standing[step]] >= keep - 1e-9)
        assert np.all(roadmap.standing[step][gap > 1.5 * keep])
    for step in range(mission.steps):
        gaps = [
            signed_distance(
                np, mover.shape, along(mission, roadmap, part) - moved(mover.motion, (step + part) * mission.step)
            )
            for part in np.linspace(0, 1, 21)
        ]
        gap = np.min(gaps, axis=0)
        assert np.all(gap[roadmap.allowed[step]] >= keep - 1e-9)
        assert np.all(roadmap.allowed[step][gap > 2 * keep])


def test_every_move_can_be_made_the_other_way_round(case: tuple[Mission, Roadmap]) -> None:
    _, roadmap = case
    if not np.isnan(roadmap.heading).all():
        pytest.skip("with headings the way back is another edge")
    state = np.concatenate([roadmap.position, roadmap.velocity], axis=1).round(6) + 0.0
    turned = np.concatenate([roadmap.position, -roadmap.velocity], axis=1).round(6) + 0.0
    there = {(*state[one], *state[other]) for one, other in roadmap.moves}
    back = {(*turned[other], *turned[one]) for one, other in roadmap.moves}
    assert back == there


def test_no_state_is_a_dead_end(case: tuple[Mission, Roadmap]) -> None:
    mission, roadmap = case
    finishing = np.unique(np.concatenate(roadmap.finishes)) if mission.agents[0].finish else np.zeros(0, dtype=int)
    stuck = np.setdiff1d(np.arange(len(roadmap.position)), roadmap.moves[:, 0])
    assert np.isin(stuck, finishing).all()


def test_agents_wait_exactly_where_speed_zero_is_allowed(case: tuple[Mission, Roadmap]) -> None:
    mission, roadmap = case
    dynamics = mission.agents[0].dynamics
    waits = roadmap.moves[roadmap.moves[:, 0] == roadmap.moves[:, 1], 0]
    resting = np.flatnonzero(~roadmap.velocity.any(axis=1))
    if isinstance(dynamics, Unicycle) and dynamics.slowest > 0:
        assert len(waits) == 0
    else:
        assert np.array_equal(waits, resting)


def test_moves_are_sorted_and_each_is_there_once(case: tuple[Mission, Roadmap]) -> None:
    _, roadmap = case
    moves = roadmap.moves
    assert np.array_equal(moves, np.unique(moves, axis=0))


def test_every_region_is_covered_and_the_agents_can_start_together(case: tuple[Mission, Roadmap]) -> None:
    assert_covered(*case)


def test_the_same_seed_gives_the_same_arrays_and_another_seed_others(case: tuple[Mission, Roadmap]) -> None:
    mission, first = case
    again, other = built(mission), built(mission, seed=1)
    for name in ("position", "velocity", "heading", "moves", "standing", "allowed"):
        assert np.array_equal(getattr(first, name), getattr(again, name), equal_nan=True)
    assert first.position.shape != other.position.shape or not np.array_equal(first.position, other.position)


@pytest.mark.parametrize("file", REAL, ids=lambda file: file.stem)
@settings(max_examples=10)
@given(seed=st.integers(0, 1000))
def test_real_missions_have_their_regions_covered(file: Path, seed: int) -> None:
    mission = resolved(file.read_text())
    roadmap = built(mission, nodes=110, seed=seed)
    assert_covered(mission, roadmap)
    assert np.isin(np.arange(len(roadmap.position)), roadmap.moves[:, 0]).all()
    assert len(roadmap.position) < 160


def assert_covered(mission: Mission, roadmap: Roadmap) -> None:
    for region in mission.regions:
        depth = -np.asarray(signed_distance(np, region.shape, roadmap.position))
        places = np.unique(roadmap.position[depth >= 0], axis=0)
        assert len(places) >= 3, region.name
        assert depth.max() >= mission.agents[0].radius, region.name
    apart = 2 * mission.agents[0].radius + mission.separation
    for start, agent in zip(roadmap.starts, mission.agents, strict=True):
        assert agent.start.region is not None
        assert np.all(signed_distance(np, agent.start.region.shape, roadmap.position[start]) <= 0)
        assert roadmap.standing[0, start].all()
        assert not roadmap.velocity[start].any()
    together: list[Array] = []
    for place in roadmap.position[roadmap.starts[0]]:
        if all(np.linalg.norm(place - other) > apart for other in together):
            together.append(place)
    assert len(together) >= len(mission.agents)
