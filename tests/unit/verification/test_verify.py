"""What the verifier accepts and refuses, on plans made by hand."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Metres
from missionc.ir.kernel.nodes import Atom, Goal, Kernel
from missionc.verification.verify_plan import Certificate, verify
from tests.support.legal_plans import NOTHING, SPAN, mission_of, moved, moving, pushed, still, straight

PAIR = [[[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]], [[1.0, 3.0], [2.0, 3.0], [3.0, 3.0]]]


def pair(**changes: object) -> ir.Mission:
    return mission_of([path[0] for path in PAIR], 2, **changes)  # type: ignore[arg-type]


def failing(certificate: Certificate) -> set[str]:
    return {check.name for check in certificate.failures}


def test_a_legal_plan_passes_and_every_check_has_its_margin() -> None:
    certificate = verify(pair(obstacles=[still(ir.Disc((2.0, 6.0), 1.0))]), NOTHING, straight(PAIR))
    assert certificate.passed
    margins = {check.name: check.margin for check in certificate.checks}
    assert margins["speed"] == pytest.approx(1.0)
    assert margins["separation"] == pytest.approx(2.0 - 0.2 - 0.1)
    assert margins["world"] == pytest.approx(1.0)
    assert margins["obstacle"] == pytest.approx(2.0 - 0.1, rel=2e-3)
    assert margins["obstacle"] <= 2.0 - 0.1


def test_a_trace_of_another_shape_is_refused_before_anything_else_is_asked() -> None:
    certificate = verify(pair(), NOTHING, straight([PAIR[0]]))
    assert failing(certificate) == {"shape"}
    assert len(certificate.checks) == 1
    assert certificate.mission == "made"


def test_a_trace_with_a_value_that_is_no_number_is_refused() -> None:
    assert failing(verify(pair(), NOTHING, moved(straight(PAIR), 1, 1, [math.nan, 0]))) == {"shape"}


def test_a_position_that_the_velocity_does_not_lead_to_is_refused() -> None:
    assert "motion" in failing(verify(pair(), NOTHING, moved(straight(PAIR), 0, 1, [1e-4, 0])))


def test_a_velocity_that_the_motion_does_not_have_is_refused() -> None:
    trace = straight(PAIR)
    velocity = trace.velocity.copy()
    velocity[0, -1] *= 2
    assert failing(verify(pair(), NOTHING, replace(trace, velocity=velocity))) == {"motion"}


def test_going_faster_than_allowed_is_refused_and_the_time_is_said() -> None:
    certificate = verify(pair(dynamics=ir.SingleIntegrator(0.9)), NOTHING, straight(PAIR))
    assert failing(certificate) == {"speed"}
    assert certificate.failures[0].margin == pytest.approx(-0.1)
    assert certificate.failures[0].agents == ("drone[0]",)


def test_a_start_elsewhere_is_refused() -> None:
    shifted = straight(np.asarray(PAIR) + np.array([0.0, 0.01]))
    assert failing(verify(pair(), NOTHING, shifted)) == {"start"}


def test_a_start_outside_its_region_is_refused_and_one_on_the_border_passes() -> None:
    region = ir.Region("base", ir.Box((1.0, 0.0), (2.0, 4.0)), SPAN)
    mission = pair()
    agents = tuple(replace(agent, start=ir.InitialSet(SPAN, region=region)) for agent in mission.agents)
    assert verify(replace(mission, agents=agents), NOTHING, straight(PAIR)).passed
    left = straight(np.asarray(PAIR) - [1e-6, 0.0])
    assert failing(verify(replace(mission, agents=agents), NOTHING, left)) == {"start"}


def test_a_finish_that_is_missed_is_refused() -> None:
    mission = pair()
    agents = tuple(replace(agent, finish=ir.InitialSet(SPAN, (3.0, 1.0))) for agent in mission.agents)
    certificate = verify(replace(mission, agents=agents), NOTHING, straight(PAIR))
    assert [check.subject for check in certificate.failures] == ["drone[1]"]
    assert certificate.failures[0].at == 2.0


def test_leaving_the_world_between_two_steps_is_refused() -> None:
    start, speed = np.array([[5.0, 0.5]]), np.array([[0.0, -1.0]])
    trace = pushed(start, speed, np.array([[[0.0, 2.0]]]), 1.0)
    assert trace.position[0, -1, 1] == 0.5
    mission = mission_of(start.tolist(), 1, dynamics=ir.DoubleIntegrator(3.0, 2.0))
    assert verify(mission, NOTHING, trace).passed
    low = pushed(start - [0.0, 0.3], speed, np.array([[[0.0, 2.0]]]), 1.0)
    mission = mission_of((start - [0.0, 0.3]).tolist(), 1, dynamics=ir.DoubleIntegrator(3.0, 2.0))
    certificate = verify(mission, NOTHING, low)
    assert failing(certificate) == {"world"}
    assert certificate.failures[0].margin == pytest.approx(-0.05, abs=2e-5)


def test_a_unicycle_must_face_where_it_goes() -> None:
    trace = straight(PAIR)
    mission = pair(dynamics=ir.Unicycle(0.0, 2.0, math.inf))
    assert verify(mission, NOTHING, trace).passed
    assert failing(verify(mission, NOTHING, replace(trace, heading=trace.heading + 0.1))) == {"heading"}
    assert failing(verify(mission, NOTHING, replace(trace, heading=trace.heading + math.pi))) == {"heading"}


def test_a_unicycle_with_a_slowest_speed_may_not_wait() -> None:
    waiting = straight([[[1.0, 1.0], [1.0, 1.0], [2.0, 1.0]], PAIR[1]])
    assert verify(pair(dynamics=ir.Unicycle(0.0, 2.0, math.inf)), NOTHING, waiting).passed
    certificate = verify(pair(dynamics=ir.Unicycle(0.5, 2.0, math.inf)), NOTHING, waiting)
    assert failing(certificate) == {"speed"}
    assert certificate.failures[0].margin == pytest.approx(-0.5)


def test_a_unicycle_turns_no_faster_than_allowed_across_the_half_turn_too() -> None:
    path = [[[5.0, 5.0], [4.0, 5.1], [3.0, 5.0]]]
    trace = straight(path)
    change = 2 * math.atan(0.1)
    mission = mission_of([[5.0, 5.0]], 2, dynamics=ir.Unicycle(0.0, 2.0, change + 1e-3))
    assert verify(mission, NOTHING, trace).passed
    mission = mission_of([[5.0, 5.0]], 2, dynamics=ir.Unicycle(0.0, 2.0, change - 1e-3))
    assert failing(verify(mission, NOTHING, trace)) == {"turn"}


def test_a_double_integrator_keeps_its_acceleration_and_speed() -> None:
    start = np.array([[1.0, 1.0]])
    trace = pushed(start, np.zeros((1, 2)), np.array([[[1.0, 0.0], [1.0, 0.0], [-2.0, 0.0]]]), 0.5)
    make = mission_of
    assert verify(make(start.tolist(), 3, step=0.5, dynamics=ir.DoubleIntegrator(1.0, 2.0)), NOTHING, trace).passed
    slow = make(start.tolist(), 3, step=0.5, dynamics=ir.DoubleIntegrator(0.9, 2.0))
    assert failing(verify(slow, NOTHING, trace)) == {"speed"}
    weak = make(start.tolist(), 3, step=0.5, dynamics=ir.DoubleIntegrator(1.0, 1.9))
    assert failing(verify(weak, NOTHING, trace)) == {"acceleration"}


def test_two_agents_that_swap_places_meet_between_the_steps() -> None:
    trace = straight([[[1.0, 1.0], [2.0, 1.0]], [[2.0, 1.0], [1.0, 1.0]]])
    certificate = verify(mission_of([[1.0, 1.0], [2.0, 1.0]], 1), NOTHING, trace)
    assert failing(certificate) == {"separation"}
    assert certificate.failures[0].at == pytest.approx(0.5)
    assert certificate.failures[0].margin == pytest.approx(-0.3)
    assert set(certificate.failures[0].agents) == {"drone[0]", "drone[1]"}


def test_bodies_at_exactly_their_separation_pass_and_a_hair_less_is_refused() -> None:
    for gap, passes in ((0.3, True), (0.3 - 1e-6, False)):
        trace = straight([[[1.0, 1.0], [2.0, 1.0]], [[1.0, 1.0 + gap], [2.0, 1.0 + gap]]])
        assert verify(mission_of([[1.0, 1.0], [1.0, 1.0 + gap]], 1), NOTHING, trace).passed is passes


def test_accelerating_agents_are_judged_between_the_steps_too() -> None:
    start = np.array([[1.0, 1.0], [1.0, 2.0]])
    speed = np.array([[0.0, 1.0], [0.0, -1.0]])
    back = np.array([[[0.0, -2.0]], [[0.0, 2.0]]])
    mission = mission_of(start.tolist(), 1, dynamics=ir.DoubleIntegrator(3.0, 2.0))
    certificate = verify(mission, NOTHING, pushed(start, speed, back, 1.0))
    separation = next(check for check in certificate.checks if check.name == "separation")
    # Each comes a quarter of a metre towards the other.
    assert separation.margin == pytest.approx(0.5 - 0.3, rel=2e-3)
    assert separation.at == pytest.approx(0.5, abs=1e-2)
    assert certificate.passed


def test_the_nearest_pair_of_many_is_found() -> None:
    generator = np.random.default_rng(5)
    position = generator.uniform(0, 10, (40, 6, 2))
    mission = mission_of(position[:, 0].tolist(), 5, dynamics=ir.SingleIntegrator(20.0))
    certificate = verify(mission, NOTHING, straight(position))
    shares = np.linspace(0, 1, 2001)[:, None]
    nearest = math.inf
    for step in range(5):
        flown = position[:, step, None] * (1 - shares) + position[:, step + 1, None] * shares
        for one in range(40):
            for other in range(one):
                nearest = min(nearest, float(np.linalg.norm(flown[one] - flown[other], axis=-1).min()))
    separation = next(check for check in certificate.checks if check.name == "separation")
    assert separation.margin <= nearest - 0.3 + 1e-12
    assert separation.margin == pytest.approx(nearest - 0.3, abs=0.02)


def test_passing_through_an_obstacle_between_the_steps_is_refused() -> None:
    thin = still(ir.Box((1.4, 0.0), (1.5, 2.0)))
    certificate = verify(pair(obstacles=[thin]), NOTHING, straight(PAIR))
    assert failing(certificate) == {"obstacle"}
    assert certificate.failures[0].subject == "wall"
    assert 0.0 < (certificate.failures[0].at or 0.0) < 1.0


def test_sliding_along_an_obstacle_in_touch_passes_and_clearance_is_kept_from_it() -> None:
    shelf = still(ir.Box((0.0, 0.0), (10.0, 0.9)))
    assert verify(pair(obstacles=[shelf]), NOTHING, straight(PAIR)).passed
    certificate = verify(pair(obstacles=[shelf], clearance=0.05), NOTHING, straight(PAIR))
    assert failing(certificate) == {"obstacle"}
    assert certificate.failures[0].margin == pytest.approx(-0.05, abs=2e-5)


def test_a_moving_obstacle_is_met_where_it_is_at_the_time() -> None:
    ahead = moving(ir.Disc((3.0, 1.0), 0.3), [0.0, 2.0], [(0.0, 0.0), (2.0, 0.0)])
    behind = moving(ir.Disc((3.0, 1.0), 0.3), [0.0, 0.5, 1.0], [(0.0, 0.0), (0.0, 3.0), (-1.0, 2.0)])
    crossing = moving(ir.Disc((2.0, 0.0), 0.3), [0.0, 2.0], [(0.0, 0.0), (0.0, 2.0)])
    assert verify(pair(obstacles=[ahead]), NOTHING, straight(PAIR)).passed
    assert not verify(pair(obstacles=[behind]), NOTHING, straight(PAIR)).passed
    certificate = verify(pair(obstacles=[crossing]), NOTHING, straight(PAIR))
    assert failing(certificate) == {"obstacle"}
    assert certificate.failures[0].at == pytest.approx(1.0, abs=0.01)


def test_an_obstacle_that_grows_is_met_when_it_is_large_enough() -> None:
    crowd = still(ir.Disc((8.0, 8.0), 0.5))
    certificate = verify(pair(obstacles=[crowd]), NOTHING, straight(PAIR))
    assert certificate.passed
    reached = next(check for check in certificate.checks if check.name == "obstacle").margin
    grown = verify(pair(obstacles=[replace(crowd, growth=reached / 10)]), NOTHING, straight(PAIR))
    margin = next(check for check in grown.checks if check.name == "obstacle").margin
    assert grown.passed
    assert margin < reached
    fast = verify(pair(obstacles=[replace(crowd, growth=10.0)]), NOTHING, straight(PAIR))
    assert failing(fast) == {"obstacle"}
    assert fast.failures[0].at == pytest.approx(2.0, abs=0.01)


def test_a_door_as_deep_as_its_wall_is_open() -> None:
    wall = ir.Difference(ir.Box((1.4, 0.0), (1.6, 10.0)), ir.Box((1.4, 0.5), (1.6, 1.5)))
    certificate = verify(mission_of([[1.0, 1.0]], 2, obstacles=[still(wall)]), NOTHING, straight([PAIR[0]]))
    assert certificate.passed
    obstacle = next(check for check in certificate.checks if check.name == "obstacle")
    assert obstacle.margin == pytest.approx(0.5 - 0.1, rel=2e-3)


def test_a_requirement_is_judged_by_the_monitor_and_a_preference_binds_nobody() -> None:
    region = ir.Region("goal", ir.Box((0.0, 0.0), (1.5, 4.0)), SPAN)
    formula = Atom(ir.Inside(region, False))
    required, preferred = Goal("there", formula, SPAN), Goal("there", formula, SPAN, 1.0)
    trace = straight(PAIR)
    assert verify(pair(), Kernel((required,), ()), trace).passed
    away = Goal("away", Atom(ir.Compare(((1.0, ir.Coordinate(0)),), -2.0, False)), SPAN)
    assert failing(verify(pair(), Kernel((required, away), ()), trace)) == {"requirement"}
    certificate = verify(pair(), Kernel((), (preferred, replace(away, weight=1.0))), trace)
    assert certificate.passed
    assert [figure.subject for figure in certificate.figures if figure.name == "preference"] == ["there", "away"]


def test_the_least_connectivity_of_a_graph_that_must_be_connected_is_reported() -> None:
    apart = straight([[[1.0, 1.0], [2.0, 1.0]], [[1.0, 2.0], [2.0, 9.0]]])
    mission = mission_of([[1.0, 1.0], [1.0, 2.0]], 1, dynamics=ir.SingleIntegrator(20.0))
    assert verify(mission, NOTHING, apart).figures == ()
    connected = ir.Holds(ir.Connected(mission.graphs[0], (0, 1)), SPAN)
    mission = replace(mission, requirements=(ir.Requirement("together", connected, SPAN),))
    figures = {figure.name: figure for figure in verify(mission, NOTHING, apart).figures}
    assert figures["connectivity"].value == 0.0
    assert figures["connectivity"].at == 1.0
    together = straight([[[1.0, 1.0], [2.0, 1.0]], [[1.0, 2.0], [2.0, 2.0]]])
    figures = {figure.name: figure for figure in verify(mission, NOTHING, together).figures}
    assert figures["connectivity"].value == pytest.approx(2.0)


def test_verifying_loads_no_backend() -> None:
    foreign = "('missionc.backends', 'z3', 'torch', 'piqp')"
    loaded = f"[name for name in sys.modules if name.startswith({foreign})]"
    code = f"import missionc.verification.verify_plan, sys; print({loaded})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_volume_is_judged_in_all_three_coordinates() -> None:
    path = [[[1.0, 1.0, 1.0], [2.0, 1.0, 1.0]], [[1.0, 1.0, 2.0], [2.0, 1.0, 1.2]]]
    mission = mission_of([points[0] for points in path], 1)
    certificate = verify(mission, NOTHING, straight(path))
    assert failing(certificate) == {"separation"}
    slab = still(ir.Box((0.0, 0.0, 0.0), (10.0, 10.0, 0.85)))
    alone = mission_of([path[0][0]], 1, obstacles=[slab])
    assert verify(alone, NOTHING, straight(path[:1])).passed
    assert not verify(mission_of([path[0][0]], 1, obstacles=[slab], radius=0.2), NOTHING, straight(path[:1])).passed


def test_every_agent_has_its_own_radius() -> None:
    trace = straight([[[1.0, 1.0], [2.0, 1.0]], [[1.0, 1.5], [2.0, 1.5]]])
    mission = mission_of([[1.0, 1.0], [1.0, 1.5]], 1, separation=0.0)
    wide = (mission.agents[0], replace(mission.agents[1], radius=Metres(0.45)))
    assert verify(mission, NOTHING, trace).passed
    assert failing(verify(replace(mission, agents=wide), NOTHING, trace)) == {"separation"}
