"""Phases of a whole flight, to the tenth of a second: the slowest decides, and nobody hurries below the least time."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from missionc import ir
from missionc.verification.flight.verify_whole_flight import Phases, landing_seconds, phases_of, rest_to_rest
from tests.support.legal_plans import SPAN, mission_of

SOFT = ir.Vehicle("soft", acceleration=0.1)
SLOW = ir.Vehicle("slow", vertical_speed=0.5)


def agents(*of: tuple[ir.Vehicle, ir.Pad | None]) -> list[ir.Agent]:
    made = mission_of([(1.0 + index, 1.0, 1.0) for index in range(len(of))], 4).agents
    return [replace(agent, vehicle=vehicle, pad=pad) for agent, (vehicle, pad) in zip(made, of, strict=True)]


@pytest.mark.parametrize(
    ("distance", "speed", "acceleration", "seconds"),
    [
        (2.0, 0.5, math.inf, 35 / 16 * 4),
        (-2.0, 0.5, math.inf, 35 / 16 * 4),
        (2.0, math.inf, 0.5, math.sqrt(7.514 * 4)),
        (-2.0, math.inf, 0.5, math.sqrt(7.514 * 4)),
        (2.0, 0.5, 0.1, math.sqrt(7.514 * 20)),
        (0.0, 0.5, 0.1, 0.0),
    ],
)
def test_from_rest_to_rest_the_slower_limit_decides(
    distance: float, speed: float, acceleration: float, seconds: float
) -> None:
    assert rest_to_rest(distance, speed, acceleration) == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("vehicle", "pad", "height", "rise", "sink"),
    [
        # 35/16 of the mean: 1.6 m at 0.5 m/s are 7 s, and from 4 cm lower 6.825 s, rounded up.
        (SLOW, None, 1.6, 7.0, 6.9),
        (SLOW, ir.Pad(None, SPAN), 1.6, 7.0, 6.9),
        (SLOW, ir.Pad(None, SPAN, rise=0.25, land=0.4), 1.6, 14.0, 8.6),
        (SLOW, ir.Pad(None, SPAN, rise=0.8, land=0.8), 1.6, 7.0, 6.9),
        (ir.Vehicle("free"), ir.Pad(None, SPAN, rise=0.5, land=0.25), 1.6, 7.0, 13.7),
        # sqrt(7.514 * 16) is 10.96; of 1.56 m 10.83.
        (SOFT, None, 1.6, 11.0, 10.9),
        (ir.Vehicle("free"), None, 1.6, 3.0, 4.0),
        (SLOW, None, 0.5, 3.0, 4.0),
        (SLOW, None, 0.8, 3.5, 4.0),
        # 7 s to the last bit, of which rounding is no tenth more.
        (SLOW, None, 1.6 + 1e-11, 7.0, 6.9),
        (SLOW, None, 1.6 + 1e-9, 7.1, 6.9),
    ],
)
def test_a_phase_lasts_as_long_as_the_vehicle_and_the_pad_ask(
    vehicle: ir.Vehicle, pad: ir.Pad | None, height: float, rise: float, sink: float
) -> None:
    (agent,) = agents((vehicle, pad))
    assert phases_of([agent], [height], [height], 8.0) == Phases(rise, 2.0, 4.0, 8.0, sink, 1)
    assert landing_seconds(agent, height) == sink
    assert phases_of([agent], [height], [0.5], 8.0, 3).rise == rise
    assert phases_of([agent], [0.5], [height], 8.0, 3).sink == sink


def test_the_slowest_decides_for_everybody() -> None:
    team = agents((SLOW, None), (SOFT, None), (ir.Vehicle("free"), None))
    assert phases_of(team, [1.6, 0.2, 9.0], [0.2, 1.6, 9.0], 8.0, 2) == Phases(7.0, 2.0, 4.0, 8.0, 10.9, 2)
    assert phases_of(team[::-1], [9.0, 0.2, 1.6], [9.0, 1.6, 0.2], 8.0, 2) == Phases(7.0, 2.0, 4.0, 8.0, 10.9, 2)
    assert phases_of(team, [1.6, 0.2, 9.0], [0.2, 1.6, 9.0], 8.0, 2, True) == Phases(0.0, 2.0, 4.0, 8.0, 10.9, 2)


def test_who_is_not_one_of_so_many_heights_is_refused() -> None:
    team = agents((SLOW, None), (SLOW, None))
    for up, down in (([1.0], [1.0, 1.0]), ([1.0, 1.0], [1.0])):
        with pytest.raises(ValueError, match="zip"):
            phases_of(team, up, down, 8.0)


def test_phases_follow_each_other() -> None:
    phases = Phases(7.0, 2.0, 4.0, 8.0, 6.0, 3)
    assert (phases.hover, phases.before, phases.whole) == (8.0, 29.0, 29.0 + 8.0 + 2.0 + 18.0)
    in_the_air = replace(phases, rise=0.0)
    assert (in_the_air.hover, in_the_air.before, in_the_air.whole) == (0.0, 0.0, 8.0 + 2.0 + 18.0)
