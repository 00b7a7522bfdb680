"""Constraints of recorded flights: a legal motion satisfies all, and one planted violation is found alone."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from missionc import ir
from missionc.base.constraint import Constraint, all_satisfied
from missionc.base.trace import Trace
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.verification.monitoring.live.session import Breach, Session
from missionc.verification.plan.clearances import check_separation
from missionc.verification.plan.starts_and_finishes import check_world
from missionc.verification.recorded.constraint_judge import LiveConstraints, judge_constraints
from tests.support.legal_plans import NOTHING, SPAN, mission_of, moved, moving, pushed, still, straight, wandering
from tests.support.motions_with_missions import Planned, under_way

AGENTS, STEPS = 3, 6
JUST = 0.01
"""By how much a limit is set too low."""
BARE = ("velocity", "heading")

Expected: TypeAlias = tuple[ir.Mission, Trace, tuple[str, tuple[str, ...], str], int]
"""A mission, a motion, which constraint it violates, and the step at which it does so most."""

Plant: TypeAlias = Callable[[ir.Mission, Trace, int, int], Expected]


def live(mission: ir.Mission, trace: Trace) -> tuple[tuple[Constraint, ...], list[Breach]]:
    """The verdicts of a session that is fed the trace, line by line, and what it reports on the way."""
    constraints = LiveConstraints(mission)
    session = Session(mission, NOTHING, constraints=constraints)
    breaches = []
    for step in range(trace.position.shape[1]):
        for agent in mission.agents:
            row = agent.index, step
            record = {"t": step * trace.step, "agent": agent.name, "position": trace.position[row].tolist()}
            record |= {} if "velocity" in trace.derived else {"velocity": trace.velocity[row].tolist()}
            record |= {} if "heading" in trace.derived else {"heading": float(trace.heading[row])}
            breaches += [each for each in session.feed(json.dumps(record)) if isinstance(each, Breach)]
    breaches += [each for each in session.finish() if isinstance(each, Breach)]
    return constraints.constraints(), breaches


@given(under_way(), st.booleans(), st.booleans())
@settings(max_examples=25)
def test_a_legal_motion_satisfies_all_constraints(planned: Planned, recorded: bool, continuous: bool) -> None:
    trace = planned.trace if recorded else replace(planned.trace, derived=BARE)
    found, _ = judge_constraints(planned.mission, trace, between=motion(planned.mission, trace) if continuous else None)
    assert all_satisfied(found), [each for each in found if not each.satisfied]
    assert all(each.margin >= -each.tolerance and each.since is None for each in found)
    if not continuous:
        assert live(planned.mission, trace) == (found, [])
        return
    curves = motion(planned.mission, trace)
    checks = [check_world(planned.mission, curves), *check_separation(planned.mission, curves)]
    for check in checks:
        (same,) = (each for each in found if each.name == check.name)
        assert (same.margin, same.agents) == (pytest.approx(check.margin, abs=2e-5, rel=1e-3), check.agents)


@cache
def legal(seed: int, momentum: bool) -> tuple[ir.Mission, Trace]:
    """A motion in a cube whose mission leaves room everywhere."""
    generator = np.random.default_rng(seed)
    if momentum:
        starts = np.array([[10.0, 10.0, 10.0], [20.0, 20.0, 20.0], [30.0, 30.0, 30.0]])
        trace = pushed(starts, np.zeros_like(starts), generator.uniform(-0.2, 0.2, (AGENTS, STEPS, 3)), 1.0)
    else:
        trace = straight(wandering(seed, AGENTS, STEPS, 3, need=0.5))
    dynamics = ir.DoubleIntegrator(100.0, 100.0) if momentum else ir.Unicycle(0.0, 100.0, math.inf)
    size = 40.0 if momentum else 10.0
    mission = mission_of(trace.position[:, 0].tolist(), STEPS, dynamics=dynamics, separation=0.1, size=size)
    return mission, replace(trace, derived=("heading",))  # a climb has no heading that a level move has


def limited(mission: ir.Mission, agent: int, **changes: object) -> ir.Mission:
    """The mission with one agent changed."""
    agents = list(mission.agents)
    agents[agent] = replace(agents[agent], **changes)  # type: ignore[arg-type]
    return replace(mission, agents=tuple(agents))


def worst(values: np.ndarray) -> tuple[float, int]:  # type: ignore[type-arg]
    """The largest value, which is larger than all others by more than a limit is set too low, and where it is."""
    order = np.sort(values)
    assume(values.size == 1 or order[-1] - order[-2] > 2 * JUST)
    return float(order[-1]) - JUST, int(values.argmax())


def name_of(agent: int) -> str:
    return f"drone[{agent}]"


def of(name: str, agent: int, obstacle: str = "") -> tuple[str, tuple[str, ...], str]:
    return name, (name_of(agent),), obstacle


def together(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    other = (agent + 1) % AGENTS
    by = trace.position[other, step] - trace.position[agent, step] + [0.05, 0.0, 0.0]
    first, second = sorted((agent, other))
    return mission, moved(trace, agent, step, by), ("separation", (name_of(first), name_of(second)), ""), step


def in_obstacle(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    place = trace.position[agent, step]
    ball = ir.Ball(tuple(place.tolist()), 0.05)
    assume(np.sort(np.linalg.norm(trace.position - place, axis=-1), axis=None)[1] > 0.2)
    return replace(mission, obstacles=(still(ball),)), trace, of("clearance", agent, "wall"), step


def in_moving_obstacle(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    """It is below the world but for the moment at which it is where the agent is."""
    place = trace.position[agent, step]
    assume(np.sort(np.linalg.norm(trace.position[:, step] - place, axis=-1))[1] > 0.4)
    ball = ir.Ball((*place[:2].tolist(), -20.0), 0.2)
    times = [step - 0.5, float(step), step + 0.5]
    offsets = [(0.0, 0.0, 0.0), (0.0, 0.0, 20.0 + place[2]), (0.0, 0.0, 0.0)]
    return replace(mission, obstacles=(moving(ball, times, offsets),)), trace, of("clearance", agent, "truck"), step


def in_growing_obstacle(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    """It reaches the agent that is nearest to it in the end, and nobody else, at the last step."""
    centre = (20.0, 20.0, 20.0)
    apart = np.linalg.norm(trace.position - np.array(centre), axis=-1)
    free = np.sort(apart[:, -1])
    assume(free[1] - free[0] > 0.1)
    growth = (free[0] - 0.1 - 1.0 + 0.05) / STEPS
    assume(bool((apart[:, :-1] - 1.1 - growth * np.arange(STEPS) > 0).all()))
    obstacle = replace(still(ir.Ball(centre, 1.0)), growth=growth)
    nearest = int(apart[:, -1].argmin())
    return replace(mission, obstacles=(obstacle,)), trace, of("clearance", nearest, "wall"), STEPS


def outside(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    by = [-0.3 - trace.position[agent, step, 0], 0.0, 0.0]
    return mission, moved(trace, agent, step, by), of("world", agent), step


def too_fast(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    most, at = worst(np.linalg.norm(np.diff(trace.position[agent], axis=0), axis=-1))
    return limited(mission, agent, dynamics=ir.Unicycle(0.0, most, math.inf)), trace, of("speed", agent), at + 1


def too_slow(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    least, at = worst(-np.linalg.norm(np.diff(trace.position[agent], axis=0), axis=-1))
    dynamics = ir.Unicycle(-least, 100.0, math.inf)
    return limited(mission, agent, dynamics=dynamics), trace, of("lowest speed", agent), at + 1


def too_sharp(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    moves = np.diff(trace.position[agent, :, :2], axis=0)
    assume(bool((np.abs(moves).max(axis=1) > 0).all()))
    change = np.abs(np.diff(np.arctan2(moves[:, 1], moves[:, 0])))
    most, at = worst(np.minimum(change, 2 * math.pi - change))
    return limited(mission, agent, dynamics=ir.Unicycle(0.0, 100.0, most)), trace, of("turn", agent), at + 2


def too_high(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    most, at = worst(trace.position[agent, :, 2])
    vehicle = replace(ir.PLAIN, height=ir.Band(0.0, most))
    return limited(mission, agent, vehicle=vehicle), trace, of("height", agent), at


def climbing(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    most, at = worst(np.abs(np.diff(trace.position[agent, :, 2])))
    vehicle = replace(ir.PLAIN, vertical_speed=most)
    return limited(mission, agent, vehicle=vehicle), trace, of("vertical speed", agent), at + 1


def over_the_fence(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    room, at = worst(-np.minimum(trace.position[agent], 10.0 - trace.position[agent]).min(axis=-1))
    return limited(mission, agent, vehicle=replace(ir.PLAIN, fence_inset=-room)), trace, of("fence", agent), at


def pushed_hard(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    mission, trace = legal(agent * 10 + step, True)
    most, at = worst(np.linalg.norm(np.diff(trace.velocity[agent], axis=0), axis=-1))
    return limited(mission, agent, dynamics=ir.DoubleIntegrator(100.0, most)), trace, of("acceleration", agent), at + 1


def pushed_between(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    """Without velocities, from one move to the next."""
    mission, trace = legal(agent * 10 + step, True)
    most, at = worst(np.linalg.norm(np.diff(trace.position[agent], n=2, axis=0), axis=-1))
    mission = limited(mission, agent, dynamics=ir.DoubleIntegrator(100.0, most))
    return mission, replace(trace, derived=BARE), of("acceleration", agent), at + 2


def elsewhere_at_last(mission: ir.Mission, trace: Trace, agent: int, step: int) -> Expected:
    place = ir.InitialSet(SPAN, tuple((trace.position[agent, -1] + JUST).tolist()))
    return limited(mission, agent, finish=place), trace, of("finish", agent), STEPS


PLANTS = (
    together,
    in_obstacle,
    in_moving_obstacle,
    in_growing_obstacle,
    outside,
    too_fast,
    too_slow,
    too_sharp,
    too_high,
    climbing,
    over_the_fence,
    pushed_hard,
    pushed_between,
    elsewhere_at_last,
)


@pytest.mark.parametrize("plant", PLANTS)
@given(st.integers(0, 7), st.integers(0, AGENTS - 1), st.integers(1, STEPS))
@settings(max_examples=8)
def test_one_planted_violation_is_found_alone(plant: Plant, seed: int, agent: int, step: int) -> None:
    mission, trace, expected, at = plant(*legal(seed, False), agent, step)
    found, _ = judge_constraints(mission, trace)
    violated = [each for each in found if each.satisfied is False]
    assert [(each.name, each.agents, each.obstacle, each.step) for each in violated] == [(*expected, at)]
    assert violated[0].margin < -violated[0].tolerance
    indices = [int(name[len("drone[") : -1]) for name in violated[0].agents]
    assert np.allclose(violated[0].position, trace.position[indices, at])
    flown, breaches = live(mission, trace)
    assert flown == found
    assert [(each.step, each.constraint.name, each.constraint.agents) for each in breaches] == [
        (round((violated[0].since or 0.0) / mission.step), violated[0].name, violated[0].agents)
    ]
    between, _ = judge_constraints(mission, trace, between=motion(mission, trace))
    assert {(each.name, each.agents, each.obstacle) for each in between if each.satisfied is False} >= {expected}


@given(st.integers(0, 7), st.floats(0.0, 0.3), st.integers(0, 1000))
@settings(max_examples=15)
def test_the_tolerance_allows_what_measuring_so_badly_can_do(seed: int, error: float, noise: int) -> None:
    """Positions that are off by up to the tolerance do not violate what the true ones satisfy just."""
    mission, trace = legal(seed, False)
    speeds = np.linalg.norm(np.diff(trace.position, axis=1), axis=-1)
    tight = replace(
        mission, separation=Metres(0.3), world=replace(mission.world, low=tuple(trace.position.min((0, 1))))
    )
    fast = ir.Unicycle(float(speeds.min()), float(speeds.max()), math.inf)
    tight = replace(tight, agents=tuple(replace(each, dynamics=fast) for each in tight.agents))
    assert all_satisfied(judge_constraints(tight, trace)[0])
    shift = np.random.default_rng(noise).normal(size=trace.position.shape)
    shift *= error / np.linalg.norm(shift, axis=-1, keepdims=True)
    measured = replace(straight(trace.position + shift), derived=BARE)
    assert all_satisfied(judge_constraints(tight, measured, tolerance=error)[0])
