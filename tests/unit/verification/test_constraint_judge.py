"""Constraints of recorded flights, on motions made by hand: at the steps, between them, within a tolerance."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import missionc
from missionc import ir
from missionc.base.constraint import Constraint, NotJudged
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.cli.app import commands
from missionc.cli.exit_status import Status
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.ir import Lane, LaneNode, Lanes
from missionc.verification.certificate import Verdict
from missionc.verification.recorded.constraint_judge import ConstraintJudge, States, judge_constraints
from tests.support.legal_plans import SPAN, mission_of, pushed, still, straight

BARE = ("velocity", "heading")
SWAP = """mission swap
time  step 1 s, horizon 4 s
world (0, 0) to (10, 4)
obstacle wall = box (2.6, 2) to (3.4, 4)
team bot[2] { radius 0.3 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 1), (9, 1) }
separation 0.5 m
require swap: bot[0]: eventually[0, 4 s] x >= 8
"""
SWAPPED = [[[1, 1], [3, 1], [5, 1], [7, 1], [9, 1]], [[9, 1], [7, 1], [5, 1], [3, 1], [1, 1]]]


def violated(found: tuple[Constraint, ...]) -> list[tuple[str, tuple[str, ...], float, float]]:
    """Of each violated one its name, agents, time and amount."""
    return [(each.name, each.agents, each.time, round(-each.margin, 6)) for each in found if each.satisfied is False]


def of(found: tuple[Constraint, ...], name: str) -> Constraint:
    (one,) = (each for each in found if each.name == name)
    return one


def test_who_passes_through_another_between_steps_is_found_in_continuous_time_alone() -> None:
    trace = replace(straight([[[1, 1], [3, 1]], [[3, 1], [1, 1]]]), derived=BARE)
    mission = mission_of([[1, 1], [3, 1]], 1, radius=0.25, separation=0.1)
    assert violated(judge_constraints(mission, trace)[0]) == []
    between, _ = judge_constraints(mission, trace, between=motion(mission, trace))
    assert violated(between) == [("separation", ("drone[0]", "drone[1]"), 0.5, 0.6)]
    assert of(between, "separation").position == ((2.0, 1.0), (2.0, 1.0))


def test_every_pair_that_is_too_near_is_named_once_with_its_tightest_moment_and_its_first() -> None:
    places = [[[1, 1], [2, 1], [2.1, 1]], [[2.3, 1], [2.3, 1], [2.3, 1]], [[8, 8], [2, 1.25], [8, 8]]]
    mission = mission_of([each[0] for each in places], 2, dynamics=ir.SingleIntegrator(50.0), separation=0.2)
    found, _ = judge_constraints(mission, replace(straight(places), derived=BARE))
    assert violated(found) == [
        ("separation", ("drone[0]", "drone[1]"), 2.0, 0.2),
        ("separation", ("drone[0]", "drone[2]"), 1.0, 0.15),
        ("separation", ("drone[1]", "drone[2]"), 1.0, round(0.4 - math.hypot(0.3, 0.25), 6)),
    ]
    assert [each.since for each in found if each.satisfied is False] == [1.0, 1.0, 1.0]


def test_under_constant_acceleration_bodies_meet_obstacles_between_steps() -> None:
    """It bulges half a metre to the north of the straight line."""
    start, velocity = np.array([[1.0, 5.0]]), np.array([[1.0, 2.0]])
    trace = pushed(start, velocity, np.array([[[0.0, -4.0]]]), 1.0)
    wall = still(ir.Box((0.0, 5.55), (9.0, 6.0)))
    mission = mission_of([[1, 5]], 1, dynamics=ir.DoubleIntegrator(9.0, 9.0), obstacles=[wall])
    assert violated(judge_constraints(mission, trace)[0]) == []
    (one,) = violated(judge_constraints(mission, trace, between=motion(mission, trace))[0])
    assert one[:2] == ("clearance", ("drone[0]",))
    assert one[2:] == (pytest.approx(0.5, abs=0.01), pytest.approx(0.05, abs=1e-4))


def test_a_tolerance_is_how_far_positions_may_be_off() -> None:
    places = [[[1, 1], [3.1, 1]], [[1, 1.35], [1, 1.35]]]
    mission = mission_of([each[0] for each in places], 1, radius=0.1, separation=0.2)
    trace = replace(straight(places), derived=BARE)
    assert violated(judge_constraints(mission, trace)[0]) == [
        ("separation", ("drone[0]", "drone[1]"), 0.0, 0.05),
        ("speed", ("drone[0]",), 1.0, 0.1),
    ]
    assert violated(judge_constraints(mission, trace, tolerance=0.026)[0]) == [("speed", ("drone[0]",), 1.0, 0.1)]
    found, _ = judge_constraints(mission, trace, tolerance=0.051)
    assert violated(found) == []
    assert of(found, "speed").shown_margin() == "speed within 0.102001 m/s"


def test_a_turn_may_take_as_many_steps_as_nobody_moves() -> None:
    """Half a turn with two steps of rest in it, at a quarter turn in each step."""
    path = [[1, 1], [2, 1], [2, 1], [2, 1], [1, 1]]
    quarter = math.pi / 2
    for turn, late in ((quarter, False), (quarter / 1.6, True)):
        mission = mission_of([[1, 1]], 4, dynamics=ir.Unicycle(0.0, 2.0, turn))
        found, unseen = judge_constraints(mission, replace(straight([path]), derived=BARE))
        assert violated(found) == ([("turn", ("drone[0]",), 4.0, round(math.pi - 3 * turn, 6))] if late else [])
        assert unseen == (NotJudged(("heading",), (), "the recording has no `yaw`"),)
    # A recorded heading is judged at every step.
    heading = np.array([[0.0, 0.0, 0.0, math.pi, math.pi]])
    mission = mission_of([[1, 1]], 4, dynamics=ir.Unicycle(0.0, 2.0, quarter))
    found, unseen = judge_constraints(mission, replace(straight([path]), heading=heading))
    assert (violated(found), unseen) == ([("turn", ("drone[0]",), 3.0, round(quarter, 6))], ())


def test_a_move_to_the_side_breaks_the_heading() -> None:
    trace = replace(straight([[[1, 1], [2, 1], [2, 2]]]), heading=np.zeros((1, 3)))
    mission = mission_of([[1, 1]], 2, dynamics=ir.Unicycle(0.0, 2.0, math.inf))
    assert violated(judge_constraints(mission, trace)[0]) == [
        ("heading", ("drone[0]",), 2.0, round(math.sqrt(2), 6)),
    ]


def test_a_recorded_velocity_above_the_top_speed_counts_for_who_has_momentum() -> None:
    trace = straight([[[1, 1], [2, 1], [3, 1]]])
    trace = replace(trace, velocity=np.array([[[1.0, 0.0], [2.5, 0.0], [1.0, 0.0]]]))
    mission = mission_of([[1, 1]], 2, dynamics=ir.DoubleIntegrator(2.0, 9.0))
    assert violated(judge_constraints(mission, trace)[0]) == [("speed", ("drone[0]",), 1.0, 0.5)]
    assert violated(judge_constraints(mission, replace(trace, derived=BARE))[0]) == []


def test_on_a_roadmap_of_its_own_an_agent_keeps_to_the_lanes() -> None:
    nodes = tuple(LaneNode(name, place, SPAN) for name, place in zip("abc", ((1, 1), (3, 1), (3, 3)), strict=True))
    lanes = tuple(Lane(one, one + 1, 2.0, Seconds(0.0), SPAN) for one in range(2))
    mission = mission_of([[1, 1], [1, 1]], 2, radius=0.0, separation=0.0)
    mission = replace(mission, solve=replace(mission.solve, roadmap=Lanes("city.graphml", nodes, lanes, SPAN)))
    trace = replace(straight([[[1, 1], [3, 1], [3, 3]], [[1, 1], [3, 1], [3, 1]]]), derived=BARE)
    assert violated(judge_constraints(mission, trace)[0]) == []
    astray = replace(straight([[[1, 1], [3, 1], [3, 3]], [[1, 1], [2, 1.25], [3, 1]]]), derived=BARE)
    assert violated(judge_constraints(mission, astray)[0]) == [("lane", ("drone[1]",), 1.0, 0.25)]


def test_a_flight_that_begins_elsewhere_is_judged_and_the_start_is_named() -> None:
    mission = mission_of([[1, 1, 1]], 1)
    vehicle = replace(ir.PLAIN, tracking=0.05, tilt=0.3)
    vague = replace(mission, agents=(replace(mission.agents[0], vehicle=vehicle),))
    trace = replace(straight([[[1, 1, 1.04], [1, 1, 1]]]), derived=BARE)
    found, elsewhere = judge_constraints(mission, trace)
    assert violated(found) == []
    assert elsewhere == (NotJudged(("start",), (), "the flight begins up to 0.040 m from it"),)
    assert judge_constraints(mission, trace, tolerance=0.05)[1] == ()
    # No more than the vehicle tracks.
    assert judge_constraints(vague, trace)[1] == (NotJudged(("tilt",), (), "positions at the samples do not show it"),)


def test_heights_are_not_judged_in_a_plane() -> None:
    mission = mission_of([[1, 1], [5, 5]], 1)
    vehicle = replace(ir.PLAIN, height=ir.Band(0.5, 2.0))
    mission = replace(mission, agents=(mission.agents[0], replace(mission.agents[1], vehicle=vehicle)))
    trace = replace(straight([[[1, 1], [1, 1]], [[5, 5], [5, 5]]]), derived=BARE)
    assert judge_constraints(mission, trace)[1] == (
        NotJudged(("height",), ("drone[1]",), "a two-dimensional recording has no heights"),
    )


def test_who_is_missing_is_judged_by_where_it_may_be() -> None:
    """Half a metre from where it was seen: surely in the obstacle, perhaps beside another, and in the world."""
    wall = still(ir.Box((4.0, 4.0), (6.0, 6.0)))
    mission = mission_of([[5, 5], [6.5, 5]], 3, obstacles=[wall])

    def states(step: int, *doubt: float) -> States:
        place = np.array([[[5.0, 5.0]], [[6.5, 5.0]]])
        everyone = np.ones(2, dtype=np.bool_)
        return States(step, place, 0 * place, np.zeros((2, 1)), np.array([doubt]).T, ~everyone, ~everyone)

    judge = ConstraintJudge(mission)
    assert violated(tuple(judge.take(states(0, 0.5, 0.0)))) == [("clearance", ("drone[0]",), 0.0, 0.6)]
    assert [each.name for each in judge.constraints() if each.satisfied is None] == []
    judge.take(states(1, 0.0, 1.3))
    found = judge.constraints()
    assert [each.name for each in found if each.satisfied is None] == ["separation"]
    assert violated(found) == [("clearance", ("drone[0]",), 1.0, 1.1)]
    assert judge.not_judged() == (
        NotJudged(("motion",), ("drone[0]",), "missing at 1 step"),
        NotJudged(("motion",), ("drone[1]",), "missing at 1 step"),
    )
    # Two that are far apart may meet if nobody knows where they are.
    lonely = ConstraintJudge(replace(mission, obstacles=()))
    lonely.take(states(0, 1.0, 1.0))
    assert [each.name for each in lonely.constraints() if each.satisfied is None] == ["separation"]


def test_a_mission_of_one_state_is_judged() -> None:
    mission = mission_of([[1, 1]], 0)
    trace = Trace(mission.step, np.array([[[1.0, 11.0]]]), np.zeros((1, 1, 2)), np.zeros((1, 1)))
    for continuous in (False, True):
        assert violated(
            judge_constraints(mission, trace, between=motion(mission, trace) if continuous else None)[0]
        ) == [
            ("world", ("drone[0]",), 0.0, 1.0),
        ]


@pytest.fixture
def swap(tmp_path: Path) -> Path:
    (tmp_path / "swap.mission").write_text(SWAP)
    rows = [(agent, t, *place) for agent, path in enumerate(SWAPPED) for t, place in enumerate(path)]
    lines = [f"bot[{agent}],{t},{x},{y}" for agent, t, x, y in rows]
    (tmp_path / "flown.csv").write_text("agent,t,x,y\n" + "\n".join(lines) + "\n")
    return tmp_path


def test_a_violated_constraint_has_the_exit_status_of_a_violated_requirement(swap: Path) -> None:
    asked = ["monitor", str(swap / "swap.mission"), str(swap / "flown.csv"), "--format", "json"]
    ended = CliRunner().invoke(commands, asked, standalone_mode=False)
    assert ended.return_value == Status.VIOLATED
    document = json.loads(ended.stdout)
    assert document["satisfied"] is False
    assert [each["satisfied"] for each in document["requirements"]] == [True]
    (near,) = (each for each in document["constraints"] if not each["satisfied"])
    assert (near["name"], near["agents"], near["step"], near["time"]) == ("separation", ["bot[0]", "bot[1]"], 2, 2.0)
    assert (near["margin"], near["position"]) == (pytest.approx(-1.1), [[5.0, 1.0], [5.0, 1.0]])
    assert document["not_judged"] == []
    allowed = CliRunner().invoke(commands, [*asked, "--tolerance", "0.6"], standalone_mode=False)
    assert (allowed.return_value, json.loads(allowed.stdout)["satisfied"]) == (Status.DONE, True)


def test_python_has_the_constraints_beside_the_requirements(swap: Path) -> None:
    monitored = missionc.monitor(swap / "swap.mission", swap / "flown.csv")
    assert not monitored.satisfied
    assert violated(monitored.constraints) == [("separation", ("bot[0]", "bot[1]"), 2.0, 1.1)]
    assert "violated: separation of `bot[0]` and `bot[1]` by 1.100 m" in str(monitored)
    assert missionc.monitor(swap / "swap.mission", swap / "flown.csv", tolerance=0.6).satisfied


def test_a_stream_is_satisfied_only_after_its_last_step_and_violated_for_good(swap: Path) -> None:
    apart = [[[1, 1], [3, 1], [5, 1], [7, 1], [8, 1]], [[9, 1], [9, 2], [9, 3], [9, 3], [9, 3]]]

    def status(paths: list[list[list[int]]], steps: int) -> Status:
        lines = [
            json.dumps({"t": t, "agents": {f"bot[{agent}]": path[t] for agent, path in enumerate(paths)}})
            for t in range(steps)
        ]
        asked = ["monitor", str(swap / "swap.mission"), "--live"]
        ended = CliRunner().invoke(commands, asked, input="\n".join(lines) + "\n", standalone_mode=False)
        return ended.return_value

    assert status(apart, 5) == Status.DONE
    assert status(apart, 4) == Status.UNDECIDED
    assert status(SWAPPED, 5) == status(SWAPPED, 3) == Status.VIOLATED


FINER = """mission finer
time step 2 s, horizon 4 s
world (0, 0) to (10, 4)
obstacle wall = box (2.6, 2) to (3.4, 4)
region home = box (0, 0) to (10, 2)
agent bot {{ radius 0.3 m  dynamics {}(speed <= 4 m/s{})  start at (1, 1) }}
require stay: bot: always[0, 4 s] home
"""


@pytest.mark.parametrize("dynamics", [("single_integrator", ""), ("double_integrator", ", acceleration <= 9 m/s^2")])
def test_samples_between_the_steps_are_judged_in_continuous_time(dynamics: tuple[str, str], tmp_path: Path) -> None:
    flown = tmp_path / "flown.csv"
    flown.write_text("agent,t,x,y\nbot,0,1,1\nbot,1,3,3\nbot,2,5,1\nbot,3,5,1\nbot,4,5,1\n")
    text = Source("finer.mission", FINER.format(*dynamics))
    assert missionc.monitor(text, flown).satisfied
    judged = missionc.monitor(text, flown, continuous=True)
    assert judged.satisfied is False
    (hit,) = [each for each in judged.constraints if each.satisfied is False]
    assert (hit.name, hit.obstacle) == ("clearance", "wall")
    assert hit.time == pytest.approx(1.0, abs=1e-4)
    assert hit.position[0] == pytest.approx((3.0, 3.0), abs=1e-3)
    assert [each.verdict for each in judged.between] == [Verdict.FAILS]


def test_no_curve_is_invented_between_samples_without_velocities(tmp_path: Path) -> None:
    flown = tmp_path / "flown.csv"
    flown.write_text("agent,t,x,y\nbot,0,1,1\nbot,1,0.6,1\nbot,2,0.1,1\nbot,3,0.1,1\nbot,4,1,1\n")
    text = Source("finer.mission", FINER.format("double_integrator", ", acceleration <= 9 m/s^2"))
    judged = missionc.monitor(text, flown, continuous=True)
    assert judged.satisfied
