"""One agent's polynomials to the number: what jumps, what moves that should rest, how far they are from the plan."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array
from missionc.geometry.curves.bernstein_intervals import Enclosed
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces
from missionc.verification.certificate import Check
from missionc.verification.flight.continuity_and_fidelity import check_flight, check_smooth, clock, exactness, tube
from missionc.verification.proof.branch_and_bound import Claim
from tests.support.legal_plans import mission_of

MISSION = mission_of([(9.0, 9.0, 9.0), (1.0, 2.0, 3.0)], 3)
FLAT = mission_of([(9.0, 9.0), (1.0, 2.0)], 3, altitude=0.5)
"""3 s; the second agent is looked at."""


def standing(*lasts: float, place: Sequence[float] = (1.0, 2.0, 3.0, 0.0)) -> Pieces:
    coefficients = np.zeros((len(lasts), 4, 8))
    coefficients[:, :, 0] = place
    return Pieces(np.array(lasts), coefficients)


def plan(place: Sequence[float] = (1.0, 2.0, 3.0)) -> Curves:
    """Both stand, the first one elsewhere; steps of 1 s."""
    coefficients = np.zeros((2, 3, len(place), 2))
    coefficients[0, ..., 0], coefficients[1, ..., 0] = 9.0, place
    return Curves(np.arange(4.0), coefficients)


def found(own: Pieces, mission: ir.Mission = MISSION, planned: Curves | None = None) -> dict[str, Check]:
    agent = mission.agents[1]
    place = (1.0, 2.0, 3.0)[: mission.dimension]
    return {check.name: check for check in check_flight(mission, agent, own, planned or plan(place))}


# ------------------------------------------------------------------------------ what is checked


def test_who_stands_where_the_plan_has_it_passes() -> None:
    checks = found(standing(1.0, 2.0))
    assert list(checks) == ["duration", "joints", "rest", "waypoints", "yaw"]
    says = "velocity, acceleration and jerk are zero at both ends"
    assert checks == {
        name: Check(name, "drone[1]", checks[name].margin, unit, tolerance, True, at, ("drone[1]",), detail)
        for name, unit, tolerance, at, detail in (
            ("duration", "s", 3e-6, None, "the duration of the file equals that of the plan"),
            ("joints", "m", 3e-6, 1.0, "pieces are continuous from position to snap"),
            ("rest", "m", 3e-6, checks["rest"].at, says),
            ("waypoints", "m", 5e-3, checks["waypoints"].at, "the position equals the plan at the sample times"),
            ("yaw", "rad", 1e-6, 0.0, "the yaw is 0 rad in continuous time"),
        )
    }
    assert [check.margin for check in checks.values()] == pytest.approx([0.0] * 5, abs=1e-9)


@pytest.mark.parametrize(
    ("lasts", "margin", "passed"),
    [
        ((1.0, 2.0 + 2e-6), -2e-6, True),
        ((1.0, 2.0 - 2e-6), -2e-6, True),
        ((1.0, 2.5), -0.5, False),
        ((0.5, 1.0), -1.5, False),
    ],
)
def test_a_flight_lasts_as_long_as_its_plan(lasts: tuple[float, ...], margin: float, passed: bool) -> None:
    check = found(standing(*lasts))["duration"]
    assert check.margin == pytest.approx(margin, abs=1e-12)
    assert check.passed is passed


def test_a_millionth_of_each_second_may_be_missing_and_of_one_at_least() -> None:
    assert clock(MISSION) == pytest.approx(3e-6)
    assert clock(mission_of([(1.0, 1.0)], 4, step=0.125)) == 1e-6


def test_a_millionth_of_the_farthest_beginning_is_nothing() -> None:
    assert exactness(standing(1.0, place=(0.5, -0.25, 0.125, 0.0))) == 1e-6
    assert exactness(standing(1.0, place=(0.5, -8.0, 2.0, 0.0))) == pytest.approx(8e-6)
    later = standing(1.0, 1.0)
    later.coefficients[1, 2, 0], later.coefficients[1, 0, 3] = 16.0, 64.0
    assert exactness(later) == pytest.approx(16e-6)


def test_in_a_plane_it_flies_at_its_height() -> None:
    own = standing(1.0, 2.0, place=(1.0, 2.0, 0.5, 0.0))
    checks = found(own, FLAT)
    assert list(checks) == ["duration", "joints", "rest", "waypoints", "altitude", "yaw"]
    assert checks["altitude"] == Check(
        "altitude", "drone[1]", checks["altitude"].margin, "m", 2e-6, True, 0.0, ("drone[1]",), "the altitude is 0.5 m"
    )
    # A control point at the end of the second piece is 0.25 m higher, and one in its middle 0.125 m lower.
    own.coefficients[1, 2, 7] = 0.25 / 2.0**7
    check = found(own, FLAT)["altitude"]
    assert (check.margin, check.at) == pytest.approx((-0.25, 1.0), abs=1e-9)
    own.coefficients[0, 2, 0] -= 0.5
    check = found(own, FLAT)["altitude"]
    assert (check.margin, check.at) == pytest.approx((-0.5, 0.0), abs=1e-9)
    assert found(own, FLAT)["waypoints"].margin == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("angle", "tolerance"), [(0.5, 1e-6), (-2.0, 2e-6)])
def test_a_fixed_nose_points_one_way(angle: float, tolerance: float) -> None:
    agent = replace(MISSION.agents[1], yaw=ir.Fixed(angle))
    own = standing(1.0, 2.0, place=(1.0, 2.0, 3.0, angle))
    check = check_flight(MISSION, agent, own, plan())[-1]
    says = f"the yaw is {angle:g} rad in continuous time"
    assert check == Check("yaw", "drone[1]", check.margin, "rad", tolerance, True, 0.0, ("drone[1]",), says)
    assert check.margin == pytest.approx(0.0, abs=1e-12)
    own.coefficients[1, 3, 7] = -0.25 / 2.0**7
    check = check_flight(MISSION, agent, own, plan())[-1]
    assert (check.margin, check.at, check.passed) == pytest.approx((-0.25, 1.0, False), abs=1e-9)
    # Each piece is as far off as its own points.
    own.coefficients[0, 3, 0] = angle - math.copysign(0.375, angle)
    check = check_flight(MISSION, agent, own, plan())[-1]
    assert (check.margin, check.at) == pytest.approx((-0.375, 0.0), abs=1e-9)


# ------------------------------------------------------------------------------ joints and rest


@pytest.mark.parametrize("order", range(6))
def test_a_jump_is_as_long_as_a_control_point_has_to_move_for_it(order: int) -> None:
    """At the second joint, beside which the shorter piece lasts 0.5 s."""
    own = standing(1.0, 2.0, 0.5)
    own.coefficients[2, (0, 3), order] += np.array([0.6, -0.8]) * 0.0625
    check = check_smooth(MISSION.agents[1], own)[0]
    expected = 0.0625 * math.factorial(order) * 0.5**order / math.perm(7, order) if order < 5 else 0.0
    assert check.margin == pytest.approx(-expected, abs=1e-12)
    assert check.name == "joints"
    assert check.passed is (order == 5)
    if order < 5:
        assert check.at == 3.0


@pytest.mark.parametrize("order", range(5))
def test_a_piece_ends_where_the_next_begins_in_every_derivative(order: int) -> None:
    """(t - 2)**order is 0 at the end of the second piece, and so is every derivative but one."""
    own = standing(1.0, 2.0, 4.0)
    power = np.polynomial.Polynomial([-2.0, 1.0]) ** order * 0.0625
    own.coefficients[1, 1, : order + 1] += np.array(power.coef, dtype=np.float64)
    own.coefficients[0, 1, 0] += power(0.0)
    own.coefficients[0, 1, 1:] = 0.0
    jumps = {}
    for joint, shorter in ((0, 1.0), (1, 2.0)):
        sizes = []
        for each in range(5):
            at = power.deriv(each)(0.0 if joint == 0 else 2.0) if each else 0.0
            if joint == 1 and each == 0:
                at = power(2.0)
            sizes.append(abs(at) * shorter**each / math.perm(7, each))
        jumps[joint] = max(sizes)
    check = check_smooth(MISSION.agents[1], own)[0]
    assert check.margin == pytest.approx(-max(jumps.values()), abs=1e-12)


@pytest.mark.parametrize(("order", "counts"), [(0, False), (1, True), (2, True), (3, True), (4, False)])
def test_motion_at_either_end_counts_up_to_jerk(order: int, counts: bool) -> None:
    begins, ends = standing(0.5, 2.0), standing(0.5, 2.0)
    begins.coefficients[0, (1, 2), order] += np.array([0.6, 0.8]) * 0.0625
    power = np.polynomial.Polynomial([-2.0, 1.0]) ** order * 0.0625
    ends.coefficients[1, 2, : order + 1] += np.array(power.coef, dtype=np.float64)
    for own, lasts, at in ((begins, 0.5, 0.0), (ends, 2.0, 2.5)):
        check = check_smooth(MISSION.agents[1], own)[-1]
        size = 0.0625 * math.factorial(order) * lasts**order / math.perm(7, order) if counts else 0.0
        assert (check.name, check.passed) == ("rest", not counts)
        assert check.margin == pytest.approx(-size, abs=1e-12)
        if counts:
            assert check.at == at


def test_who_begins_in_motion_begins_in_that_of_its_state() -> None:
    states = [(1.0, 2.0, 3.0, 0.5), *((float(order), 0.0, -1.0, 0.25) for order in range(1, 5))]
    agent = replace(MISSION.agents[1], begins=tuple(states))
    own = standing(0.5, 2.0)
    for order, state in enumerate(states):
        own.coefficients[0, :, order] = np.array(state) / math.factorial(order)
    joints, begins, rest = check_smooth(agent, own)
    says = "the first state is continuous from position to snap"
    assert begins == Check("begins", "drone[1]", begins.margin, "m", 3e-6, True, 0.0, ("drone[1]",), says)
    assert begins.margin == pytest.approx(0.0, abs=1e-12)
    assert joints.name == "joints"
    # Its end alone is at rest, where it is.
    assert (rest.name, rest.at, rest.passed) == ("rest", 2.5, True)
    assert rest.detail == "velocity, acceleration and jerk are zero at the end"
    assert rest.margin == pytest.approx(0.0, abs=1e-12)
    for order in range(5):
        off = standing(0.5, 2.0)
        off.coefficients[0] = own.coefficients[0]
        off.coefficients[0, (0, 3), order] += np.array([0.6, 0.8]) * 0.0625
        begins = check_smooth(agent, off)[1]
        expected = 0.0625 * math.factorial(order) * 0.5**order / math.perm(7, order)
        assert begins.margin == pytest.approx(-expected, abs=1e-12)
        assert not begins.passed


# ------------------------------------------------------------------------------ waypoints


def test_at_every_step_it_is_where_the_plan_is() -> None:
    """The plan goes 1 m/s along y; the flight stands for 0.5 s, and goes on so."""
    planned = plan()
    planned.coefficients[1, :, 1, 0] += np.arange(3.0)
    planned.coefficients[1, :, 1, 1] = 1.0
    own = standing(0.5, 2.5)
    own.coefficients[1, 1, 1] = 1.0
    check = found(own, planned=planned)["waypoints"]
    assert (check.margin, check.passed) == pytest.approx((-0.5, False), abs=1e-9)
    own.coefficients[1, 1, 0] += 0.5
    assert found(own, planned=planned)["waypoints"].margin == pytest.approx(0.0, abs=1e-9)
    # Its end counts too, and its beginning.
    own.coefficients[1, 2, 2] = 0.015625
    check = found(own, planned=planned)["waypoints"]
    assert (check.margin, check.at) == pytest.approx((-0.09765625, 3.0), abs=1e-9)
    own.coefficients[0, (0, 2), 0] += np.array([0.6, 0.8]) * 0.25
    check = found(own, planned=planned)["waypoints"]
    assert (check.margin, check.at) == pytest.approx((-0.25, 0.0), abs=1e-9)
    own.coefficients[0, 3, 0] += 9.0
    assert found(own, planned=planned)["waypoints"].margin == pytest.approx(-0.25, abs=1e-9)


def test_a_step_at_a_joint_is_where_the_next_piece_begins_and_one_beyond_the_end_at_the_end() -> None:
    own = standing(1.0, 1.5)
    own.coefficients[0, 0, 1], own.coefficients[1, 0, 1] = 0.0625, 0.25
    check = found(own)["waypoints"]
    assert (check.margin, check.at) == pytest.approx((-0.375, 3.0), abs=1e-9)


def test_what_rounding_may_hide_of_large_numbers_counts() -> None:
    far = 2.0**30
    own = standing(1.0, 2.0, place=(far, -far, 3.0, 0.0))
    check = found(own, planned=plan((far, -far, 3.0)))["waypoints"]
    assert check.margin == pytest.approx(-(2.0**-40) * (2 * far + 4.0) * 4.0, rel=1e-9)


# ------------------------------------------------------------------------------ the tube


def of_second(own: Pieces, planned: Curves, mission: ir.Mission = MISSION) -> Claim:
    return tube(mission, mission.agents[1], own, planned)


def margins(claim: Claim) -> Array:
    every = np.arange(claim.items)
    lower, seen, share = claim.judge(every, claim.curve(every))
    assert lower.tolist() == seen.tolist()
    assert share.tolist() == [0.0] * claim.items
    return lower


def test_a_tube_is_around_the_motion_of_every_step() -> None:
    own = standing(0.5, 2.5)
    own.coefficients[1, 2, 0] += 0.0625
    claim = of_second(own, plan())
    assert (claim.name, claim.subject, claim.unit, claim.tolerance) == ("tube", "drone[1]", "m", 1e-6)
    assert claim.detail == "every control point is within 0.1 m of the verified motion of its step"
    assert claim.agents.tolist() == [[1]]
    assert claim.gap == math.inf
    assert claim.times.tolist() == [0.0, 0.5, 1.0, 2.0, 3.0]
    assert margins(claim) == pytest.approx([0.1, *[0.0375] * 3], abs=1e-9)


def test_a_step_beside_a_joint_cuts_nothing() -> None:
    """Within three millionths of a second, which the clock of this mission may be wrong by."""
    planned = plan()
    for off, times in ((2.9e-6, 3), (-2.9e-6, 3), (3.1e-6, 4), (-3.1e-6, 4)):
        claim = of_second(standing(1.0, 1.0 + off, 1.0 - off), planned)
        assert claim.times.size == times + 1, off
    assert of_second(standing(1.5, 1.5), planned).times.tolist() == [0.0, 1.0, 1.5, 2.0, 3.0]


@pytest.mark.parametrize(
    ("lasts", "inside"),
    [
        ((1.0, 2.0), [True] * 3),
        ((1.0, 2.0 + 2.9e-6), [True] * 3),
        ((1.0, 1.0, 1.0 + 3.1e-6), [True, True, True, False]),
        ((1.0, 1.0, 2.0), [True, True, True, False]),
        ((1.0, 1.0), [True, True]),
    ],
)
def test_what_is_flown_after_the_plan_is_in_no_tube(lasts: tuple[float, ...], inside: list[bool]) -> None:
    assert (margins(of_second(standing(*lasts), plan())) > -math.inf).tolist() == inside


def judged(planned: Curves, item: int, points: Sequence[Sequence[float]], radius: float = 0.0) -> float:
    claim = of_second(standing(1.0, 2.0), planned)
    curve = Enclosed(np.array(points, dtype=np.float64).T[None], np.full((1, 3), radius))
    return float(claim.judge(np.array([item]), curve)[0][0])


@pytest.mark.parametrize(
    ("points", "stray"),
    [
        ([(1.0, 2.0, 3.0), (5.0, 2.0, 3.0)], 0.0),
        ([(1.0, 2.0, 3.0), (3.0, 2.6, 3.8), (5.0, 2.0, 3.0)], 1.0),
        ([(-2.0, 2.0, 7.0), (3.0, 2.0, 3.0)], 5.0),
        ([(3.0, 2.0, 3.0), (8.0, 6.0, 3.0)], 5.0),
        ([(3.0, 1.5, 3.0), (4.0, 2.25, 3.0)], 0.5),
    ],
)
def test_a_point_strays_by_its_distance_from_the_line_of_its_step(
    points: list[tuple[float, ...]], stray: float
) -> None:
    """In the second step, from (1, 2, 3) to (5, 2, 3)."""
    planned = plan()
    planned.coefficients[1, 1, 0, 1] = 4.0
    assert judged(planned, 1, points) == pytest.approx(0.1 - stray, abs=1e-9)
    assert judged(planned, 1, points, 0.0625) == pytest.approx(0.1 - stray - 0.0625 * math.sqrt(3), abs=1e-9)


def test_who_stands_is_as_far_as_its_place() -> None:
    assert judged(plan(), 1, [(1.0, 2.0, 3.0), (1.6, 2.0, 3.8)]) == pytest.approx(0.1 - 1.0, abs=1e-9)


def test_a_step_that_is_curved_bulges_from_its_line() -> None:
    """p'' is 1 m/s**2 of length: from its chord over 1 s it bulges by an eighth of a metre at most."""
    planned = plan()
    curved = np.zeros((2, 3, 3, 3))
    curved[..., :2] = planned.coefficients
    curved[1, 1, :, 1], curved[1, 1, :, 2] = (4.0, 0.0, 0.0), (0.0, 0.3, -0.4)
    curves = Curves(planned.times, curved)
    chord = [(1.0, 2.0, 3.0), (5.0, 2.3, 2.6)]
    assert judged(curves, 1, chord) == pytest.approx(0.1 - 0.125, abs=1e-9)
    # Of the first half of a step it is a quarter, where that is what the piece is of.
    own = standing(1.0, 0.5, 1.5)
    claim = of_second(own, curves)
    half = np.array([(1.0, 2.0, 3.0), (3.0, 2.075, 2.9)]).T[None]
    lower = claim.judge(np.array([1]), Enclosed(half, np.zeros((1, 3))))[0]
    assert float(lower[0]) == pytest.approx(0.1 - 0.125 / 4, abs=1e-9)
    rest = np.array([(3.0, 2.075, 2.9), (5.0, 2.3, 2.6)]).T[None]
    lower = claim.judge(np.array([2]), Enclosed(rest, np.zeros((1, 3))))[0]
    assert float(lower[0]) == pytest.approx(0.1 - 0.125 / 4, abs=1e-9)


def test_what_rounding_may_hide_of_far_points_counts_in_the_tube() -> None:
    far = 2.0**36
    planned = plan((far, 2.0, 3.0))
    lower = judged(planned, 1, [(far, 2.0, 3.0), (far, 2.0, 3.0)])
    assert lower == pytest.approx(0.1 - (far + 1) * 2.0**-40, rel=1e-9)
    claim = of_second(standing(1.0, 2.0), planned)
    both = np.array([[(far, 2.0, 3.0)] * 2, [(1.0, 2.0, 3.0)] * 2]).swapaxes(1, 2)
    found = claim.judge(np.array([0, 0]), Enclosed(both, np.zeros((2, 3))))[0]
    assert found[0] == pytest.approx(0.1 - (far + 1) * 2.0**-40, rel=1e-9)
    assert found[1] == pytest.approx(0.1 + 1.0 - far, abs=1e-4)
