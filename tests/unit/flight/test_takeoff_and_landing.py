"""Take-off and landing: as fast as a vehicle may, in a column that is clear, and on the floor before it is empty."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from missionc.base.diagnostics.code import NOT_EXPORTED
from missionc.ir import Box, Disc, Obstacle, Prism, Vehicle
from missionc.output.export.takeoff_and_landing import GROUND, cannot_rise_or_land, phases
from missionc.output.export.verified_flight import Flight, flight
from missionc.verification.flight.verify_whole_flight import ACCELERATION, LANDED, SPEED
from tests.support.hand_made_flights import wandered
from tests.support.legal_plans import moving, still

REST_TO_REST = Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
"""From 0 to 1 within 1 s, at rest at both ends, without acceleration and jerk there."""


def with_vehicle(flown: Flight, vehicle: Vehicle) -> Flight:
    agents = tuple(replace(agent, vehicle=vehicle) for agent in flown.mission.agents)
    texts = {each.agent.name: each.text for each in flown.parts}
    return flight(replace(flown.mission, agents=agents), flown.kernel, flown.trace, texts)


def beside(flown: Flight, *obstacles: Obstacle) -> Flight:
    texts = {each.agent.name: each.text for each in flown.parts}
    return flight(replace(flown.mission, obstacles=obstacles), flown.kernel, flown.trace, texts)


def test_the_factors_are_those_of_the_polynomial_that_begins_and_ends_at_rest() -> None:
    for order in range(1, 4):
        assert np.allclose(REST_TO_REST.deriv(order)([0, 1]), 0)
    assert np.allclose(REST_TO_REST([0, 1]), [0, 1])
    moments = np.linspace(0, 1, 100_001)
    assert math.isclose(REST_TO_REST.deriv(1)(moments).max(), SPEED)
    assert ACCELERATION - 1e-3 < abs(REST_TO_REST.deriv(2)(moments)).max() < ACCELERATION


@pytest.mark.parametrize(
    "vehicle", [Vehicle("slow", vertical_speed=0.25), Vehicle("soft", acceleration=0.1), Vehicle("free")]
)
def test_nobody_rises_or_sinks_faster_than_it_may(vehicle: Vehicle) -> None:
    flown = with_vehicle(wandered(3), vehicle)
    lasting = phases(flown)
    moments = np.linspace(0, 1, 1001)
    for each in flown.parts:
        ways = ((each.first[2] - GROUND, lasting.rise), (each.last[2] - LANDED, lasting.sink))
        for height, seconds in ways:
            assert height / seconds * REST_TO_REST.deriv(1)(moments).max() <= vehicle.vertical_speed + 1e-9
            assert height / seconds**2 * REST_TO_REST.deriv(2)(moments).max() <= vehicle.acceleration + 1e-9
    assert lasting.rise >= 3
    assert lasting.sink >= 4
    if vehicle.name == "free":
        assert (lasting.rise, lasting.sink) == (3, 4)


def below(flown: Flight, height: float, aside: float = 0.0, at_end: bool = False) -> Box:
    """A table below the first or the last point of the first vehicle, of a height, moved aside along x."""
    x, y, _ = flown.parts[0].last if at_end else flown.parts[0].first
    return Box((x + aside, y - 0.3, 0.0), (x + aside + 0.5, y + 0.3, height))


@pytest.mark.parametrize(("at_end", "verb"), [(False, "take off vertically"), (True, "land vertically")])
def test_nobody_rises_or_sinks_through_an_obstacle(at_end: bool, verb: str) -> None:
    flown = wandered(2)
    part = flown.parts[0]
    top = (part.last if at_end else part.first)[2] - 0.5
    assert top > 0.1
    table = still(below(flown, top, at_end=at_end), "table")
    refusal = cannot_rise_or_land("cflib", beside(flown, table))
    assert refusal is not None
    assert refusal.code is NOT_EXPORTED
    assert f"`{part.agent.name}` cannot {verb}" in refusal.message
    assert "`table`" in refusal.notes[0]


@pytest.mark.parametrize(("aside", "clear"), [(0.11, True), (0.08, False)])
def test_a_body_has_room_in_its_column_and_what_a_flight_may_miss(aside: float, clear: bool) -> None:
    flown = wandered(2)
    table = still(below(flown, 0.1, aside), "table")
    assert (cannot_rise_or_land("cflib", beside(flown, table)) is None) is clear
    missing = with_vehicle(beside(flown, table), Vehicle("some", tracking=0.05))
    assert cannot_rise_or_land("cflib", missing) is not None


def test_a_disc_that_floats_below_the_first_point_is_in_the_way_however_thin() -> None:
    flown = wandered(2)
    x, y, z = flown.parts[0].first
    plate = still(Disc((x, y), 0.5, Prism(z / 2, z / 2 + 1e-6)), "plate")
    assert cannot_rise_or_land("cflib", beside(flown, plate)) is not None


def test_an_obstacle_counts_where_it_is_when_the_vehicle_passes() -> None:
    flown = wandered(2)
    away = (0.0, 50.0, 0.0)
    leaves = moving(below(flown, 0.2), (0.0, flown.duration), ((0.0, 0.0, 0.0), away))
    comes = moving(below(flown, 0.2), (0.0, flown.duration), (away, (0.0, 0.0, 0.0)))
    assert cannot_rise_or_land("cflib", beside(flown, leaves)) is not None
    assert cannot_rise_or_land("cflib", beside(flown, comes)) is None


def test_a_flight_that_outlasts_the_battery_is_refused_with_its_rise_and_its_landing() -> None:
    flown = wandered(2)
    whole = phases(flown).whole
    assert whole > flown.duration + 9
    enough = with_vehicle(flown, Vehicle("some", endurance=whole))
    assert cannot_rise_or_land("cflib", enough) is None
    refusal = cannot_rise_or_land("cflib", with_vehicle(flown, Vehicle("some", endurance=flown.duration + 9)))
    assert refusal is not None
    assert f"the flight lasts {whole:g} s from takeoff to landing, but the endurance of " in refusal.message
