"""Where noses point along a flight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Trace
from missionc.flight.trajectories.crazyflie import Flyable, crazyflie
from missionc.geometry.curves.piecewise_polynomials import Pieces, read, values
from tests.support.legal_plans import NOTHING, mission_of, straight


def pieces_of(path: np.ndarray, yaw: ir.Yaw, vehicle: ir.Vehicle = ir.PLAIN, step: float = 1.0) -> Pieces:
    """The flight of one agent along a path (steps + 1, dim), which passes verification."""
    mission = mission_of(path[:1].tolist(), len(path) - 1, step=step)
    (agent,) = mission.agents
    trace: Trace = straight(path[None], step)
    found = crazyflie(replace(mission, agents=(replace(agent, yaw=yaw, vehicle=vehicle),)), NOTHING, trace)
    assert isinstance(found, Flyable), found
    assert found.certificate.passed
    pieces = read(found.files["drone[0]"])
    assert isinstance(pieces, Pieces)
    return pieces


def sampled(pieces: Pieces, order: int = 0) -> np.ndarray:
    """All four coordinates, or a derivative of them, in order of time: (pieces * 50, 4)."""
    coefficients = pieces.coefficients
    for _ in range(order):
        coefficients = coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])
    share = (np.arange(50) + 0.5) / 50
    return np.stack([values(coefficients, part * pieces.duration) for part in share], axis=1).reshape(-1, 4)


def circle(turns: float, steps: int = 14, radius: float = 1.5) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi * turns, steps + 1)
    return np.stack([4 + radius * np.sin(angle), 4 - radius * np.cos(angle)], axis=-1)


def test_a_nose_that_points_one_way_does_so_throughout() -> None:
    yaw = sampled(pieces_of(circle(0.5), ir.Fixed(1.25)))[:, 3]
    assert (yaw == np.float32(1.25)).all()


def test_along_the_path_the_nose_points_where_the_flight_goes() -> None:
    pieces = pieces_of(circle(1.0), ir.AlongPath())
    velocity, yaw = sampled(pieces, 1), sampled(pieces)[:, 3]
    moving = np.linalg.norm(velocity[:, :2], axis=-1) > 0.2
    off = np.angle(np.exp(1j * (yaw - np.arctan2(velocity[:, 1], velocity[:, 0]))))[moving]
    assert np.abs(off).max() < np.radians(10)
    assert np.sqrt((off**2).mean()) < np.radians(3)


def test_more_than_a_turn_has_no_jump_in_it() -> None:
    pieces = pieces_of(circle(2.0, 15, 0.6), ir.AlongPath())
    yaw = sampled(pieces)[:, 3]
    assert np.abs(np.diff(yaw)).max() < 0.1
    assert yaw[-1] - yaw[0] == pytest.approx(4 * np.pi, abs=0.6)


@pytest.mark.parametrize("most", [1.5, 0.5, 0.1])
def test_a_vehicle_turns_no_faster_than_it_may(most: float) -> None:
    back = np.array([[2.0, 2.0], [3.0, 2.0], [4.0, 2.0], [4.0, 3.0], [4.0, 4.0], [3.0, 4.0], [2.0, 4.0]])
    free = sampled(pieces_of(back, ir.AlongPath()), 1)[:, 3]
    bound = sampled(pieces_of(back, ir.AlongPath(), ir.Vehicle("slow", yaw_rate=most)), 1)[:, 3]
    assert np.abs(free).max() > most
    assert 0.5 * most < np.abs(bound).max() <= most


def test_who_hovers_keeps_to_the_way_it_went() -> None:
    path = np.array([[2.0, 2.0], [3.0, 3.0], [3.0, 3.0], [3.0, 3.0], [3.0, 3.0], [3.0, 3.0], [2.0, 4.0]])
    pieces = pieces_of(path, ir.AlongPath())
    hover = sampled(pieces)[len(pieces.duration) * 50 * 3 // 6, 3]
    assert hover == pytest.approx(np.pi / 4, abs=0.1)


def test_who_never_moves_does_not_turn() -> None:
    pieces = pieces_of(np.array([[2.0, 2.0]] * 4), ir.AlongPath(), ir.Vehicle("slow", yaw_rate=1.0))
    assert np.abs(sampled(pieces)[:, 3]).max() < 1e-6


def test_yaw_changes_nothing_else() -> None:
    path = circle(0.5)
    fixed, along = pieces_of(path, ir.AHEAD), pieces_of(path, ir.AlongPath())
    assert (fixed.coefficients[:, :3] == along.coefficients[:, :3]).all()
    assert (fixed.duration == along.duration).all()
