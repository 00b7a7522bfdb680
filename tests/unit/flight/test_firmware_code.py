"""Our setpoints and controller against the firmware's own C code: its recorded answers, and it itself where it is.

``tests/support/firmware_code.py`` builds it; a folder with its sources is named by ``MISSIONC_FIRMWARE``.
"""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np
import pytest

from missionc.base.trace import Array
from missionc.flight.simulation.controller import Controller, Gains
from missionc.flight.simulation.default_engine import Airborne
from missionc.flight.simulation.disturbance import setpoints
from missionc.flight.simulation.quadrotor import THRUST, Vehicle
from tests.support.firmware_code import (
    ANSWERS,
    SOURCES,
    STRONGEST,
    a_path,
    answers,
    built,
    missing,
    moments,
    situations,
)

RECORDED = "recorded"
BUILT = pytest.param("built", marks=pytest.mark.skipif(bool(missing()), reason=missing()))
TRUNCATED = 3 / 132_000 / 4
"""N: roll, pitch and yaw are integers of PWM units on board."""


@pytest.fixture(params=[RECORDED, BUILT])
def said(request: pytest.FixtureRequest) -> Any:
    """What the firmware's code says of everything that it is asked."""
    if request.param == RECORDED:
        return json.loads(ANSWERS.read_text(encoding="utf-8"))
    return answers(built(os.environ[SOURCES]))


def test_setpoints_are_what_the_firmware_makes_of_the_polynomials(said: Any) -> None:
    told = setpoints(a_path(), moments())
    theirs = np.array(said["setpoints"]).T
    assert np.ptp(theirs[6:9]) > 3, "the path accelerates"
    assert np.abs(theirs[9:12]).max() > 0.5, "the path turns"
    assert told == pytest.approx(theirs, rel=2e-5, abs=2e-5)


def test_the_height_integral_is_the_firmwares(said: Any) -> None:
    assert Gains().integral[2] == pytest.approx(said["height_integral"])


def test_motors_are_told_what_the_firmware_tells_them(said: Any) -> None:
    theirs = np.array(said["thrusts"])
    states, orders = situations()
    controller = Controller(STRONGEST, Gains(), 1 / 500, 3)
    for command in range(12):
        state, told = states[:, command].T, orders[:, command].T
        ours = controller.thrust(state[:3], state[3:6], np.concatenate([state, np.zeros((4, 3))]), told)
        assert np.allclose(ours.T, capped(theirs[:, command]), atol=TRUNCATED, rtol=1e-4)
    lifting = theirs.mean(axis=-1) > 0
    assert lifting[:2].any()
    assert not lifting.all(), "one is upside down now and then"


def capped(thrust: Array) -> Array:
    """As ``powerDistributionCap`` leaves them: (bodies, 4), N twice; nothing where nothing lifts."""
    over = np.maximum(thrust.max(axis=-1) - STRONGEST.strongest, 0.0)[:, None]
    return np.asarray(np.maximum(thrust - over, 0.0) * (thrust.mean(axis=-1) > 0)[:, None])


def test_a_heavier_vehicle_sinks_as_the_firmware_lets_it_sink(said: Any) -> None:
    theirs = np.array(said["heavier"])
    assert -0.038 < theirs.min() < -0.036
    assert -0.030 < theirs[16] < -0.027, "eight seconds later"
    vehicle = Vehicle()
    place = np.array([[0.0], [0.0], [1.0]])
    air = Airborne(place, np.zeros(1), np.array([1.17 * vehicle.mass]))
    told = np.zeros((13, 1))
    told[:3] = place
    heights = [0.0]
    for _ in range(19):
        for _ in range(50):
            air.advance(told)
        heights.append(float(air.position[2, 0]) - 1)
    assert heights == pytest.approx(theirs, abs=3e-4)
    assert air._state[THRUST, 0] == pytest.approx(1.17 * vehicle.mass * 9.81 / 4, rel=0.02)
