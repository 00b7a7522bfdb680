"""Spacing of agents: one ellipsoid for each two kinds; table, judges of plans and the proof of a flight agree on it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from missionc import ir
from missionc.backends.acceptance import attempt
from missionc.base.source import Source
from missionc.base.trace import Trace
from missionc.base.units import Metres, Seconds
from missionc.compiler import driver
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.geometry.dynamics import Motions
from missionc.geometry.placement_conflicts import too_close
from missionc.geometry.relative_motion import closest_approach
from missionc.geometry.required_separation import SpacingTable
from missionc.geometry.surely_clear import all_apart
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.plan.clearances import check_separation

HALL = """
mission hall
time  step 1 s, horizon 1 s
world (0, 0, 0) to (8, 8, 8)
agent one { dynamics single_integrator(speed <= 9 m/s)  start at (2, 2, 2) }
require stay: one: always[0, 1 s] z >= 0
"""

LENGTHS = st.sampled_from([0.0, 0.1, 0.25])
KINDS = st.tuples(LENGTHS, LENGTHS, LENGTHS, LENGTHS, LENGTHS, LENGTHS)


def hall() -> ir.Mission:
    found = driver.check(Source("hall.mission", HALL)).mission
    assert found is not None
    return found


BASE = hall()


def with_kinds(kinds: list[tuple[float, ...]], separation: float, flat: bool = False) -> ir.Mission:
    agents = []
    for index, (radius, distance, wide, tall, tracking, _) in enumerate(kinds):
        vehicle = replace(
            ir.PLAIN, pair_distance=distance, downwash_radius=wide, downwash_height=3 * tall, tracking=tracking
        )
        agents.append(replace(BASE.agents[0], index=index, radius=Metres(radius), vehicle=vehicle))
    world = replace(BASE.world, low=BASE.world.low[:2], high=BASE.world.high[:2]) if flat else BASE.world
    drift = tuple(Metres(kind[5]) for kind in kinds)
    return replace(BASE, agents=tuple(agents), separation=Metres(separation), world=world, drift=drift)


@given(st.lists(KINDS, max_size=5), st.sampled_from([0.0, 0.3]), st.booleans())
def test_the_table_of_spacings_says_what_the_mission_does(
    kinds: list[tuple[float, ...]], separation: float, flat: bool
) -> None:
    mission = with_kinds(kinds, separation, flat)
    spacing = SpacingTable.of(mission)
    count = len(kinds)
    first, second = (each.ravel() for each in np.meshgrid(np.arange(count), np.arange(count), indexing="ij"))
    expected = [mission.spacing(one, other) for one, other in zip(first.tolist(), second.tolist(), strict=True)]
    assert spacing.between(first, second).tolist() == [each.sideways for each in expected]
    assert spacing.widest == pytest.approx(max((each.most for each in expected), default=0.0))
    assert SpacingTable.of(mission) is spacing
    metric = spacing.metric(first, second)
    assert (metric is None) == all(each.sideways == each.height for each in expected)
    if metric is not None:
        assert metric[:, :2].min() == metric[:, :2].max() == 1
        assert metric[:, 2].tolist() == [each.flatness for each in expected]


@given(KINDS, KINDS, st.sampled_from([0.0, 0.3]))
def test_what_keeps_the_spacing_keeps_what_the_proof_of_a_flight_asks(
    one: tuple[float, ...], other: tuple[float, ...], separation: float
) -> None:
    """``verify.flight.joint_claims``: the ball of the bodies and of the pair distance, and the grown downwash."""
    mission = with_kinds([one, other], separation)
    spacing = mission.spacing(0, 1)
    missed = one[4] + one[5] + other[4] + other[5]
    ball = max(one[0] + other[0] + separation, max(one[0] + other[0], one[1], other[1]) + missed)
    assert spacing.least >= ball
    wide, tall = one[2] + other[2], 3 * (one[3] + other[3])
    if wide > 0 and tall > 0:
        assert spacing.sideways >= wide + missed
        grown = math.sqrt(tall**2 * (1 + missed / wide) + missed**2 + missed * wide)
        assert spacing.height >= grown
        # The ellipsoid holds the sum of the downwash and of what both may miss, in every direction.
        for angle in np.linspace(0, math.pi / 2, 7):
            support = math.hypot(wide * math.cos(angle), tall * math.sin(angle)) + missed
            assert math.hypot((wide + missed) * math.cos(angle), grown * math.sin(angle)) >= support - 1e-12


@given(KINDS, KINDS, st.integers(0, 2**32 - 1))
def test_all_judges_of_a_plan_agree_on_it(one: tuple[float, ...], other: tuple[float, ...], seed: int) -> None:
    mission = with_kinds([one, other], 0.1)
    spacing = mission.spacing(0, 1)
    generator = np.random.default_rng(seed)
    start, end = (generator.uniform(-1, 1, 3) * (1, 1, 1.5) for _ in range(2))
    at_rest, moving = Motions(*np.zeros((3, 3))), Motions(start, end - start, np.zeros(3))
    apart = closest_approach(at_rest, moving, 1.0, np.array([1, 1, spacing.flatness]))
    margin = float(apart) - spacing.sideways
    if abs(margin) < 1e-6:
        return
    middle = np.full(3, 4.0)
    position = np.array([[middle, middle], [middle + start, middle + end]])
    velocity = np.repeat(np.diff(position, axis=1), 2, axis=1)
    trace = Trace(Seconds(1.0), position, velocity, np.zeros((2, 2)))
    (check,) = check_separation(mission, motion(mission, trace))
    assert check.passed == (margin > 0)
    assert check.margin == pytest.approx(margin)
    names = {fault.what for fault in attempt(mission, Kernel((), ()), trace).faults}
    assert ("separation" in names) == (margin < 0)
    places = [tuple(each) for each in position[:, 0].tolist()]
    near = too_close(places, [0, 1], SpacingTable.of(mission), 9)
    assert bool(near) == (spacing.measured(start.tolist()) <= spacing.sideways)
    assert not (near and all_apart(places, [0, 1], mission))
