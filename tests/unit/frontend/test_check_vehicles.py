"""What vehicles cannot do in a mission, found before any planning."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import (
    AGENTS_OVERLAP,
    FASTER_THAN_VEHICLE,
    FORMATION_TOO_TIGHT,
    NO_FLYING_ROOM,
    OUTLASTS_VEHICLE,
    OUTSIDE_FLYING_ROOM,
    OUTSIDE_WORLD,
    TOO_FAR,
)
from tests.support.check_findings import WORLD, found, only, text, words

VOLUME = WORLD.replace("(0, 0)", "(0, 0, 0)").replace("(10, 10)", "(10, 10, 3)")
HOME = "require home: every drone: eventually[0, 20 s] base"
CODES = (
    FASTER_THAN_VEHICLE,
    NO_FLYING_ROOM,
    OUTLASTS_VEHICLE,
    OUTSIDE_FLYING_ROOM,
    AGENTS_OVERLAP,
    FORMATION_TOO_TIGHT,
)


def drones(items: str, moves: str = "single_integrator(speed <= 1 m/s)", vehicle: str = "crazyflie21") -> str:
    return f"team drone[2] {{ vehicle {vehicle}  dynamics {moves}  {items} }}"


def quiet(mission: str) -> bool:
    return not any(found(mission, code) for code in CODES)


# -------------------------------------------------------------------- speeds


def test_dynamics_faster_than_the_vehicle_are_warned_of() -> None:
    finding = only(text(HOME, agents=drones("start in base", "unicycle(speed 0..2 m/s)")), FASTER_THAN_VEHICLE)
    assert finding.message == "`drone` may move at 2 m/s; its vehicle flies at most 1 m/s"
    assert words(finding) == [("drone", "vehicle `crazyflie21`")]


def test_dynamics_that_accelerate_harder_are_warned_of() -> None:
    moves = "double_integrator(speed <= 1 m/s, acceleration <= 3 m/s^2)"
    finding = only(text(HOME, agents=drones("start in base", moves)), FASTER_THAN_VEHICLE)
    assert finding.message == "`drone` may accelerate at 3 m/s^2; its vehicle flies at most 2 m/s^2"


@pytest.mark.parametrize("vehicle", ["plain", "crazyflie21 { speed <= 2 m/s }"])
def test_dynamics_within_the_limit_are_not(vehicle: str) -> None:
    mission = text(HOME, agents=drones("start in base", "single_integrator(speed <= 2 m/s)", vehicle))
    assert quiet(mission)


def test_what_no_flight_reaches_in_time_is_an_error_though_dynamics_would() -> None:
    moves = "single_integrator(speed <= 4 m/s)"
    far = "require far: every drone: eventually[0, 4 s] x >= 9"
    climb = "require up: every drone: eventually[0, 2 s] z >= 2.9"
    assert not found(text(climb, agents=drones("start at (2, 2, 1), (2, 4, 1)", moves), world=VOLUME), TOO_FAR)
    for vehicle, reached in (("crazyflie21", False), ("crazyflie21 { speed <= 4 m/s }", True), ("plain", True)):
        mission = text(far, agents=drones("start at (2, 2), (2, 4)", moves, vehicle))
        if reached:
            assert not found(mission, TOO_FAR)
        else:
            assert only(mission, TOO_FAR).notes[-1] == "the vehicle of `drone` flies at most 1 m/s"


# ----------------------------------------------------------------- endurance


def test_a_mission_that_lasts_longer_than_its_vehicle_flies_is_refused() -> None:
    finding = only(
        text(HOME, agents=drones("start in base", vehicle="crazyflie21 { endurance <= 19 s }")), OUTLASTS_VEHICLE
    )
    assert finding.message == "`drone` flies 19 s on one charge; the mission lasts 20 s"
    assert words(finding)[0] == ("drone", "vehicle `crazyflie21`")


@pytest.mark.parametrize("vehicle", ["plain", "crazyflie21", "crazyflie21 { endurance <= 20 s }"])
def test_a_mission_that_lasts_no_longer_is_not(vehicle: str) -> None:
    assert quiet(text(HOME, agents=drones("start in base", vehicle=vehicle)))


# ---------------------------------------------------------------------- room


def test_a_fence_that_leaves_no_room_is_refused() -> None:
    mission = text(HOME, agents=drones("start in base", vehicle="crazyflie21 { fence_inset 6 m }"))
    finding = only(mission, NO_FLYING_ROOM)
    assert finding.message == "the world has no flight volume for `drone`"
    assert finding.notes == ("`crazyflie21` needs a distance of 6.05 m to the borders of the world",)


def test_a_band_above_the_world_is_refused() -> None:
    agents = drones("start at (1, 1, 1), (2, 1, 1)", vehicle="crazyflie21 { height 3..4 m }")
    finding = only(text(HOME, agents=agents, world=VOLUME), NO_FLYING_ROOM)
    assert "a height between 3 m and 4 m" in finding.notes[0]


def test_an_altitude_outside_the_band_is_refused() -> None:
    finding = only(text(HOME, agents=drones("start in base  altitude 2.5 m")), NO_FLYING_ROOM)
    assert finding.message == "`drone` flies at 2.5 m; its vehicle flies between 0.3 m and 2 m"
    assert quiet(text(HOME, agents=drones("start in base  altitude 2 m")))


# -------------------------------------------------------------------- places


def test_a_start_beyond_the_fence_is_refused() -> None:
    finding = only(text(HOME, agents=drones("start at (1, 1), (9.9, 1)")), OUTSIDE_FLYING_ROOM)
    assert finding.message == (
        "`drone[1]` starts at (9.9, 1), outside the flight volume of its vehicle, (0.25, 0.25) to (9.75, 9.75)"
    )
    assert quiet(text(HOME, agents=drones("start at (1, 1), (9.75, 1)")))


def test_a_start_on_the_ground_is_refused_for_all_at_once() -> None:
    finding = only(text(HOME, agents=drones("start line (1, 1, 0) to (2, 1, 0)"), world=VOLUME), OUTSIDE_FLYING_ROOM)
    assert finding.notes[1:] == ("also `drone[1]`",)


def test_a_place_outside_the_world_is_said_to_be_that_alone() -> None:
    mission = text(HOME, agents=drones("start at (1, 1), (11, 1)"))
    assert only(mission, OUTSIDE_WORLD).message.startswith("`drone[1]`")
    assert quiet(mission)


def test_a_region_wholly_beyond_the_fence_is_refused() -> None:
    edge = "region edge = box (9.85, 0) to (10, 10)"
    finding = only(text(edge, HOME, agents=drones("start in base  finish in edge")), OUTSIDE_FLYING_ROOM)
    assert finding.message.startswith("`drone[0]` finishes in `edge`, outside the flight volume")
    wider = "region edge = box (9.75, 0) to (10, 10)"
    assert found(text(wider, HOME, agents=drones("start in base  finish in edge")), OUTSIDE_FLYING_ROOM) == []


# ------------------------------------------------------------------- spacing


def test_starts_closer_than_vehicles_may_be_are_refused() -> None:
    finding = only(text(HOME, agents=drones("start at (1, 1), (1.38, 1)")), AGENTS_OVERLAP)
    assert finding.message == "`drone[0]` and `drone[1]` start 0.38 m apart"
    assert finding.notes == ("their vehicles need 0.4 m between centres",)
    assert quiet(text(HOME, agents=drones("start at (1, 1), (1.41, 1)")))


def test_a_separation_that_takes_more_is_named_instead() -> None:
    finding = only(text("separation 0.5 m", HOME, agents=drones("start at (1, 1), (1.5, 1)")), AGENTS_OVERLAP)
    assert finding.notes == ("the radii and the separation need 0.7 m",)


def test_two_teams_keep_what_the_more_demanding_asks() -> None:
    scout = "agent scout { dynamics single_integrator(speed <= 1 m/s)  start at (1.3, 1) }"
    near = drones("start at (1, 1), (5, 1)", vehicle="plain { pair_distance 0.35 m }")
    assert only(text(scout, HOME, agents=near), AGENTS_OVERLAP).message.startswith("`drone[0]` and `scout` start 0.3 m")
    assert quiet(text(scout, HOME, agents=near.replace("0.35 m", "0.25 m")))


def test_a_formation_closer_than_vehicles_may_be_is_refused() -> None:
    row = "formation row = line of drone spacing 0.3 m tolerance 0.05 m"
    formed = "require form: eventually[0, 20 s] row"
    finding = only(text(row, formed, agents=drones("start in base")), FORMATION_TOO_TIGHT)
    assert finding.notes[0] == "their vehicles need 0.4 m between centres"
    assert quiet(text(row, formed, agents=drones("start in base", vehicle="plain")))
