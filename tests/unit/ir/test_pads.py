"""``flight``: what it says of pads, and what is in the way of rising from them, found before any planning."""

from __future__ import annotations

import math

import pytest

from missionc import ir
from missionc.base.diagnostics.code import (
    DECLARED_AGAIN,
    PADS_TOO_NEAR,
    UNKNOWN_SETTING,
    UNUSABLE_PAD,
    VALUE_OUT_OF_RANGE,
)
from missionc.frontend.explain.explanation import flights_said
from tests.support.check_findings import WORLD, findings, found, meant, only, text, words

VOLUME = WORLD.replace("(0, 0)", "(0, 0, 0)").replace("(10, 10)", "(10, 10, 3)")
HOME = "require home: every drone: eventually[0, 20 s] base"
CODES = (PADS_TOO_NEAR, UNUSABLE_PAD, UNKNOWN_SETTING, VALUE_OUT_OF_RANGE)


def drones(flight: str, starts: str = "at (1, 1, 1), (2, 1, 1.5)", vehicle: str = "crazyflie21") -> str:
    moves = "single_integrator(speed <= 1 m/s)"
    return f"team drone[2] {{ vehicle {vehicle}  dynamics {moves}  start {starts}  {flight} }}"


def mission(flight: str, *parts: str, starts: str = "at (1, 1, 1), (2, 1, 1.5)") -> str:
    return text(HOME, *parts, agents=drones(flight, starts), world=VOLUME)


def pads(flight: str) -> list[ir.Pad | None]:
    return [agent.pad for agent in meant(mission(flight)).agents]


# ------------------------------------------------------------------ what it says


def test_what_is_left_out_is_below_the_start_at_its_height_and_as_fast_as_the_vehicle_may() -> None:
    for pad in pads("flight"):
        assert pad is not None
        assert (pad.point, pad.hover) == (None, None)
        assert math.isinf(pad.rise)
        assert math.isinf(pad.land)


def test_a_team_without_it_has_no_pads() -> None:
    assert pads("") == [None, None]


def test_pads_heights_and_speeds_are_read_in_si_units() -> None:
    first, second = pads("flight { pads at (4, 4, 0), (500 cm, 4, 0)  hover 80 cm  rise <= 0.3 m/s  land <= 0.2 m/s }")
    assert first is not None
    assert second is not None
    assert [each.point for each in (first, second)] == [(4, 4), (5, 4)]
    assert (first.hover, first.rise, first.land) == (0.8, 0.3, 0.2)


def test_pads_may_stand_in_a_line() -> None:
    assert [each.point for each in pads("flight { pads line (4, 4, 0) to (6, 4, 0) }") if each] == [(4, 4), (6, 4)]


@pytest.mark.parametrize(
    ("flight", "code", "message"),
    [
        ("flight { pads at (4, 4, 0) }", VALUE_OUT_OF_RANGE, "2 agents and 1 positions"),
        ("flight { pads at (4, 4, 0.7), (5, 4, 0) }", VALUE_OUT_OF_RANGE, "at a height of 0.7 m"),
        ("flight { hoover 1 m }", UNKNOWN_SETTING, "no setting `hoover`"),
        ("flight { rise 1 m/s }", UNKNOWN_SETTING, "expected a limit, found"),
        ("flight { hover 1 m  hover 2 m }", DECLARED_AGAIN, "given twice"),
        ("flight { pads at (4, 4, 0), (5, 4, 0)  pads at (4, 4, 0), (5, 4, 0) }", DECLARED_AGAIN, "given twice"),
        ("flight  flight", DECLARED_AGAIN, "given twice"),
    ],
)
def test_what_cannot_be_meant_is_said(flight: str, code: object, message: str) -> None:
    (finding,) = [each for each in findings(mission(flight)) if each.code is code]
    assert message in finding.message


def test_in_a_plane_an_agent_hovers_at_its_altitude() -> None:
    agents = drones("flight { hover 1 m }", "at (1, 1), (2, 1)")
    assert "hovers at its `altitude`" in only(text(HOME, agents=agents), UNKNOWN_SETTING).message
    assert not [
        each for each in findings(text(HOME, agents=drones("flight", "at (1, 1), (2, 1)"))) if each.code in CODES
    ]


@pytest.mark.parametrize(
    ("flight", "said"),
    [
        (
            "flight { pads at (4, 4, 0), (5, 4, 0)  hover 0.8 m  rise <= 0.3 m/s  land <= 0.2 m/s }",
            "`drone` takes off from its pads to 0.8 m at 0.3 m/s at most, and returns to land there at 0.2 m/s at most",
        ),
        (
            "flight",
            "`drone` takes off from the floor below its starts to the height of its starts, and returns to land there",
        ),
    ],
)
def test_it_is_said_back(flight: str, said: str) -> None:
    assert flights_said(meant(mission(flight))) == [said]
    assert flights_said(meant(mission(""))) == []


# ------------------------------------------------------- what is in the way


def test_pads_nearer_than_vehicles_may_be_are_found() -> None:
    finding = only(mission("flight { pads at (4, 4, 0), (4.3, 4, 0) }"), PADS_TOO_NEAR)
    assert "are 0.3 m apart; the minimum is 0.4 m" in finding.message
    assert words(finding)[0][0].startswith("flight")
    assert not found(mission("flight { pads at (4, 4, 0), (4.4, 4, 0) }"), PADS_TOO_NEAR)


def test_starts_above_each_other_need_pads() -> None:
    stacked = "at (1, 1, 0.6), (1, 1, 1.6)"
    assert found(mission("flight", starts=stacked), PADS_TOO_NEAR)
    assert not found(mission("flight { pads at (4, 4, 0), (5, 4, 0) }", starts=stacked), PADS_TOO_NEAR)
    assert not found(mission("", starts=stacked), PADS_TOO_NEAR)


@pytest.mark.parametrize(
    ("flight", "fits"),
    [
        ("flight { pads at (0.2, 4, 0), (5, 4, 0) }", False),
        ("flight { pads at (0.26, 4, 0), (5, 4, 0) }", True),
        ("flight { hover 0.2 m }", False),
        ("flight { hover 2.1 m }", False),
        ("flight { hover 0.3 m }", True),
    ],
)
def test_a_hover_outside_the_room_of_the_vehicle_is_found(flight: str, fits: bool) -> None:
    assert (not found(mission(flight), UNUSABLE_PAD)) is fits


@pytest.mark.parametrize(
    ("obstacle", "verb"),
    [
        ("obstacle table = cylinder at (1, 1) radius 0.4 m height 0..0.7 m", "rise vertically from"),
        ("obstacle table = cylinder at (1.5, 1) radius 0.3 m height 0..0.7 m", None),
        (
            "obstacle table = cylinder at (5, 1) radius 0.4 m height 0..0.7 m moving (-0.2, 0) m/s",
            "land vertically on",
        ),
    ],
)
def test_an_obstacle_below_the_hover_is_found_where_it_is_then(obstacle: str, verb: str | None) -> None:
    seen = found(mission("flight", obstacle), UNUSABLE_PAD)
    assert [each for each in seen if verb is None or verb not in each.message] == []
    assert bool(seen) is (verb is not None)
