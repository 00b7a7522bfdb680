"""Bodies in the air that are moved from setpoint to setpoint: told something else on the way, or lost."""

from __future__ import annotations

import numpy as np
import pytest

from missionc.base.trace import Array
from missionc.flight.simulation import disturbance
from missionc.flight.simulation.default_engine import Airborne
from missionc.flight.simulation.disturbance import GRAVITY, SETPOINTS_PER_SECOND
from missionc.flight.simulation.quadrotor import Vehicle

PLACES = np.array([[0.0, 2.0], [0.0, 0.0], [1.0, 1.5]])


def stand(places: Array) -> Array:
    """What bodies are told that are to stand at places: (3, bodies), m -> (13, bodies)."""
    reference = np.zeros((13, places.shape[1]))
    reference[disturbance.POSITION] = places
    return reference


def after(air: Airborne, reference: Array, seconds: float) -> Airborne:
    for _ in range(round(seconds * SETPOINTS_PER_SECOND)):
        air.advance(reference)
    return air


def test_bodies_stay_where_they_are_told_to_stand() -> None:
    air = after(Airborne(PLACES, np.array([0.3, -1.0])), stand(PLACES) + np.eye(13)[12:].T * [0.3, -1.0], 1.0)
    assert np.allclose(air.position, PLACES, atol=1e-9)
    assert np.allclose(air.velocity, 0.0, atol=1e-9)
    assert np.allclose(air.heading, [0.3, -1.0], atol=1e-9)


def test_bodies_that_are_told_another_place_in_flight_go_there() -> None:
    air = after(Airborne(PLACES, np.zeros(2)), stand(PLACES), 0.5)
    elsewhere = PLACES + np.array([[0.3, 0.0], [0.0, 0.2], [0.0, 0.0]])
    after(air, stand(elsewhere), 6.0)
    assert np.allclose(air.position, elsewhere, atol=0.02)


def test_a_lost_body_falls_freely_and_nobody_else_does() -> None:
    vehicle = Vehicle(lag=0.0, drag=(0.0, 0.0))
    air = Airborne(PLACES, np.zeros(2), vehicle=vehicle)
    air.lose(1)
    after(air, stand(PLACES), 0.3)
    assert air.position[:, 1] == pytest.approx([2.0, 0.0, 1.5 - GRAVITY * 0.3**2 / 2], abs=1e-9)
    assert air.velocity[2, 1] == pytest.approx(-GRAVITY * 0.3, abs=1e-9)
    assert air.position[:, 0] == pytest.approx(PLACES[:, 0], abs=1e-9)
    assert air.lost.tolist() == [False, True]


def test_a_lost_body_lies_on_the_ground_for_good() -> None:
    air = Airborne(PLACES, np.zeros(2))
    air.lose(0)
    after(air, stand(PLACES), 2.0)
    assert air.position[2, 0] == 0.0
    assert not air.velocity[:, 0].any()
    there = air.position[:, 0]
    after(air, stand(PLACES + 1.0), 1.0)
    assert np.array_equal(air.position[:, 0], there)


def test_what_was_read_of_bodies_does_not_move_with_them() -> None:
    air = Airborne(PLACES, np.zeros(2))
    position = air.position
    after(air, stand(PLACES + 0.2), 0.5)
    assert np.array_equal(position, PLACES)


def test_nobody_is_lost_who_is_not_there() -> None:
    with pytest.raises(IndexError):
        Airborne(PLACES, np.zeros(2)).lose(2)
