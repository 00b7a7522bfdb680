"""Stops: from any state to rest without a jump, within the limits of the vehicle, as briefly as may be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from missionc.flight.trajectories.stop_and_hover import LONGEST, state_at, stop_and_hover, stop_together
from missionc.geometry.curves.piecewise_polynomials import Pieces
from missionc.ir.vehicle_profiles import profiles
from tests.support.hand_made_flights import place, turning, wandered

Array = NDArray[np.float64]

CRAZYFLIE = profiles()["crazyflie21"]


def state(velocity: tuple[float, ...] = (0, 0, 0, 0), acceleration: tuple[float, ...] = (0, 0, 0, 0)) -> Array:
    """At (1, 2, 1), with a nose at 0.5 rad, without jerk and snap."""
    return np.array([(1.0, 2.0, 1.0, 0.5), velocity, acceleration, (0, 0, 0, 0), (0, 0, 0, 0)], dtype=np.float64)


def flown(stop: Pieces, order: int, moments: int = 400) -> Array:
    """(moments, 4): of the first piece."""
    times = np.linspace(0, stop.duration[0], moments)
    axes = [np.polynomial.Polynomial(axis).deriv(order)(times) for axis in stop.coefficients[0]]
    return np.stack(axes, axis=-1)


def random_states(count: int, seed: int = 5) -> list[Array]:
    random = np.random.default_rng(seed)
    sizes = np.array([[0, 0, 0, 0], [0.5, 0.5, 0.2, 0.5], [0.7, 0.7, 0.5, 1], [2, 2, 2, 2], [5, 5, 5, 5]])
    base = state()
    return [base + random.uniform(-1, 1, base.shape) * sizes for _ in range(count)]


def test_a_state_is_that_of_the_flight_with_all_its_derivatives() -> None:
    flight = turning(wandered(2, 6, 3), 0.25)
    for each in flight.parts:
        for time in (0.0, 1.3, 4.71, flight.duration):
            told = state_at(each.pieces, time)
            for order in range(5):
                # At a joint either piece may be asked.
                assert told[order] == pytest.approx(place(each, time, order), abs=10.0 ** (order - 4))
    beyond = state_at(each.pieces, flight.duration + 5)
    assert beyond == pytest.approx(state_at(each.pieces, flight.duration))


def test_a_stop_begins_in_its_state_and_ends_at_rest() -> None:
    stopped = 0
    for begin in random_states(40):
        stop = stop_and_hover(begin, CRAZYFLIE)
        if stop is None:
            continue
        stopped += 1
        assert state_at(stop, 0.0) == pytest.approx(begin, abs=1e-5)
        for order in (1, 2, 3):
            assert flown(stop, order)[-1] == pytest.approx(0, abs=1e-4)
        after = stop.coefficients[1]
        assert not after[:, 1:].any()
        assert after[:, 0] == pytest.approx(flown(stop, 0)[-1], abs=1e-6)
    assert stopped >= 35


def test_a_stop_keeps_the_limits_of_its_vehicle() -> None:
    for begin in random_states(40, seed=6):
        stop = stop_and_hover(begin, CRAZYFLIE)
        if stop is None:
            continue
        velocity, acceleration, jerk = (flown(stop, order) for order in (1, 2, 3))
        slightly = 1.0011
        assert np.linalg.norm(velocity[:, :2], axis=-1).max() <= CRAZYFLIE.speed * slightly
        assert np.abs(velocity[:, 2]).max() <= CRAZYFLIE.vertical_speed * slightly
        assert np.linalg.norm(acceleration[:, :3], axis=-1).max() <= CRAZYFLIE.acceleration * slightly
        assert np.linalg.norm(jerk[:, :3], axis=-1).max() <= CRAZYFLIE.jerk * slightly
        assert np.abs(velocity[:, 3]).max() <= CRAZYFLIE.yaw_rate * slightly
        leaning = np.linalg.norm(acceleration[:, :2], axis=-1) / (9.81 + acceleration[:, 2])
        assert leaning.max() <= math.tan(CRAZYFLIE.tilt) * 1.01
        heights = flown(stop, 0)[:, 2]
        assert heights.min() >= CRAZYFLIE.height.low - 1e-3
        assert heights.max() <= CRAZYFLIE.height.high + 1e-3


def test_who_stands_stays_where_it_is() -> None:
    stop = stop_and_hover(state(), CRAZYFLIE)
    assert stop is not None
    assert np.ptp(flown(stop, 0), axis=0) == pytest.approx(0, abs=1e-7)


def test_who_is_faster_takes_longer_to_stop() -> None:
    slow, fast = (stop_and_hover(state((speed, 0, 0, 0)), CRAZYFLIE) for speed in (0.2, 0.8))
    assert slow is not None
    assert fast is not None
    assert slow.duration[0] < fast.duration[0] < LONGEST
    ways = [np.ptp(flown(stop, 0)[:, 0]) for stop in (slow, fast)]
    assert 0 < ways[0] < ways[1] < 1.2


@pytest.mark.parametrize(
    "begin",
    [
        pytest.param(state((1.5, 0, 0, 0)), id="faster than it may be"),
        pytest.param(state((0, 0, 0, 2.0)), id="turning faster than it may"),
        pytest.param(state() - [[0, 0, 0.6, 0], [0, 0, 0.4, 0], *[[0] * 4] * 3], id="sinking out of its heights"),
    ],
)
def test_there_is_no_stop_where_a_limit_cannot_be_kept(begin: Array) -> None:
    assert stop_and_hover(begin, CRAZYFLIE) is None


def test_several_stop_in_the_same_time_which_is_that_of_the_slowest() -> None:
    states = [state((0.2, 0, 0, 0)), state((0, 0.8, 0, 0))]
    together = stop_together(states, [CRAZYFLIE, CRAZYFLIE])
    assert together is not None
    alone = [stop_and_hover(each, CRAZYFLIE) for each in states]
    longest = max(float(stop.duration[0]) for stop in alone if stop is not None)
    assert {float(stop.duration[0]) for stop in together} == {longest}
