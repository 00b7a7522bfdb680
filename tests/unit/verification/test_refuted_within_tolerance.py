"""What verification of a plan lets pass, no certificate of impossibility rules out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array, Trace
from missionc.base.units import Metres, Seconds
from missionc.ir.kernel.nodes import Goal, Kernel
from missionc.ir.lower.expand import expand
from missionc.verification.impossibility.bodies import blocked, lies_in
from missionc.verification.impossibility.check_bodies import CheckedLabels
from missionc.verification.impossibility.check_motion import check_turns, gone, limits_of, reached
from missionc.verification.impossibility.cover_document import CellsOfKind, ClaimedCover
from missionc.verification.impossibility.intervals import must_be_apart
from missionc.verification.verify_plan import verify
from tests.support import random_runs
from tests.support.forged_covers import followed
from tests.support.legal_plans import mission_of, still, straight
from tests.support.random_runs import SPAN

pysat = pytest.importorskip("pysat.solvers")

NOTHING = ClaimedCover((), (), False, (), {}, {}, {}, (), {}, ())
OFF = 0.9e-6
"""Just less than a state may be off."""


def passes(mission: ir.Mission, trace: Trace, *goals: Goal) -> bool:
    return verify(mission, Kernel(goals, ()), trace).passed


def at(point: Array) -> tuple[Array, Array]:
    return point[None, :], point[None, :]


def test_a_body_that_ends_a_little_too_near_to_what_stands() -> None:
    places = np.array([[[1.0, 5.0], [3.0 + 6e-6, 5.0]]])
    mission = mission_of(places[:, 0].tolist(), 1, radius=0.5, dynamics=ir.SingleIntegrator(3.0))
    mission = replace(mission, obstacles=(still(ir.Box((3.5, 0.0), (5.0, 10.0))),))
    assert passes(mission, straight(places, mission.step))
    assert not blocked(mission, NOTHING, 0, 0.5, 1, at(places[0, 1])).any()


def test_bodies_that_end_a_little_too_near_to_each_other() -> None:
    velocity = np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 0.0]]])
    position = np.array([[[1.0, 5.0], [1.5, 5.0]], [[2.5 - 6e-6, 5.0], [2.5 - 6e-6, 5.0]]])
    dynamics = ir.DoubleIntegrator(2.0, 2.0)
    mission = mission_of(position[:, 0].tolist(), 1, radius=0.5, separation=0.0, dynamics=dynamics)
    assert passes(mission, Trace(mission.step, position, velocity, np.zeros((2, 2))))
    assert must_be_apart(mission, 0, 1) <= position[1, 1, 0] - position[0, 1, 0]


def drifting(steps: int) -> tuple[ir.Mission, Trace]:
    """An agent with momentum that gets further in each step than its velocities say."""
    dynamics = ir.DoubleIntegrator(0.25, 1.0)
    position = 1.0 + np.arange(steps + 1) * (0.25 + 2 * OFF)
    places = np.stack([position, np.full_like(position, 5.0)], axis=-1)[None]
    velocity = np.broadcast_to(np.array([0.25 + OFF, 0.0]), places.shape).copy()
    mission = mission_of(places[:, 0].tolist(), steps, dynamics=dynamics, radius=0.0)
    return mission, Trace(mission.step, places, velocity, np.zeros(places.shape[:2]))


def test_a_way_that_is_a_little_off_in_each_of_many_steps() -> None:
    mission, trace = drifting(20)
    assert passes(mission, trace)
    assert reached(mission.agents[0].dynamics, mission.step, 20) >= trace.position[0, -1, 0] - trace.position[0, 0, 0]


def test_a_way_that_bends_a_little_more_in_each_of_many_steps() -> None:
    steps = 8
    velocity = np.zeros((1, 2 * steps + 1, 2))
    velocity[0, :, 0] = (0.1 + OFF) * np.arange(-steps, steps + 1)
    moves = (velocity[:, 1:] + velocity[:, :-1]) / 2
    moves[0, :steps, 0] -= OFF
    moves[0, steps:, 0] += OFF
    position = np.concatenate([np.zeros((1, 1, 2)), np.cumsum(moves, axis=1)], axis=1) + 5.0
    dynamics = ir.DoubleIntegrator(1.0, 0.1)
    mission = mission_of(position[:, 0].tolist(), 2 * steps, dynamics=dynamics, radius=0.0)
    assert passes(mission, Trace(mission.step, position, velocity, np.zeros(position.shape[:2])))
    first, middle, last = (position[0, step] for step in (0, steps, 2 * steps))
    boxes = (np.array([first, middle, last]),) * 2
    never = np.zeros((3, 3, 3), dtype=np.bool_)
    never[0, 1, 2] = True
    kind = CellsOfKind((0,), boxes, 0, (boxes[0][:0], boxes[0][:0]), {}, {steps: never})
    assert list(check_turns(mission, kind, limits_of(mission, ())[0]))


def test_a_way_that_turns_a_little_more_in_each_step() -> None:
    step, turn, speed, steps = 0.5, 0.6, 80.0, 8
    heading = np.arange(steps + 1)[None] * (turn * step + OFF)
    moves = speed * step * np.stack([np.cos(heading), np.sin(heading)], axis=-1)[:, :-1]
    position = np.concatenate([np.zeros((1, 1, 2)), np.cumsum(moves, axis=1)], axis=1) + 500.0
    dynamics = ir.Unicycle(speed, speed, turn)
    mission = mission_of(position[:, 0].tolist(), steps, step=step, dynamics=dynamics, radius=0.0, size=1000.0)
    velocity = np.concatenate([moves, moves[:, -1:]], axis=1) / step
    assert passes(mission, Trace(Seconds(step), position, velocity, heading))
    assert gone(dynamics, step, steps, 2) <= math.dist(position[0, 0], position[0, -1])


def test_speeds_that_are_a_little_off() -> None:
    """At the last step the speed is what the trace says it is, which may be off in its turn."""
    position = np.array([[[1.0, 5.0], [2.0, 5.0], [3.0, 5.0]]])
    velocity = np.array([[[1.0, 0.0], [1.0 + OFF, 0.0], [1.0, 0.0]]])
    mission = mission_of(position[:, 0].tolist(), 2, dynamics=ir.SingleIntegrator(2.0), radius=0.0)
    fast = ir.Holds(ir.Compare(((1.0, ir.Speed()),), -1.0 - OFF / 2, strict=False), SPAN)
    slow = ir.Holds(ir.Compare(((-1.0, ir.Speed()),), 1.0 + OFF / 2, strict=False), SPAN)
    goals = []
    for step, formula in enumerate((slow, fast, slow)):
        then = ir.Apply(random_runs.by_name["eventually"], (formula,), ir.Window(step, step, SPAN), SPAN)
        asked = ir.Requirement(f"r{step}", ir.OfAgent(0, then, SPAN), SPAN)
        goals += expand(replace(mission, requirements=(asked,)))[0].requirements
    assert passes(mission, Trace(mission.step, position, velocity, np.zeros((1, 3))), *goals)
    with pysat.Cadical195(bootstrap_with=followed(mission, tuple(goals), position).clauses) as solver:
        assert solver.solve()


def test_a_box_beside_a_sharp_edge_does_not_lie_in_it() -> None:
    """Two discs touch in one point; a little further along their common tangent, both are still very near."""
    lens = ir.Intersection(ir.Disc((0.0, 0.0), 1.0), ir.Disc((2.0, 0.0), 1.0))
    assert not lies_in(ir.Box((1.0 - 1e-7, -1e-3), (1.0 + 1e-7, 1e-3)), lens)
    assert lies_in(
        ir.Box((0.0, 0.0), (1.0, 1.0)), ir.Intersection(ir.Box((0.0, 0.0), (1.0, 2.0)), ir.Box((0.0, 0.0), (2.0, 1.0)))
    )


def test_a_thin_wall_hides_nothing_beside_it() -> None:
    mission = random_runs.mission_of(2, 1)
    mission = replace(mission, agents=tuple(replace(agent, radius=Metres(0.0)) for agent in mission.agents))
    wall = ir.Box((1.0, 0.0), (1.0 + 3e-6, 1.0))
    graph = ir.Sight("eyes", Metres(3.0), (wall,), (0, 1), SPAN)
    places = np.array([[1.0 + 3.5e-6, 0.5], [2.0, 0.5]])
    kind = CellsOfKind((0, 1), (places, places), 0, (places[:0], places[:0]), {}, {})
    labels = CheckedLabels(mission, replace(NOTHING, kinds=(kind,)))
    assert not labels._hidden(graph, *labels._pairwise(0, 1)).any()
