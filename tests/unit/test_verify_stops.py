"""Stops before a plan that was made in flight: where and how they end, and what they pass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.curves.crazyflie_csv import Pieces, written
from missionc.verify.certificate import Check
from missionc.verify.flight.verify_stops import checks, stop_curves, verify_stops
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


def found(mission: ir.Mission, *stops: Pieces) -> dict[tuple[str, str], Check]:
    return {(each.name, each.subject): each for each in checks(mission, list(stops))}


def test_who_stands_where_the_plan_begins_passes() -> None:
    files = {agent.name: written(standing(start)) for agent, start in zip(MISSION.agents, STARTS, strict=True)}
    own = verify_stops(MISSION, files)
    assert [(each.name, each.subject, each.passed) for each in own] == [
        ("stop separation", "all pairs", True),
        ("stop obstacle", "wall", True),
        ("stop", "drone[0]", True),
        ("stop", "drone[1]", True),
    ]
    assert own[2] == Check(
        "stop", "drone[0]", 1e-3, "m", 0.0, True, 0.0, ("drone[0]",), "it ends at rest where the plan begins"
    )
    assert own[0].detail == "until the plan begins, nobody touches: every two bodies stay 0 m apart throughout"
    assert [each.margin for each in own[:2]] == pytest.approx([2.8, 1.4], abs=1e-4)


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
    detail = "there is one for each agent, and all have pieces that last as long"
    assert verify_stops(MISSION, stops) == [Check("stop", "files", 0.0, "", 0.0, False, detail=detail)]


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
    assert own.margin == pytest.approx(margin, abs=1e-12)
    assert own.passed is (own.margin >= 0)


def test_nobody_ends_where_a_start_that_is_no_point_begins() -> None:
    first, second = MISSION.agents
    field = ir.Region("field", ir.Ball((1.0, 1.0, 1.0), 1.0), first.span)
    anywhere = replace(first, start=ir.Anywhere(field, first.span))
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
        assert own.detail == "it ends in the motion in which the plan begins"


@pytest.mark.parametrize(("apart", "passed"), [(0.201, True), (0.199, False)])
def test_bodies_alone_keep_apart_until_the_plan_begins(apart: float, passed: bool) -> None:
    beside = (STARTS[0][0] + apart, 1.0, 1.0)
    assert found(MISSION, standing(STARTS[0]), standing(beside))[("stop separation", "all pairs")].passed is passed
    near = (1.0, 2.5 + 0.1 - apart, 1.0)
    assert found(MISSION, standing(near), standing(STARTS[1]))[("stop obstacle", "wall")].passed is passed


def test_the_clock_of_stops_ends_at_the_plans_beginning() -> None:
    curves = stop_curves(MISSION, [standing(start) for start in STARTS])
    assert curves.times.tolist() == [-3.0, -2.0, 0.0]
    assert curves.coefficients.shape == (2, 2, 3, 8)
    flat = mission_of([(1.0, 1.0), (4.0, 1.0)], 4)
    assert stop_curves(flat, [standing(start) for start in STARTS]).coefficients.shape == (2, 2, 2, 8)
