"""The simulated quadrotor against what is known without it: free fall, what is conserved, known answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc.base.trace import Array
from missionc.flight.simulation import quadrotor
from missionc.flight.simulation.controller import Gains
from missionc.flight.simulation.default_engine import Flown, fly, sample_times
from missionc.flight.simulation.disturbance import GRAVITY, UNDISTURBED, Disturbance, drawn, setpoints
from missionc.flight.simulation.quadrotor import Vehicle, at_rest, heading, moved
from missionc.geometry.curves.piecewise_polynomials import Pieces, values

STILL_AIR = replace(Vehicle(), drag=(0.0, 0.0))
PROPORTIONAL = replace(Gains(), integral=(0.0, 0.0, 0.0))


def path(*corners: tuple[float, float, float], seconds: float = 2.0) -> Pieces:
    """From rest to rest in a straight line from corner to corner: a quintic for each."""
    places = np.array(corners)
    powers = seconds ** -np.array([3.0, 4.0, 5.0]) * np.array([10.0, -15.0, 6.0])
    coefficients = np.zeros((len(corners) - 1, 4, 8))
    coefficients[:, :3, 0] = places[:-1]
    coefficients[:, :3, 3:6] = np.diff(places, axis=0)[..., None] * powers
    rounded = coefficients.astype(np.float32).astype(np.float64)
    return Pieces(np.full(len(corners) - 1, seconds), rounded)


def flown(pieces: Pieces, seconds: float, vehicle: Vehicle = STILL_AIR, **others: object) -> tuple[Flown, Array]:
    """One agent's flight, and its error: (samples, 3), m."""
    ticks = sample_times(seconds).size
    conditions = replace(drawn(UNDISTURBED, 0, range(1), 1, ticks), **{k: v for k, v in others.items() if k != "gains"})
    flight = fly([pieces], conditions, seconds, vehicle, others.get("gains"))  # type: ignore[arg-type]
    return flight, flight.position[0, 0] - setpoints(pieces, flight.times)[:3].T


def tumbling() -> Array:
    state = at_rest(STILL_AIR, np.array([[0.0], [0.0], [1.0]]), np.array([0.3]))
    state[quadrotor.RATES, 0] = (3.0, -5.0, 2.0)
    state[quadrotor.VELOCITY, 0] = (0.4, 0.1, -0.2)
    return state


def after(state: Array, thrust: Array, seconds: float, steps: int, vehicle: Vehicle = STILL_AIR) -> Array:
    for _ in range(steps):
        state = moved(vehicle, np.array([vehicle.mass]), state, thrust, np.zeros((3, 1)), seconds / steps)
    return state


# ------------------------------------------------------------------- the body


def test_without_thrust_it_falls_freely() -> None:
    state = at_rest(STILL_AIR, np.array([[0.0], [0.0], [5.0]]), np.zeros(1))
    state[quadrotor.THRUST] = 0.0
    state = after(state, np.zeros((4, 1)), 0.8, 40)
    assert state[2, 0] == pytest.approx(5 - GRAVITY * 0.8**2 / 2, abs=1e-12)
    assert state[5, 0] == pytest.approx(-GRAVITY * 0.8, abs=1e-12)


def test_drag_ends_the_fall_at_the_speed_where_it_carries_the_weight() -> None:
    vehicle = replace(Vehicle(), drag=(0.5, 0.5))
    state = at_rest(vehicle, np.zeros((3, 1)), np.zeros(1))
    state[quadrotor.THRUST] = 0.0
    state = after(state, np.zeros((4, 1)), 2.0, 500, vehicle)
    assert state[5, 0] == pytest.approx(-vehicle.mass * GRAVITY / 0.5, rel=1e-9)


def test_a_thrust_of_its_weight_keeps_it_where_it_is() -> None:
    start = at_rest(Vehicle(), np.array([[1.0], [2.0], [1.5]]), np.array([0.7]))
    end = after(start, start[quadrotor.THRUST], 3.0, 300, Vehicle())
    assert np.allclose(end, start, atol=1e-12)


