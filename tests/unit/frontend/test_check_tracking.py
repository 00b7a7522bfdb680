"""A vehicle that may fly faster than its tracking margin was measured for, and does not say its own."""

from __future__ import annotations

import pytest

from missionc.base.diagnostics.code import TRACKING_NOT_MEASURED
from tests.support.check_findings import WORLD, found, only, text

VOLUME = WORLD.replace("(0, 0)", "(0, 0, 0)").replace("(10, 10)", "(10, 10, 3)")
HOME = "require home: every drone: eventually[0, 20 s] base"


def flown(vehicle: str) -> str:
    moves = "single_integrator(speed <= 1 m/s)"
    return text(HOME, agents=f"team drone[2] {{ vehicle {vehicle}  dynamics {moves}  start in base }}")


@pytest.mark.parametrize(
    ("figure", "words", "help_"),
    [
        ("speed <= 2 m/s", "a speed of 2 m/s; the tracking margin of `crazyflie21` was measured up to 1 m/s", "0.1 m"),
        ("vertical_speed <= 0.75 m/s", "a vertical speed of 0.75 m/s", "0.075 m"),
        ("acceleration <= 2.5 m/s^2", "an acceleration of 2.5 m/s^2", "set `tracking` in `vehicle`"),
        ("jerk <= 30 m/s^3", "a jerk of 30 m/s^3", "set `tracking` in `vehicle`"),
    ],
)
def test_a_raised_limit_needs_a_margin_of_its_own(figure: str, words: str, help_: str) -> None:
    finding = only(flown(f"crazyflie21 {{ {figure} }}"), TRACKING_NOT_MEASURED)
    assert finding.message.startswith("`drone` may fly with ")
    assert words in finding.message
    assert finding.help.endswith(help_)
    assert finding.code.warning


@pytest.mark.parametrize(
    "vehicle",
    [
        "crazyflie21",
        "brushless21",
        "crazyflie21 { speed <= 0.8 m/s }",
        "crazyflie21 { speed <= 2 m/s  tracking 0.1 m }",
        "crazyflie21 { tilt <= 30 deg }",
        "plain { speed <= 9 m/s }",
    ],
)
def test_limits_of_the_profile_and_margins_of_the_missions_own_are_taken(vehicle: str) -> None:
    assert not found(flown(vehicle), TRACKING_NOT_MEASURED)
