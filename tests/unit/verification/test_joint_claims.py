"""What claims about all flights ask for, to the number, of flights that stand or go straight on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array
from missionc.verification.flight.joint_claims import (
    Flight,
    cut,
    downwash,
    growing,
    obstacles,
    seen_from,
    separation,
    world,
)
from missionc.verification.proof.branch_and_bound import Claim
from tests.support.legal_plans import mission_of, moving, still

BALL = ir.Ball((5.0, 5.0, 1.0), 0.5)


def flight(
    *agents: Sequence[tuple[tuple[float, float, float], float]],
    durations: Sequence[float] = (2.0, 2.0),
    astray: Sequence[float] | None = None,
) -> Flight:
    """Where each piece of each agent begins, and at how many m/s it goes on along x."""
    coefficients = np.zeros((len(agents), len(durations), 4, 8))
    for agent, pieces in enumerate(agents):
        for piece, (begin, speed) in enumerate(pieces):
            coefficients[agent, piece, :3, 0] = begin
            coefficients[agent, piece, 0, 1] = speed
    return Flight(np.array(durations), coefficients, None if astray is None else np.array(astray))


def standing(*places: tuple[float, float, float], astray: Sequence[float] | None = None) -> Flight:
    return flight(*([(place, 0.0)] * 2 for place in places), astray=astray)


def team(*vehicles: ir.Vehicle, radii: Sequence[float] = (0.1, 0.2, 0.3), **more: float) -> ir.Mission:
    made = mission_of([(1.0 + index, 1.0, 1.0) for index in range(len(vehicles))], 4, **more)  # type: ignore[arg-type]
    agents = (
        replace(agent, vehicle=vehicle, radius=type(agent.radius)(radius))
        for agent, vehicle, radius in zip(made.agents, vehicles, radii, strict=False)
    )
    return replace(made, agents=tuple(agents))


def lowers(claim: Claim) -> Array:
    """(subjects, pieces): the bounds on whole pieces."""
    every = np.arange(claim.items)
    return claim.judge(every, claim.curve(every))[0].reshape(-1, claim.pieces)


def far(claim: Claim) -> list[float]:
    assert claim.far is not None
    return [float(bound) for bound in claim.far(np.arange(len(claim.agents)))]


def figures(claim: Claim) -> tuple[object, ...]:
    return claim.name, claim.subject, claim.unit, claim.tolerance, claim.gap, claim.detail


# ------------------------------------------------------------------------------ the world

OUTSIDE = "every centre is inside the world in continuous time"


def test_everybody_is_in_the_world_by_its_inset_its_tracking_and_what_it_is_astray() -> None:
    inset = ir.Vehicle("fenced", fence_inset=0.25, tracking=0.125)
    mission = team(inset, ir.PLAIN, radii=(0.1, 0.1))
    own = standing((1.0, 5.0, 5.0), (5.0, 5.0, 8.0), astray=(0.0, 0.0625))
    claim = world(mission, own)
    assert lowers(claim) == pytest.approx(np.array([[0.625, 0.5625], [2.0, 1.9375]]), abs=1e-9)
    detail = f"{OUTSIDE}, with the fence inset and the tracking margin of its vehicle"
    assert figures(claim) == ("flown world", "world", "m", 1e-5, 1e-5, detail)
    assert claim.agents.tolist() == [[0], [1]]


def test_without_insets_the_border_is_in_the_world() -> None:
    mission = team(ir.PLAIN)
    claim = world(mission, standing((0.0, 10.0, 5.0)))
    assert claim.detail == OUTSIDE
    # No more is lost than the last bit of a curve.
    assert (lowers(claim) > -1e-13).all()
    assert world(mission, standing((5.0, 5.0, 5.0), astray=(0.0, 0.5))).detail != OUTSIDE


def test_the_world_of_a_plane_has_no_heights() -> None:
    mission = mission_of([(1.0, 1.0)], 4)
    assert lowers(world(mission, standing((3.0, 4.0, -90.0)))) == pytest.approx(np.full((1, 2), 3.0), abs=1e-9)


# ------------------------------------------------------------------------------ obstacles


def test_a_body_needs_its_radius_its_tracking_and_what_it_is_astray() -> None:
    steady = replace(team(ir.Vehicle("a", tracking=0.05), ir.Vehicle("b", tracking=0.1)), obstacles=(still(BALL),))
    own = standing((5.0, 8.0, 1.0), (5.0, 1.0, 1.0), astray=(0.0, 0.25))
    (claim,) = obstacles(steady, own, strict=False)
    assert lowers(claim) == pytest.approx(np.array([[2.35, 2.1], [3.2, 2.95]]), abs=1e-9)
    assert far(claim) == pytest.approx([2.1, 2.95], abs=1e-9)
    assert figures(claim) == ("flown obstacle", "wall", "m", 1e-5, 1e-5, "no bodies touch in continuous time")
    assert claim.agents.tolist() == [[0], [1]]


def test_asked_for_it_keeps_the_missions_clearance_where_that_is_more() -> None:
    vehicles = ir.Vehicle("a", tracking=0.05), ir.Vehicle("b", tracking=0.1)
    mission = replace(team(*vehicles, clearance=0.0625), obstacles=(still(BALL),))
    (claim,) = obstacles(mission, standing((5.0, 8.0, 1.0), (5.0, 1.0, 1.0)), strict=True)
    assert lowers(claim) == pytest.approx(np.array([[2.3375] * 2, [3.2] * 2]), abs=1e-9)
    assert far(claim) == pytest.approx([2.3375, 3.2], abs=1e-9)
    assert claim.detail == "every body has a clearance of 0.0625 m in continuous time"


def test_who_starts_late_beside_what_moves_is_off_by_what_it_flies_then() -> None:
    """The obstacle turns within both pieces, and stays where it is."""
    there = [(0.0, 0.0, 0.0)] * 4
    late = ir.Vehicle("late", start_skew=0.25)
    mission = team(late, replace(late, start_skew=0.0))
    own = flight([((3.0, 8.0, 1.0), 0.0), ((3.0, 8.0, 1.0), 0.0)], [((5.0, 1.0, 1.0), 0.0)] * 2, astray=(0.0, 0.5))
    own.coefficients[0, 1, 1, 1] = 0.5  # it goes away at 0.5 m/s
    for obstacle, drift in (
        (still(BALL), 0.0),
        (moving(BALL, (0.0, 1.0, 3.0, 4.0), there), 0.125),
        (replace(still(BALL), growth=1e-9), 0.125),
    ):
        (claim,) = obstacles(replace(mission, obstacles=(obstacle,)), own, strict=False)
        apart = math.hypot(2.0, 3.0) - 0.5
        # A late start brings the speed of the second piece into the first.
        first = [apart - 0.1 - drift, apart - 0.1 - 0.5 - drift]
        second = [3.5 - 0.2, 3.5 - 0.2 - 0.5]
        times = claim.times.tolist()
        if len(times) == 5:
            assert times == [0.0, 1.0, 2.0, 3.0, 4.0]
            first, second = ([each for each in row for _ in range(2)] for row in (first, second))
        found = lowers(claim)
        assert found[1] == pytest.approx(second, abs=1e-6)
        # It goes away along the line that the bound is taken from, but for the first: its bound is no better.
        assert found[0, : len(first) // 2] == pytest.approx(first[: len(first) // 2], abs=1e-6)
        assert (found[0] <= np.array(first) + 1.0).all()
        assert claim.far is not None
        assert far(claim)[1] == pytest.approx(second[-1], abs=1e-6)


def test_what_has_grown_by_the_end_of_a_part_is_as_large_throughout() -> None:
    mission = replace(team(ir.PLAIN), obstacles=(replace(still(BALL), growth=0.125, age=2.0),))
    own = standing((5.0, 9.0, 1.0))
    (claim,) = obstacles(mission, own, strict=False)
    assert lowers(claim) == pytest.approx(np.array([[3.5 - 0.1 - 0.5, 3.5 - 0.1 - 0.75]]), abs=1e-9)
    assert far(claim) == pytest.approx([3.5 - 0.1 - 0.75], abs=1e-9)
    seen = growing(own.position, own.times, mission.obstacles[0])
    assert seen.points.shape == (1, 2, 4, 8)
    assert seen.points[0, :, 3] == pytest.approx(
        np.array([np.linspace(0.25, 0.5, 8), np.linspace(0.5, 0.75, 8)]), abs=1e-12
    )
    assert (seen.points[:, :, :3] == own.position.points).all()
    assert (seen.radius[:, :, :3] == own.position.radius).all()
    # The rounding of what it has grown in all: a share of 2**-40.
    assert seen.radius[0, :, 3] == pytest.approx([1.75 * 2.0**-40] * 2, rel=1e-2)


def test_what_moves_is_seen_from_where_it_is() -> None:
    truck = moving(BALL, (-1.0, 1.0, 3.0, 9.0), [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 0.0, 1.0), (2.0, 0.0, 4.0)])
    mission = team(ir.PLAIN)
    times, seen = seen_from(mission, standing((5.0, 9.0, 1.0)), truck)
    assert times.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert seen.points[0, :, :, 0].tolist() == [[4.0, 9.0, 1.0], [3.0, 9.0, 1.0], [3.0, 9.0, 0.5], [3.0, 9.0, 0.0]]
    assert seen.points[0, :, :, -1].tolist() == [[3.0, 9.0, 1.0], [3.0, 9.0, 0.5], [3.0, 9.0, 0.0], [3.0, 9.0, -0.5]]
    # 1 m, its farthest 4 m, and 1 m/s for 5 s, of which rounding may take a share of 2**-40.
    assert seen.radius == pytest.approx(np.full((1, 4, 3), 10.0 * 2.0**-40), rel=1e-2)
    (claim,) = obstacles(replace(mission, obstacles=(truck,)), standing((5.0, 9.0, 1.0)), strict=False)
    assert claim.times.tolist() == times.tolist()
    towards = moving(BALL, (1.0, 3.0), [(0.0, 1.0, 0.0), (0.0, 2.0, 0.0)])
    (claim,) = obstacles(replace(mission, obstacles=(towards,)), standing((5.0, 9.0, 1.0)), strict=False)
    assert far(claim) == pytest.approx([4.0 - 2.0 - 0.5 - 0.1], abs=1e-9)
    assert lowers(claim) == pytest.approx(np.array([[2.4, 1.9, 1.4, 1.4]]), abs=1e-9)


def test_the_parts_of_a_curve_are_those_between_its_joints() -> None:
    """x = t in the first piece, and 3 - (t - 2)**2 in the second."""
    coefficients = np.zeros((1, 2, 4, 8))
    coefficients[0, 0, 0, 1], coefficients[0, 1, 0, (0, 2)] = 1.0, (3.0, -1.0)
    own = Flight(np.array([2.0, 4.0]), coefficients)
    parts = cut(own.derived(0, (0,)), own.times, np.array([0.0, 0.5, 2.0, 3.0, 3.5, 5.0, 6.0]))
    assert parts.points[0, :, 0, 0] == pytest.approx([0.0, 0.5, 3.0, 2.0, 0.75, -6.0], abs=1e-12)
    assert parts.points[0, :, 0, -1] == pytest.approx([0.5, 2.0, 2.0, 0.75, -6.0, -13.0], abs=1e-12)
    middles = [0.25, 1.25, 3 - 0.25, 3 - 1.5625, 3 - 5.0625, 3 - 12.25]
    assert parts.middle().points[0, :, 0, 0] == pytest.approx(middles, abs=1e-12)
    assert (parts.radius < 1e-12).all()
    assert (parts.radius > 0).all()


# ------------------------------------------------------------------------------ late starts


def test_a_late_start_costs_the_fastest_that_is_flown_about_then_and_the_jumps() -> None:
    """1, 2, 4 and 1 m/s, one second each; between the second and the third it jumps by 0.5 m."""
    own = flight(
        [((0.0, 0.0, 0.0), 1.0), ((1.0, 0.0, 0.0), 2.0), ((3.0, 0.5, 0.0), 4.0), ((7.0, 0.5, 0.0), 1.0)],
        [((9.0, 9.0, 9.0), 0.0)] * 4,
        durations=(1.0, 1.0, 1.0, 1.0),
    )
    assert own.jumps == pytest.approx(np.array([[0.0, 0.5, 0.0], [0.0] * 3]), abs=1e-9)
    assert own.speed == pytest.approx(np.array([[1.0, 2.0, 4.0, 1.0], [0.0] * 4]), abs=1e-9)
    assert own.drift(np.array([0.5, 0.5])) == pytest.approx(
        np.array([[0.5 * 2.0, 0.5 * 4.0 + 0.5, 0.5 * 4.0 + 0.5, 0.5 * 4.0], [0.0] * 4]), abs=1e-9
    )
    # One second is as far as the next piece but one begins.
    assert own.drift(np.array([1.0, 0.0]))[0] == pytest.approx([4.5, 4.5, 4.5, 4.5], abs=1e-9)
    assert own.drift(np.array([0.0, 1.0])) == pytest.approx(np.zeros((2, 4)))


# ------------------------------------------------------------------------------ each other


WIDE, THIN = ir.Vehicle("wide", pair_distance=1.0), ir.Vehicle("thin", tracking=0.125)


def test_two_bodies_keep_what_they_need() -> None:
    mission = team(WIDE, THIN, THIN, separation=0.5)
    places = (1.0, 5.0, 5.0), (4.0, 5.0, 5.0), (4.0, 9.0, 5.0)
    (claim,) = separation(mission, standing(*places), strict=False)
    # The pair distance, or both bodies where that is more, and what both may miss.
    assert lowers(claim) == pytest.approx(np.array([[3 - 1.125] * 2, [5 - 1.125] * 2, [4 - 0.5 - 0.25] * 2]), abs=1e-9)
    assert claim.agents.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert figures(claim) == ("flown separation", "all pairs", "m", 1e-5, 1e-5, "no bodies touch in continuous time")
    assert far(claim) == pytest.approx([3 - 1.125, 5 - 1.125, 4 - 0.75], abs=1e-9)
    (claim,) = separation(mission, standing(*places), strict=True)
    assert lowers(claim)[:, 0] == pytest.approx([3 - 1.125, 5 - 1.125, 4 - 0.5 - 0.5], abs=1e-9)
    assert claim.detail == "every pair of bodies has a separation of 0.5 m in continuous time"
    assert separation(team(WIDE), standing((1.0, 1.0, 1.0)), strict=False) == []


@pytest.mark.parametrize(
    ("vehicle", "astray", "missed"),
    [
        (ir.Vehicle("plain"), None, (0.0, 0.0)),
        (ir.Vehicle("tracking", tracking=0.25), None, (0.5, 0.5)),
        (ir.Vehicle("skew", start_skew=0.25), None, (0.125, 0.125)),
        (ir.Vehicle("plain"), (0.125, 0.25), (0.25, 0.5)),
        (ir.Vehicle("all", tracking=0.25, start_skew=0.25), (0.125, 0.25), (0.875, 1.125)),
    ],
)
def test_what_both_may_miss_is_between_them(
    vehicle: ir.Vehicle, astray: tuple[float, float] | None, missed: tuple[float, float]
) -> None:
    own = flight(
        [((1.0, 5.0, 5.0), 0.5), ((2.0, 5.0, 5.0), 0.0)],
        [((1.0, 9.0, 5.0), 0.0), ((2.0, 9.0, 5.0), 0.0)],
        astray=astray,
    )
    own.coefficients[1, 0, 0, 1] = 0.0
    mission = team(vehicle, replace(vehicle, start_skew=0.0))
    own.coefficients[1, 0, 0, 0] = 2.0
    (claim,) = separation(mission, own, strict=False)
    # In the first piece the other is up to 1 m aside, in which the bound is that of 4 m off.
    assert lowers(claim) == pytest.approx(np.array([[4 - 0.3 - missed[0], 4 - 0.3 - missed[1]]]), abs=1e-9)


def test_who_is_in_a_downwash_is_measured_by_its_half_axes() -> None:
    """Half axes 0.5 m sideways and 1 m in height, of which the first has 0.375 and 0.75."""
    first = ir.Vehicle("first", downwash_radius=0.375, downwash_height=0.75)
    second = ir.Vehicle("second", downwash_radius=0.125, downwash_height=0.25)
    mission = team(first, second, ir.PLAIN)
    (claim,) = downwash(mission, standing((5.0, 5.0, 5.0), (5.0, 8.0, 5.0), (5.0, 5.0, 8.0)))
    assert claim.agents.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert lowers(claim)[:, 0] == pytest.approx(
        [3 / 0.5 - 1, 3 / 0.75 - 1, math.hypot(3 / 0.125, 3 / 0.25) - 1], abs=1e-9
    )
    assert far(claim) == pytest.approx(lowers(claim)[:, 0], abs=1e-9)
    detail = "no vehicle is in the downwash of another in continuous time"
    assert figures(claim) == ("flown downwash", "all pairs", "", 1e-5, 1e-5, detail)


@pytest.mark.parametrize("astray", [None, (0.125, 0.25)])
def test_a_downwash_is_wider_by_what_both_miss_and_higher_by_a_little_more(astray: tuple[float, float] | None) -> None:
    vehicle = ir.Vehicle("some", tracking=0.0625, downwash_radius=0.25, downwash_height=0.5)
    mission = team(vehicle, vehicle, vehicle)
    (claim,) = downwash(mission, standing((5.0, 5.0, 5.0), (5.0, 8.0, 5.0), (5.0, 5.0, 8.0), astray=astray))
    found = lowers(claim)
    for piece, off in enumerate(astray or (0.0, 0.0)):
        missed = 0.125 + 2 * off
        tall = math.sqrt(1.0 * (1 + missed / 0.5) + missed**2 + 0.5 * missed)
        assert tall > 1 + missed
        sideways, above, both = 3 / (0.5 + missed), 3 / tall, math.hypot(3 / (0.5 + missed), 3 / tall)
        assert found[:, piece] == pytest.approx([sideways - 1, above - 1, both - 1], abs=1e-9)
    assert far(claim) == pytest.approx(found.min(axis=1), abs=1e-9)


def test_without_a_height_or_a_width_there_is_no_downwash() -> None:
    flat, thin = ir.Vehicle("flat", downwash_radius=0.5), ir.Vehicle("thin", downwash_height=0.5)
    places = (5.0, 5.0, 5.0), (5.0, 8.0, 5.0), (5.0, 5.0, 8.0)
    assert downwash(team(flat, flat), standing(*places[:2])) == []
    assert downwash(team(thin, thin), standing(*places[:2])) == []
    (claim,) = downwash(team(flat, thin, ir.PLAIN), standing(*places))
    assert claim.agents.tolist() == [[0, 1]]
