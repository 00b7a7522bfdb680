"""Stops before a plan that was made in flight: where and how they end, and what they pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Trace
from missionc.flight.trajectories.stop_and_hover import state_at
from missionc.geometry.curves.piecewise_polynomials import Pieces, written
from missionc.verification.certificate import Check
from missionc.verification.flight.verify_stops import Stops, body_checks, stop_curves, verify_stops
from tests.support.legal_plans import mission_of, still

STARTS = [(1.0, 1.0, 1.0), (4.0, 1.0, 1.0)]
MISSION = mission_of(STARTS, 4, separation=1.0, clearance=1.0, obstacles=[still(ir.Ball((1.0, 3.0, 1.0), 0.5))])
"""Bodies of 0.1 m."""


def standing(place: tuple[float, ...], lasts: tuple[float, float] = (1.0, 2.0)) -> Pieces:
    coefficients = np.zeros((2, 4, 8))
    coefficients[:, :3, 0] = place
    return Pieces(np.array(lasts), coefficients)


def ending(*changes: tuple[int, int, float]) -> Pieces:
    """The stop of the first agent, with coefficients of its last piece that are others: axis, power, by how much."""
    stop = standing(STARTS[0])
    for axis, power, by in changes:
        stop.coefficients[1, axis, power] += by
    return stop


def told(mission: ir.Mission, *stops: Pieces, until: float = 0.0) -> Stops:
    """Stops of 3 s, with their states in steps of 1 s."""
    places = np.stack([[state_at(stop, float(time))[0, : mission.dimension] for time in range(4)] for stop in stops])
    trace = Trace(mission.step, places, np.zeros_like(places), np.zeros(places.shape[:2]))
    own = {agent.name: stop for agent, stop in zip(mission.agents, stops, strict=True)}
    begins = {name: state_at(stop, 0.0) for name, stop in own.items()}
    return Stops(mission, trace, until, begins, {name: written(stop) for name, stop in own.items()})


def judged(stops: Stops) -> dict[tuple[str, str], Check]:
    return {(each.name, each.subject): each for each in verify_stops(stops).checks}


def found(mission: ir.Mission, *stops: Pieces) -> dict[tuple[str, str], Check]:
    return judged(told(mission, *stops))


def test_who_stands_where_the_plan_begins_passes() -> None:
    own = found(MISSION, *map(standing, STARTS))
    assert list(own) == [
        *((f"stop {name}", agent.name) for agent in MISSION.agents for name in ("joints", "begins", "rest", "told")),
        ("stop flown world", "world"),
        ("stop separation", "all pairs"),
        ("stop obstacle", "wall"),
        ("stop", "drone[0]"),
        ("stop", "drone[1]"),
    ]
    assert all(each.passed for each in own.values())
    assert own["stop", "drone[0]"] == Check(
        "stop", "drone[0]", 1e-3, "m", 0.0, True, 0.0, ("drone[0]",), "it ends at rest where the plan begins"
    )
    apart, clear = own["stop separation", "all pairs"], own["stop obstacle", "wall"]
    assert apart.detail == "before the plan begins: every pair of bodies has a separation of 0 m in continuous time"
    assert [apart.margin, clear.margin] == pytest.approx([2.8, 1.4], abs=1e-4)


@pytest.mark.parametrize(
    "stops",
    [
        {"drone[0]": written(standing(STARTS[0]))},
        {"drone[0]": written(standing(STARTS[0])), "drone[1]": "nothing"},
        {"drone[0]": written(standing(STARTS[0])), "drone[1]": written(standing(STARTS[1], (2.0, 1.0)))},
        {"drone[0]": written(standing(STARTS[0])), "drone[1]": written(standing(STARTS[1])), "drone[2]": "nothing"},
    ],
    ids=["missing", "unreadable", "other durations", "more"],
)
def test_files_that_do_not_go_together_are_refused(stops: dict[str, str]) -> None:
    detail = "one stop for each agent, with pieces of equal durations"
    own = verify_stops(replace(told(MISSION, *map(standing, STARTS)), files=stops))
    assert own.checks == (Check("stop", "files", 0.0, "", 0.0, False, detail=detail),)


@pytest.mark.parametrize(
    ("changes", "margin"),
    [
        # Where it ends counts beyond 4 mm, since 1 mm/s is what is left of how it ends.
        ([(0, 0, 0.003), (1, 0, -0.004)], 0.0),
        ([(0, 0, 0.0045)], 0.0005),
        ([(2, 0, 0.0051)], -0.0001),
        # The last piece takes 2 s.
        ([(0, 0, -0.0016), (0, 1, 0.0008)], 0.0002),
        ([(1, 0, -0.0016), (1, 2, 0.0004)], -0.0006),
        ([(2, 0, -0.0016), (2, 3, 0.0002)], -0.0014),
        ([(0, 0, -0.0012), (0, 1, 0.0006), (1, 0, -0.0016), (1, 1, 0.0008)], 0.0),
        # A nose turns as it will.
        ([(3, 0, 1.0), (3, 1, 1.0)], 0.001),
    ],
)
def test_it_ends_where_the_plan_begins_and_at_rest(changes: list[tuple[int, int, float]], margin: float) -> None:
    own = found(MISSION, ending(*changes), standing(STARTS[1]))[("stop", "drone[0]")]
    assert own.margin == pytest.approx(margin, abs=1e-6)
    assert own.passed is (own.margin >= 0)


def test_nobody_ends_where_a_start_that_is_no_point_begins() -> None:
    first, second = MISSION.agents
    field = ir.Region("field", ir.Ball((1.0, 1.0, 1.0), 1.0), first.span)
    anywhere = replace(first, start=ir.InitialSet(first.span, region=field))
    own = found(replace(MISSION, agents=(anywhere, second)), *map(standing, STARTS))[("stop", "drone[0]")]
    assert (own.margin, own.passed) == (-np.inf, False)


def test_it_ends_in_the_motion_in_which_the_plan_begins_up_to_the_fourth_derivative() -> None:
    # x = 1 + s + s^2 + s^3 + s^4 with s = t - 2, and yaw = 0.5.
    moving = standing(STARTS[0])
    power = np.polynomial.Polynomial([1, 1, 1, 1, 1])(np.polynomial.Polynomial([-2, 1]))
    moving.coefficients[1, 0, :5] = power.coef
    moving.coefficients[:, 3, 0] = 0.5
    begins = [(1.0, 1.0, 1.0, 0.5), *((value, 0.0, 0.0, 0.0) for value in (1.0, 2.0, 6.0, 24.0))]
    for order, axis in [(None, 0), *((order, axis) for order in range(5) for axis in (0, 3))]:
        states = [list(state) for state in begins]
        if order is not None:
            states[order][axis] += 0.003
        first = replace(MISSION.agents[0], begins=tuple(map(tuple, states)))
        mission = replace(MISSION, agents=(first, MISSION.agents[1]))
        own = found(mission, moving, standing(STARTS[1]))[("stop", "drone[0]")]
        assert own.margin == pytest.approx(0.001 if order is None else -0.002, abs=1e-9)
        assert own.detail == "it ends in the state in which the plan begins"


@pytest.mark.parametrize(("apart", "passed"), [(0.201, True), (0.199, False)])
def test_bodies_alone_keep_apart_until_the_plan_begins(apart: float, passed: bool) -> None:
    beside = (STARTS[0][0] + apart, 1.0, 1.0)
    near = (1.0, 2.5 + 0.1 - apart, 1.0)
    assert body_checks(MISSION, [standing(STARTS[0]), standing(beside)])[0].passed is passed
    assert body_checks(MISSION, [standing(near), standing(STARTS[1])])[1].passed is passed


def test_the_clock_of_stops_ends_at_the_plans_beginning() -> None:
    curves = stop_curves(MISSION, [standing(start) for start in STARTS])
    assert curves.times.tolist() == [-3.0, -2.0, 0.0]
    assert curves.coefficients.shape == (2, 2, 3, 8)
    flat = mission_of([(1.0, 1.0), (4.0, 1.0)], 4)
    assert stop_curves(flat, [standing(start) for start in STARTS]).coefficients.shape == (2, 2, 2, 8)


def failing(own: dict[tuple[str, str], Check]) -> set[str]:
    return {name for (name, _), each in own.items() if not each.passed}


@pytest.mark.parametrize("order", range(5))
def test_a_stop_begins_in_the_state_that_the_past_states_from_position_to_snap(order: int) -> None:
    stops = told(MISSION, *map(standing, STARTS))
    stops.begins["drone[1]"][order, 1] += 0.1
    assert failing(judged(stops)) == {"stop begins"}
    assert failing(judged(replace(stops, begins={}))) == {"stop begins"}


@pytest.mark.parametrize(("until", "passed"), [(0.0, False), (1.0, False), (2.0, True)])
def test_a_stop_is_where_it_was_told_to_be_at_every_step_that_was_not_flown_yet(until: float, passed: bool) -> None:
    # It begins when the flown states end, and the state at 2 s is not the one of the stop.
    own = {
        agent.name: written(standing(start, (0.5, 2.5 - until)))
        for agent, start in zip(MISSION.agents, STARTS, strict=True)
    }
    stops = replace(told(MISSION, *map(standing, STARTS), until=until), files=own)
    stops.told.position[0, 2] += 0.01
    assert failing(judged(stops)) == (set() if passed else {"stop told"})


@pytest.mark.parametrize(("end", "passed"), [(0.0, True), (0.01, False)])
def test_snap_may_jump_at_a_joint_only_where_the_stop_comes_to_rest(end: float, passed: bool) -> None:
    # x = 1 + (t - 1)^4 up to 1 s: at rest then up to jerk, and its snap of 24 ends; or still in motion.
    power = np.polynomial.Polynomial([-1, 1]) ** 4 + np.polynomial.Polynomial([-end, end])
    stop = standing(STARTS[0])
    stop.coefficients[0, 0, :5] += power.coef
    stop.coefficients[1, 0, 1] += end
    own = judged(told(MISSION, stop, standing(STARTS[1])))
    assert own["stop joints", "drone[0]"].passed is passed


def test_a_stop_does_not_begin_before_the_flown_states_end() -> None:
    assert failing(judged(told(MISSION, *map(standing, STARTS), until=1.0))) == {"stop told"}


def test_a_stop_that_leaves_the_world_between_the_steps_fails() -> None:
    # Out and back within a piece, at rest at both ends: no step and no joint shows it.
    away = standing(STARTS[0], (1.0, 2.0))
    bump = np.polynomial.Polynomial([0, 1]) ** 4 * np.polynomial.Polynomial([1, -1]) ** 3
    away.coefficients[0, 2, :8] += 10_000 * bump.coef
    own = found(MISSION, away, standing(STARTS[1]))
    assert "stop flown world" in failing(own)


def test_a_stop_in_the_plane_keeps_its_altitude() -> None:
    flat = mission_of([(1.0, 1.0), (4.0, 1.0)], 4)
    stops = [standing((*agent.start.point, agent.altitude)) for agent in flat.agents if agent.start.point is not None]
    assert not failing(found(flat, *stops))
    stops[0].coefficients[:, 2, 0] = -1.0
    assert failing(found(flat, *stops)) == {"stop altitude"}


def test_a_stop_keeps_the_limits_of_its_vehicle() -> None:
    vehicle = replace(MISSION.agents[0].vehicle, acceleration=1.0)
    first = replace(MISSION.agents[0], vehicle=vehicle)
    mission = replace(MISSION, agents=(first, MISSION.agents[1]))
    wild = standing(STARTS[0], (1.0, 2.0))
    bump = np.polynomial.Polynomial([0, 1]) ** 4 * np.polynomial.Polynomial([1, -1]) ** 3
    wild.coefficients[0, 0, :8] += 10 * bump.coef
    assert "stop flown acceleration" in failing(found(mission, wild, standing(STARTS[1])))
