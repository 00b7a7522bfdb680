"""What disturbs a flight: what is drawn for it, and what it does to a vehicle, against known answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc.base.trace import Array
from missionc.flight.simulation import disturbance
from missionc.flight.simulation.default_engine import Airborne, Estimate, Flown, fly, push, sample_times
from missionc.flight.simulation.disturbance import (
    GRAVITY,
    NOISE_SECONDS,
    SETPOINTS_PER_SECOND,
    Disturbance,
    Drawn,
    drawn,
)
from missionc.flight.simulation.quadrotor import Vehicle
from missionc.geometry.curves.piecewise_polynomials import Pieces

# ---------------------------------------------------------------- what is drawn


def test_gusts_have_the_strength_and_the_length_that_was_asked() -> None:
    wind = drawn(Disturbance(gust=0.4), 3, range(40), 2, 1000).wind
    assert wind.std() == pytest.approx(0.4, rel=0.05)
    together = (wind[:, :, 50:] * wind[:, :, :-50]).mean() / wind.var()
    assert together == pytest.approx(np.exp(-1), abs=0.05)


def test_every_draw_is_within_its_bounds() -> None:
    found = drawn(Disturbance(wind=2.0, mass=0.1, start=0.05, clock=0.03), 1, range(50), 3, 2)
    assert isinstance(found, Drawn)
    assert 0.9 <= found.mass.min() < 0.91
    assert 1.09 < found.mass.max() <= 1.1
    assert 0.049 < np.abs(found.start[..., :2]).max() <= 0.05
    assert not found.start[..., 2].any()
    assert found.clock.min() >= 0
    assert found.clock.max() <= 0.03
    assert np.allclose(np.linalg.norm(found.wind, axis=-1), 2.0)
    assert np.array_equal(found.wind[:, 0], found.wind[:, 1])


def test_the_estimators_error_has_the_strength_and_the_length_that_was_asked() -> None:
    noise = drawn(Disturbance(noise=0.02), 3, range(40), 2, 1000).noise
    assert noise is not None
    assert noise.std() == pytest.approx(0.02, rel=0.05)
    late = round(NOISE_SECONDS * SETPOINTS_PER_SECOND)
    together = (noise[:, :, late:] * noise[:, :, :-late]).mean() / noise.var()
    assert together == pytest.approx(np.exp(-1), abs=0.05)


def test_one_motor_of_each_is_weak_and_none_weaker_than_asked() -> None:
    motors = drawn(Disturbance(motor=0.2), 1, range(50), 3, 2).motors
    assert ((motors < 1).sum(axis=-1) == 1).all()
    assert 0.8 <= motors.min() < 0.81
    assert set(motors.argmin(axis=-1).ravel().tolist()) == {0, 1, 2, 3}


def test_as_many_updates_and_starts_are_missed_as_was_asked() -> None:
    found = drawn(Disturbance(packets=0.3, missed=0.1), 1, range(100), 5, 50)
    assert found.stale is not None
    assert found.stale.mean() == pytest.approx(0.3, abs=0.01)
    assert np.isinf(found.clock).mean() == pytest.approx(0.1, abs=0.03)


def test_nothing_is_drawn_where_nothing_is_asked() -> None:
    assert not Disturbance(latency=0.1, battery=0.1, downwash=1.0, lose=(("a", 1.0),)).random
    for name in ("wind", "gust", "mass", "start", "clock", "noise", "packets", "missed", "motor"):
        assert replace(Disturbance(), **{name: 0.1}).random


# ------------------------------------------------------------- what a controller is shown


def walk(command: int) -> Array:
    """A state that moves by 1 mm with each command of 2 ms: (6, 1)."""
    return np.array([[0.001 * command], [0.0], [1.0], [0.5], [0.0], [0.0]])


def test_a_late_estimate_is_the_state_of_so_many_commands_ago() -> None:
    estimate = Estimate(walk(0), 3, 0.002)
    shown = [float(estimate.shown(walk(command), None, None)[0][0, 0]) for command in range(6)]
    assert shown == pytest.approx([0, 0, 0, 0, 0.001, 0.002])


def test_where_no_update_comes_it_goes_on_at_the_velocity_of_the_last() -> None:
    estimate = Estimate(walk(0), 0, 0.002)
    none, some = np.array([True]), np.array([False])
    estimate.shown(walk(5), None, some)
    elsewhere = walk(50)
    first, _ = estimate.shown(elsewhere, None, none)
    second, velocity = estimate.shown(elsewhere, None, none)
    assert (first[0, 0], second[0, 0]) == pytest.approx((0.006, 0.007))
    assert velocity[0, 0] == 0.5
    assert estimate.shown(elsewhere, None, some)[0][0, 0] == pytest.approx(0.05)


def test_an_error_is_added_to_the_position_and_not_to_the_velocity() -> None:
    position, velocity = Estimate(walk(0), 0, 0.002).shown(walk(2), np.array([[0.1], [0.2], [0.3]]), None)
    assert position[:, 0] == pytest.approx([0.102, 0.2, 1.3])
    assert velocity[:, 0].tolist() == [0.5, 0, 0]


# -------------------------------------------------------------------- what a vehicle does


def hover(disturbance: Disturbance, seconds: float, flights: int = 1) -> Flown:
    """A vehicle that is told to stand at a place 1 m high, and then to go 0.5 m in x within 2 s."""
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, 2, 0] = 1.0
    coefficients[0, 0, 3:6] = 0.5 * np.array([10, -15, 6]) / 2.0 ** np.array([3, 4, 5])
    found = drawn(disturbance, 4, range(flights), 1, sample_times(seconds).size)
    return fly([Pieces(np.array([2.0]), coefficients)], found, seconds, disturbance=disturbance)


def test_who_never_hears_the_start_hovers_where_it_began() -> None:
    assert np.abs(hover(Disturbance(missed=1.0), 3.0).position[0, 0] - (0, 0, 1)).max() < 1e-9


def test_a_battery_carries_as_long_as_four_motors_give_the_weight() -> None:
    vehicle = Vehicle()
    enough = vehicle.mass * GRAVITY / (4 * vehicle.strongest)
    sag = 0.5
    flight = hover(Disturbance(battery=sag), 8.0)
    until = flight.times < 8 * (1 - enough) / sag
    assert 5 < until.sum() / SETPOINTS_PER_SECOND < 7
    assert np.abs(flight.position[0, 0, until, 2] - 1).max() < 2e-3
    assert flight.position[0, 0, -1, 2] < 0.9


def test_a_weak_motor_lets_it_down_by_its_share_of_the_weight() -> None:
    place = np.array([[0.0], [0.0], [1.0]])
    motors = np.array([[0.9], [1.0], [1.0], [1.0]])
    air = Airborne(place, np.zeros(1), vehicle=Vehicle(lag=0.0), motors=motors)
    told = np.zeros((13, 1))
    told[disturbance.POSITION] = place
    air.advance(told)
    assert air.velocity[2, 0] == pytest.approx(-0.025 * GRAVITY / SETPOINTS_PER_SECOND, rel=0.06)


def test_latency_noise_and_lost_packets_cost_accuracy() -> None:
    def error(disturbance: Disturbance) -> float:
        flight = hover(disturbance, 2.5, 3)
        return float(np.linalg.norm(flight.position[:, 0] - told, axis=-1).max())

    told = hover(Disturbance(), 2.5).position[0, 0]
    assert 0.002 < error(Disturbance(noise=0.01)) < 0.05
    assert 0.0005 < error(Disturbance(latency=0.05)) < 0.05
    assert 0.0 < error(Disturbance(packets=0.2)) < error(Disturbance(packets=0.7)) < 0.05


# ------------------------------------------------------------------------- downwash


def test_the_push_is_that_of_the_model_below_and_none_above() -> None:
    # 2267.18 N * (0.0231348 m / (4 * 0.5 m))^2 right below; a Gaussian of |0.16 * 0.5 - 0.11| m sideways.
    position = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.5]])
    assert push(position, 2) == pytest.approx([2267.18 * (0.0231348 / 2) ** 2, 0])
    position[0, 1] = 0.03
    assert push(position, 2)[0] == pytest.approx(2267.18 * (0.0231348 / 2) ** 2 * np.exp(-0.5))


def test_nobody_is_pushed_by_who_flies_in_another_flight() -> None:
    position = np.array([[0.0, 5.0, 0.0, 5.0], [0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.5, 1.5]])
    assert not push(position, 2).any()
    assert push(position, 4)[:2].all()


def test_nobody_is_pushed_by_rotors_that_stand() -> None:
    position = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 1.5, 2.0]])
    both = push(position, 3)
    upper = push(position, 3, np.array([False, True, False]))
    assert 0 < upper[0] < both[0]
    assert upper[1] == both[1] > 0


def test_who_hovers_below_sinks() -> None:
    position = np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 1.6]])
    air = Airborne(position, np.zeros(2), downwash=1.0)
    told = np.zeros((13, 2))
    told[disturbance.POSITION] = position
    for _ in range(200):
        air.advance(told)
    assert 0.02 < 1 - air.position[2, 0] < 0.4
    assert air.position[2, 1] == pytest.approx(1.6, abs=1e-6)
