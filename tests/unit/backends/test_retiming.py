"""Standing still: who need not move rests, goes at a pace when it must, and every goal holds as well as before."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("torch")

from missionc.backends.acceptance import attempt
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.cost_weights import spare
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.control_points import pursued, splines, trace
from missionc.backends.clot.optimise.motion_residuals import Costs
from missionc.backends.clot.optimise.path_velocity import SPEEDS, Bounds, Nodes, path_nodes, path_velocity
from missionc.backends.clot.optimise.retiming import retime
from missionc.backends.clot.settings import Weights
from missionc.base.trace import Array, Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.monitor import monitor
from tests.support.transport_missions import checked

YARD = """
mission yard
time step 1 s, horizon 60 s
world (0, 0) to (40, 20)
region goal = box (30, 6) to (38, 14)
agent rover { radius 0.4 m  dynamics DYNAMICS  start at (4, 10) }
agent cart  { radius 0.4 m  dynamics DYNAMICS  start at (4, 4) }
separation 0.2 m
require there: rover: eventually[0, 60 s] goal
"""

DYNAMICS = [
    "single_integrator(speed <= 4 m/s)",
    "unicycle(speed 0..4 m/s, turn <= 30 deg/s)",
    "double_integrator(speed <= 4 m/s, acceleration <= 3 m/s^2)",
]


def calmed(text: str, ways: list[Array]) -> tuple[Mission, Kernel, Trace, Trace]:
    """A plan along ways, (steps + 1, dim), metres each, and what comes of it."""
    mission, kernel = checked(text)
    made = splines(mission)
    control = made.through(np.stack(ways))
    control[made.fixed] = made.through(np.repeat(np.stack(ways)[:, :1], mission.steps + 1, axis=1))[made.fixed]
    plan = trace(mission, made, control)
    assert attempt(mission, kernel, plan).is_plan
    roots = tuple(each.formula for each in build(kernel).requirements)
    demand = Demand.of(mission, roots, {}, mission.steps)

    def accept(tried: Array) -> Trace | None:
        motion = trace(mission, made, tried)
        return motion if attempt(mission, kernel, motion).is_plan else None

    costs = Costs(mission, made, Weights(), spare(mission))
    return mission, kernel, plan, retime(control, plan, demand, costs, accept)[1]


def speeds(motion: Trace, agent: int) -> Array:
    return np.asarray(np.linalg.norm(np.diff(motion.position[agent], axis=0), axis=1) / motion.step)


def straight(steps: int, *points: tuple[float, float]) -> Array:
    """Evenly from one point to the next."""
    time = np.linspace(0, steps, len(points))
    return np.stack([np.interp(np.arange(steps + 1), time, axis) for axis in zip(*points, strict=True)], axis=1)


@pytest.mark.parametrize("dynamics", DYNAMICS)
def test_who_creeps_rests_and_who_has_no_goal_stays(dynamics: str) -> None:
    slow = straight(60, (4, 10), (4.5, 10), (5, 10), (34, 10), (34, 10))
    idle = straight(60, (4, 4), (5, 4.2), (6, 4), (7, 4))
    mission, kernel, plan, calm = calmed(YARD.replace("DYNAMICS", dynamics), [slow, idle])
    assert (calm.position[1] == calm.position[1, 0]).all()
    going = speeds(calm, 0)
    assert np.count_nonzero(going == 0) >= 25
    assert np.count_nonzero((going > 0) & (going < 0.2)) <= 4
    before, after = (monitor(mission, kernel, each).requirements for each in (plan, calm))
    assert all(one.robustness <= other.robustness + 0.13 for one, other in zip(before, after, strict=True))


def test_who_is_to_be_somewhere_all_the_time_is_there_at_each_step() -> None:
    text = YARD.replace("DYNAMICS", DYNAMICS[0]) + "require near: rover: always[0, end] distance(cart) <= 7 m\n"
    way = straight(60, (4, 10), (4.5, 10), (5, 10), (34, 10), (34, 10))
    mission, kernel, _, calm = calmed(text, [way, way - np.array([0, 6])])
    assert attempt(mission, kernel, calm).is_plan
    assert np.count_nonzero(speeds(calm, 1) == 0) >= 25


def test_a_team_that_creeps_in_formation_rests_together() -> None:
    text = """
    mission pair
    time step 1 s, horizon 40 s
    world (0, 0) to (40, 20)
    region goal = box (10, 0) to (40, 20)
    team bot[2] { radius 0.3 m  dynamics single_integrator(speed <= 4 m/s)  start at (4, 6), (4, 10) }
    require together: always[0, end] (distance(bot[0], bot[1]) <= 4.1 m and distance(bot[0], bot[1]) >= 3.9 m)
    require there: bot[0]: eventually[0, end] goal
    """
    way = straight(40, (4, 6), (12, 6))
    _, _, plan, calm = calmed(text, [way, way + np.array([0, 4])])
    assert (speeds(plan, 0) > 0).all()
    assert np.count_nonzero(speeds(calm, 0) == 0) >= 25
    assert speeds(calm, 1) == pytest.approx(speeds(calm, 0))


def test_nobody_goes_faster_than_it_may_where_it_is() -> None:
    text = (
        YARD.replace("DYNAMICS", DYNAMICS[0])
        + "require slow: rover: always[0, end] (x <= 19 m implies speed <= 0.7 m/s)\n"
    )
    way = straight(60, (4, 10), (4.5, 10), (12, 10), (20, 10), (34, 10))
    _, _, _, calm = calmed(text, [way, np.tile((4.0, 4.0), (61, 1))])
    assert speeds(calm, 0)[calm.position[0, :-1, 0] <= 19].max() <= 0.7 + 1e-9


def test_whoever_turns_back_stands_there_as_long_as_it_turns() -> None:
    text = YARD.replace("DYNAMICS", DYNAMICS[1]) + "require back: rover: eventually[55 s, 60 s] x <= 10 m\n"
    bend = [(34 + np.sin(angle), 11 - np.cos(angle)) for angle in np.linspace(0, np.pi, 30)]
    way = np.concatenate([straight(15, (4, 10), (34, 10))[:-1], bend, straight(15, (34, 12), (6, 12))])
    way = np.concatenate([way, np.tile(way[-1], (61 - len(way), 1))])
    mission, kernel, plan, calm = calmed(text, [way, np.tile((4.0, 4.0), (61, 1))])
    assert attempt(mission, kernel, calm).is_plan
    assert np.count_nonzero(speeds(calm, 0) == 0) > np.count_nonzero(speeds(plan, 0) == 0)


def test_who_waits_turns_meanwhile_to_where_it_goes_next() -> None:
    mission, _ = checked(YARD.replace("DYNAMICS", DYNAMICS[1]))
    way = np.array([(0.0, 0.0), (3.0, 0.0), *[(6.0, 0.0)] * 6, (3.0, 0.0), (0.0, 0.0)])
    assert pursued(mission.agents[0].dynamics, way, 1.0) == pytest.approx(way)


def bounds(steps: int, nodes: Nodes, finish: bool = True) -> Bounds:
    allowed = np.ones((len(SPEEDS), steps + 1, len(nodes.along)), dtype=np.bool_)
    return Bounds(allowed, np.ones(1), 1.0, np.inf, 1, steps, finish, set(), {})


def test_a_way_is_gone_in_one_piece_and_only_where_nodes_are_allowed() -> None:
    path = np.array([[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]])
    nodes = path_nodes(path, np.ones(1), 5, np.zeros(3, dtype=np.bool_))
    asked = bounds(30, nodes)
    found = path_velocity(nodes, asked)
    assert found is not None
    going = np.flatnonzero(np.diff(found))
    assert 5 <= len(going) <= 9
    steps = np.diff(nodes.along[found])[going]
    assert steps[0] < steps.max() > steps[-1]
    assert (np.diff(going) == 1).all()
    asked.allowed[:, 12, :-1] = False
    asked.allowed[:, :10, 1:] = False
    assert path_velocity(nodes, asked) is not None
    asked.allowed[:, :12, 1:] = False
    assert path_velocity(nodes, asked) is None


def test_a_node_at_which_somebody_turns_is_stayed_at() -> None:
    path = np.array([[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]])
    nodes = path_nodes(path, np.ones(1), 5, np.zeros(3, dtype=np.bool_))
    asked = bounds(30, nodes)
    asked.stops[4] = 3  # type: ignore[index]
    found = path_velocity(nodes, asked)
    assert found is not None
    assert np.count_nonzero(found == 4) >= 4