def test_a_tumbling_body_keeps_its_energy_and_angular_momentum_and_stays_a_rotation() -> None:
    inertia = np.array(STILL_AIR.inertia)

    def kept(state: Array) -> tuple[float, Array]:
        rates, speed = state[quadrotor.RATES, 0], state[quadrotor.VELOCITY, 0]
        mass = STILL_AIR.mass
        energy = (inertia * rates**2).sum() / 2 + mass * (speed**2).sum() / 2 + mass * GRAVITY * state[2, 0]
        body = np.concatenate(quadrotor.axes(state[quadrotor.ATTITUDE]), axis=1)
        return float(energy), body @ (inertia * rates)

    start = tumbling()
    start[quadrotor.THRUST] = 0.0
    end = after(start, np.zeros((4, 1)), 2.0, 1000)
    assert kept(end)[0] == pytest.approx(kept(start)[0], rel=1e-5)
    assert np.allclose(kept(end)[1], kept(start)[1], rtol=1e-4)
    body = np.concatenate(quadrotor.axes(end[quadrotor.ATTITUDE]), axis=1)
    assert np.allclose(body @ body.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(body) == pytest.approx(1.0, abs=1e-12)


def test_halving_the_step_divides_the_error_by_four() -> None:
    thrust = np.array([[0.05], [0.06], [0.08], [0.07]])
    exact = after(tumbling(), thrust, 0.4, 6400)
    coarse, fine = (np.abs(after(tumbling(), thrust, 0.4, steps) - exact).max() for steps in (100, 200))
    assert 3.5 < coarse / fine < 4.5


def test_a_motor_follows_its_command_with_its_lag() -> None:
    state = at_rest(STILL_AIR, np.zeros((3, 1)), np.zeros(1))
    begin = float(state[13, 0])
    end = after(state, np.full((4, 1), 0.1), STILL_AIR.lag, 100)
    assert end[13, 0] == pytest.approx(0.1 + (begin - 0.1) / np.e, rel=1e-4)


def test_heading_is_read_back() -> None:
    yaw = np.array([-3.0, -1.0, 0.0, 2.0])
    assert np.allclose(heading(at_rest(Vehicle(), np.zeros((3, 4)), yaw)[quadrotor.ATTITUDE]), yaw)


# -------------------------------------------------------------- what it is told


def test_setpoints_are_the_polynomials_and_their_derivatives() -> None:
    pieces = path((0, 0, 1), (1, 2, 1.5), (0.5, 0, 1))
    times = np.linspace(0.01, 3.99, 57)
    told = setpoints(pieces, times)
    index = np.minimum((times // 2).astype(int), 1)
    coefficients = pieces.coefficients[index, :3]
    for row in range(3):
        assert np.allclose(told[3 * row : 3 * row + 3].T, values(coefficients, times - 2 * index), atol=2e-5)
        coefficients = coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])


def test_body_rates_are_those_that_turn_the_thrust_along_the_path() -> None:
    pieces = path((0, 0, 1), (2, 1, 1.2))
    times = np.linspace(0.1, 1.9, 37)
    told = setpoints(pieces, times)
    for column, time in zip(told.T, times.tolist(), strict=True):
        force, later = (setpoints(pieces, np.array([at]))[6:9, 0] + (0, 0, GRAVITY) for at in (time, time + 1e-3))
        up, then = force / np.linalg.norm(force), later / np.linalg.norm(later)
        ahead = np.cross([-np.sin(column[12]), np.cos(column[12]), 0], up)
        ahead /= np.linalg.norm(ahead)
        left = np.cross(up, ahead)
        turning = (then - up) / 1e-3
        assert column[9:11] == pytest.approx([-turning @ left, turning @ ahead], abs=0.02)


def test_before_the_start_and_after_the_end_it_is_told_to_stand() -> None:
    told = setpoints(path((0, 0, 1), (1, 0, 1)), np.array([-0.5, 2.5]))
    assert np.allclose(told[:3].T, [(0, 0, 1), (1, 0, 1)], atol=1e-5)
    assert not told[3:12].any()


# ------------------------------------------------------------------ the flight


def test_it_hovers() -> None:
    _, error = flown(path((1, 1, 1), (1, 1, 1)), 2.0, Vehicle())
    assert np.abs(error).max() < 1e-9


def test_a_straight_flight_is_tracked_within_millimetres() -> None:
    _, error = flown(path((0, 0, 1), (1, 0.5, 1.2), seconds=4.0), 5.0)
    assert np.abs(error).max() < 4e-3
    assert np.abs(error[-1]).max() < 1e-3


def test_it_comes_to_its_place_from_beside_it() -> None:
    _, error = flown(path((0, 0, 1), (0, 0, 1)), 4.0, start=np.array([[[0.2, -0.1, 0.0]]]), gains=PROPORTIONAL)
    assert np.abs(error[0]).max() == pytest.approx(0.2)
    assert np.abs(error).max() < 0.21
    assert np.abs(error[-1]).max() < 2e-3


def test_without_an_integral_five_grams_too_many_cost_the_height_that_the_controller_predicts() -> None:
    mass = np.array([[1 + 0.005 / Vehicle().mass]])
    _, error = flown(path((0, 0, 1), (0, 0, 1)), 6.0, mass=mass, gains=PROPORTIONAL)
    assert error[-1, 2] == pytest.approx(-0.005 * GRAVITY / PROPORTIONAL.stiffness[2], rel=1e-3)
    _, mended = flown(path((0, 0, 1), (0, 0, 1)), 12.0, mass=mass)
    assert -0.039 < mended[:, 2].min() < -0.037
    assert -0.026 < mended[-1, 2] < -0.024, "the integral that firmware is released with is slow"


def test_a_constant_wind_costs_what_its_drag_is_worth() -> None:
    ticks = sample_times(6.0).size
    wind = np.tile(np.array([1.0, 0.0, 0.0]), (1, 1, ticks, 1))
    _, error = flown(path((0, 0, 1), (0, 0, 1)), 6.0, Vehicle(), wind=wind, gains=PROPORTIONAL)
    # The wind pushes a little less along the axis of a vehicle that leans against it.
    assert error[-1, 0] == pytest.approx(Vehicle().drag[0] / PROPORTIONAL.stiffness[0], rel=0.02)


def test_what_its_thrust_cannot_do_is_not_tracked() -> None:
    climb = path((0, 0, 1), (0, 0, 9))
    peak = setpoints(climb, np.linspace(0, 2, 201))[8].max()
    assert (peak + GRAVITY) * Vehicle().mass > 4 * Vehicle().strongest
    _, error = flown(climb, 2.0)
    assert error[:, 2].min() < -0.5


def test_a_late_clock_is_an_error_along_the_way() -> None:
    pieces = path((0, 0, 1), (1, 0, 1), seconds=4.0)
    _, error = flown(pieces, 4.0, clock=np.array([[0.1]]))
    speed = setpoints(pieces, np.array([2.0]))[3, 0]
    assert error[200, 0] == pytest.approx(-0.1 * speed, abs=5e-3)


def test_flights_together_are_the_flights_alone() -> None:
    pieces = [path((0, 0, 1), (1, 0, 1)), path((0, 1, 1), (1, 1, 1))]
    disturbance = Disturbance(wind=0.5, gust=0.3, mass=0.05, start=0.02, clock=0.03)
    ticks = sample_times(1.0).size

    def several(numbers: range) -> Array:
        return fly(pieces, drawn(disturbance, 7, numbers, 2, ticks), 1.0).position

    together = several(range(4))
    assert np.array_equal(together, several(range(4)))
    assert np.allclose(together[2:], several(range(2, 4)), rtol=0, atol=1e-12)
    assert not np.allclose(together[0], together[1])
