"""The checks of safe ends to the number: stops made by hand, of agents that stand or fly straight on."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import Pieces
from missionc.verification.certificate import WAYPOINT, Check, Figure
from missionc.verification.flight.verify_safe_end import (
    failing_stops,
    judge_stops,
    last_to_stand,
    verify_safe_end,
    with_turns,
)
from missionc.verification.flight.verify_whole_flight import Stop, landing_margins
from tests.support.legal_plans import SPAN, mission_of, moving, still

PLACES = [(1.0, 1.0, 1.0), (3.0, 1.0, 1.0)]
TORPID = ir.Vehicle("torpid", tracking=0.02)


def team(*vehicles: ir.Vehicle, places: Sequence[tuple[float, ...]] = PLACES, size: float = 10.0) -> ir.Mission:
    made = mission_of(places[: len(vehicles)], 4, size=size)
    agents = (replace(agent, vehicle=vehicle) for agent, vehicle in zip(made.agents, vehicles, strict=True))
    return replace(made, agents=tuple(agents))


def straight(begin: Sequence[float], *ways: tuple[float, float]) -> Pieces:
    """Pieces one after the other: how long each lasts, and at how many m/s along x."""
    coefficients = np.zeros((len(ways), 4, 8))
    place = np.array(begin, dtype=np.float64)
    for piece, (lasts, speed) in enumerate(ways):
        coefficients[piece, :3, 0] = place
        coefficients[piece, 0, 1] = speed
        place[0] += lasts * speed
    return Pieces(np.array([lasts for lasts, _ in ways]), coefficients)


def standing(mission: ir.Mission, lasts: float = 6.0) -> dict[str, Pieces]:
    return {agent.name: straight(PLACES[agent.index], (lasts / 2, 0.0), (lasts / 2, 0.0)) for agent in mission.agents}


def stop(
    *times: float, places: Sequence[Sequence[float]] = PLACES, turns: tuple[tuple[int, ...], ...] = ()
) -> list[Stop]:
    """Stops of half a second of who stands."""
    return [Stop(time, tuple(straight(place, (0.5, 0.0), (1.0, 0.0)) for place in places), turns) for time in times]


def named(checks: Sequence[Check], name: str, subject: str | None = None) -> Check:
    (found,) = (each for each in checks if each.name == name and subject in (None, each.subject))
    return found


# ------------------------------------------------------------------------------ moments


@pytest.mark.parametrize(
    ("times", "pads", "passed"),
    [
        ((), False, True),
        ((-2.0, 0.0, 4.0), False, True),
        ((-2.0 - 0.9e-6, 4.0 + 0.9e-3), False, True),
        ((-2.0 - 1.1e-6, 4.0), False, False),
        ((-2.0, 4.0 + 1.1e-3), False, False),
        ((0.0, 0.0), False, False),
        ((1.0, 0.0), False, False),
        ((-2.0, 4.0), True, True),
        ((-2.0, 4.0 - 0.9e-3), True, True),
        ((-2.0, 4.0 - 1.1e-3), True, False),
        ((0.0, 0.0, 4.0), True, False),
        ((), True, False),
    ],
)
def test_moments_follow_each_other_within_the_flight_and_from_the_floor_to_its_end(
    times: tuple[float, ...], pads: bool, passed: bool
) -> None:
    mission = team(TORPID, TORPID)
    if pads:
        mission = replace(mission, agents=tuple(replace(agent, pad=ir.Pad(None, SPAN)) for agent in mission.agents))
    found = verify_safe_end(mission, standing(mission), 2.0, 0.0, stop(*times))
    detail = (
        "the stops are in order, and the last is at the end of the flight"
        if pads
        else "the stops are in order and within the flight"
    )
    assert found.checks[0] == Check("safe end moments", "stops", 0.0, "", 0.0, passed, detail=detail)
    assert bool(found.figures) is passed
    assert (len(found.checks) > 1) is (passed and bool(times))
    assert all(check.name.startswith("safe end ") for check in found.checks)
    assert all(boxes.claim.name.startswith("safe end ") for boxes in found.boxes)


def test_the_figures_say_how_long_one_waits_and_for_how_long_there_is_none() -> None:
    """To a millionth of a second."""
    mission = team(TORPID, TORPID)
    stops = [*stop(-1.75), *stop(0.5 + 4e-7, turns=((0,), (1,))), *stop(1.25 + 4e-7, turns=((1,),))]
    assert verify_safe_end(mission, standing(mission), 2.0, 0.0, stops).figures == (
        Figure("safe end wait", "flight", 2.25, "s"),
        Figure("safe end hover", "flight", 2.0, "moments"),
        Figure("safe end without", "flight", 2.75, "s"),
    )
    ends = [figure.value for figure in verify_safe_end(mission, standing(mission), 2.0, 0.0, stop(3.9995)).figures]
    assert ends == [5.9995, 1.0, 0.0]
    ends = [figure.value for figure in verify_safe_end(mission, standing(mission), 2.0, 0.0, ()).figures]
    assert ends == [0.0, 0.0, 6.0]


# ------------------------------------------------------------------------------ how a stop begins and ends


def off(flown: Array, own: Pieces, ends: bool) -> float:
    """By how much a stop is off, each derivative at its beginning, and each that is not zero at its end."""
    lasts, parts = own.duration[0], [0.0]
    for order in range(5):
        scale = lasts**order * math.factorial(7 - order) / math.factorial(7)
        begins = [np.polynomial.Polynomial(axis).deriv(order)(0.0) for axis in own.coefficients[0]]
        here = flown[:, order] * math.factorial(order) * (not ends or order < 4)
        parts.append(float(np.linalg.norm(begins - here)) * scale)
        last = np.array([np.polynomial.Polynomial(axis).deriv(order)(lasts) for axis in own.coefficients[0]])
        if order == 0:
            parts.append(float(np.linalg.norm(last - own.coefficients[1, :, 0])))
        elif order < 4:
            parts.append(float(np.linalg.norm(last)) * scale)
    parts.append(float(np.abs(own.coefficients[1, :, 1:]).max()))
    return max(parts)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("ends", [False, True])
def test_a_stop_begins_as_the_flight_is_there_and_ends_at_rest(seed: int, ends: bool) -> None:
    generator = np.random.default_rng(seed)
    mission = team(TORPID)
    flown = np.zeros((2, 4, 8))
    flown[:, :3, 0] = PLACES[0]
    flown[0, :, 1:5] = flown[1, :, 1:5] = generator.normal(size=(4, 4)) * 0.01
    whole = {"drone[0]": Pieces(np.array([3.0, 1e-9 if ends else 3.0]), flown)}
    stops = []
    for _ in range(2):
        own = np.zeros((2, 4, 8))
        own[:, :3, 0] = PLACES[0]
        chosen = generator.integers(0, 3, (2, 4, 8)) == 0
        own[0, :, :5] = flown[1, :, :5]
        own[1, :, 0] = [np.polynomial.Polynomial(axis)(1.5) for axis in own[0]]
        own[:, :, seed % 6 :] += (generator.normal(size=(2, 4, 8)) * 1e-3 * chosen)[:, :, seed % 6 :]
        stops.append(Stop(2.0, (Pieces(np.array([1.5, 1.0]), own),), ()))
    own_off = [off(flown[1], each.pieces[0], ends) for each in stops]
    check = named(judge_stops(mission, whole, 1.0, stops).checks, "begin")
    assert check.margin == pytest.approx(-max(own_off), rel=1e-6)
    assert (check.at, check.agents, check.subject, check.unit) == (2.0, ("drone[0]",), "drone[0]", "m")
    assert check.detail.startswith("every stop continues the flight")
    assert check.tolerance == pytest.approx(4e-6)


def test_where_a_flight_ends_so_does_its_snap() -> None:
    """Snap of 1.5 m/s**4, for a moment: within a stop of half a second it is worth 1.5 / 2**4 / 840 m."""
    mission = team(TORPID)
    whole = {"drone[0]": straight(PLACES[0], (3.0, 0.0), (1e-3, 0.0))}
    whole["drone[0]"].coefficients[1, 0, 4] = 0.0625
    stops = stop(2.0 + 0.9998e-3, 2.0 + 0.9991e-3, 2.0 + 0.9989e-3, 1.5, places=PLACES[:1])
    margins = [named(judge_stops(mission, whole, 1.0, [each]).checks, "begin").margin for each in stops]
    snap = 1.5 / 2**4 / 840
    assert margins == pytest.approx([0.0, 0.0, -snap, 0.0], abs=5e-6)


def test_the_worst_stop_is_named() -> None:
    mission = team(TORPID)
    stops = [*stop(0.0, places=PLACES[:1]), *stop(1.0, places=[(1.0, 1.25, 1.0)]), *stop(2.0, places=[(1.0, 1.0, 1.1)])]
    check = named(judge_stops(mission, standing(mission), 1.0, stops).checks, "begin")
    assert check.margin == pytest.approx(-0.25)
    assert (check.at, check.passed) == (1.0, False)


# ------------------------------------------------------------------------------ who started late


@pytest.mark.parametrize(
    ("at", "skews", "braking", "missed"),
    [
        (0.0, (0.5, 0.5), 0.0, 0.15),  # 0.3 m/s, until the third second
        (1.4, (0.5, 0.5), 0.0, 0.15),
        (1.6, (0.5, 0.5), 0.0, 0.5),  # 1 m/s from then on
        (1.6, (0.5, 0.1), 0.0, 0.5),
        (1.4, (0.5, 0.1), 0.8, 0.4),
        (1.4, (0.1, 0.5), 0.8, 0.1),
        (1.4, (0.0, 0.0), 0.8, 0.0),
    ],
)
def test_who_started_late_is_off_by_what_it_flies_in_that_time(
    at: float, skews: tuple[float, float], braking: float, missed: float
) -> None:
    """The first agent flies at 0.3, then at 1 m/s, and in its stop at ``braking``; the second at 0.2 m/s."""
    late = team(*(replace(TORPID, start_skew=skew) for skew in skews))
    wide = team(*2 * (replace(TORPID, tracking=TORPID.tracking + missed),))
    column = still(ir.Disc((1.0, 2.0), 0.1, ir.Prism(0.0, 3.0)), "column")
    truck = moving(ir.Disc((1.0, 6.0), 0.1, ir.Prism(0.0, 3.0)), (0.0, 8.0), [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    late, wide = (replace(each, obstacles=(column, truck)) for each in (late, wide))
    whole = {
        "drone[0]": straight(PLACES[0], (3.0, 0.3), (3.0, 1.0)),
        "drone[1]": straight(PLACES[1], (3.0, 0.2), (3.0, 0.2)),
    }
    own = (straight(PLACES[0], (0.25, braking), (1.0, 0.0)), straight(PLACES[1], (0.25, 0.0), (1.0, 0.0)))
    stops = [Stop(at, own, ((0, 1),))]
    ways = [
        {(each.name, each.subject): each for each in judge_stops(one, whole, 1.0, stops).checks} for one in (late, wide)
    ]
    for key in (
        ("landing", "stops"),
        ("flown obstacle", "column"),
        ("flown obstacle", "truck"),
        ("flown separation", "all pairs"),
    ):
        assert ways[0][key].margin == pytest.approx(ways[1][key].margin, abs=2e-5), key
    assert [each.turns for each in with_turns(late, whole, 1.0, stops)] == [
        each.turns for each in with_turns(wide, whole, 1.0, stops)
    ]


def test_whose_nose_alone_turns_is_not_off() -> None:
    late, punctual = team(replace(TORPID, start_skew=0.5)), team(TORPID)
    whole, stops = standing(late), stop(0.0, places=PLACES[:1], turns=((0,),))
    whole["drone[0]"].coefficients[:, 3, 1] = stops[0].pieces[0].coefficients[0, 3, 1] = 1.0
    column = (still(ir.Disc((1.0, 2.0), 0.1, ir.Prism(0.0, 3.0)), "column"),)
    margins = [
        [each.margin for each in judge_stops(replace(one, obstacles=column), whole, 1.0, stops).checks]
        for one in (late, punctual)
    ]
    assert margins[0] == pytest.approx(margins[1], abs=1e-6)


def test_at_a_stop_bodies_alone_count_and_what_they_may_miss() -> None:
    post = still(ir.Disc((1.0, 2.0), 0.1, ir.Prism(0.0, 3.0)), "post")
    mission = replace(team(TORPID, TORPID), separation=Metres(9.0), clearance=Metres(9.0), obstacles=(post,))
    truck = replace(car(0.0, 8.0, offsets=(0.0, 0.0)), name="truck")
    mission = replace(mission, obstacles=(*mission.obstacles, truck))
    checks = {each.subject: each for each in judge_stops(mission, standing(mission), 1.0, stop(0.0)).checks}
    assert checks["all pairs"].margin == pytest.approx(2.0 - 0.2 - 0.04, abs=1e-6)
    assert checks["post"].margin == pytest.approx(1.0 - 0.1 - 0.12, abs=1e-6)
    assert checks["truck"].margin == pytest.approx(5.0 - 0.1 - 0.12, abs=1e-6)
    assert {checks[name].detail for name in ("all pairs", "post", "truck")} == {"no bodies touch in continuous time"}


def test_what_moves_is_beside_each_stop_by_itself() -> None:
    """It is beside the second stop as the first one ends."""
    mission = replace(team(TORPID), obstacles=(car(0.0, 1.5, 2.0, offsets=(0.0, 0.0, 3.0)),))
    stops = [*stop(0.0, places=PLACES[:1]), *stop(2.0, places=[(1.0, 5.0, 1.0)])]
    check = named(judge_stops(mission, standing(mission), 1.0, stops).checks, "flown obstacle")
    assert (check.margin, check.at) == pytest.approx((4.0 - 0.22, 2.0), abs=1e-6)
    check = named(judge_stops(mission, standing(mission), 1.0, stops[:1]).checks, "flown obstacle")
    assert check.margin == pytest.approx(5.0 - 0.22, abs=1e-6)
    closer = [*stop(0.0, places=PLACES[:1]), *stop(2.0, places=[(1.0, 4.5, 1.0)])]
    mission = replace(mission, obstacles=(car(0.0, 1.5, 2.0, offsets=(0.0, 0.0, 9.0)),))
    check = named(judge_stops(mission, standing(mission), 1.0, closer).checks, "flown obstacle")
    assert (check.margin, check.at) == pytest.approx((5.0 - 0.22, 0.0), abs=1e-6)


def test_a_stop_beyond_all_measure_is_refused_without_a_warning() -> None:
    mission = replace(team(TORPID), obstacles=(still(ir.Disc((1.0, 2.0), 0.1, ir.Prism(0.0, 3.0))),))
    far = straight((1.0, 1.0, 3e38), (0.5, 3e38), (1.0, 0.0))
    far.coefficients[0, 0, 4] = 3e38
    endless = Pieces(np.array([3e38, 1.0]), far.coefficients)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for own in (far, endless):
            checks = judge_stops(mission, standing(mission), 1.0, [Stop(0.0, (own,), ((0,),))]).checks
            failing = {check.name for check in checks if not check.passed}
            assert failing >= {"begin", "flown world"}


def test_in_a_stop_the_fastest_of_it_counts() -> None:
    """x = 1.6 t**2 for a quarter of a second: 0.8 m/s at its end, of which 0.5 s are 0.4 m."""
    late, wide = team(replace(TORPID, start_skew=0.5)), team(replace(TORPID, tracking=0.42))
    own = straight(PLACES[0], (0.25, 0.0), (1.0, 0.0))
    own.coefficients[0, 0, 2] = 1.6
    column = (still(ir.Disc((1.0, 3.0), 0.1, ir.Prism(0.0, 3.0)), "column"),)
    margins = [
        named(judge_stops(replace(one, obstacles=column), standing(one), 1.0, [Stop(0.0, (own,), ())]).checks, name)
        for one in (late, wide)
        for name in ("flown obstacle", "flown world")
    ]
    assert [each.margin for each in margins[:2]] == pytest.approx([each.margin for each in margins[2:]], abs=1e-6)


# ------------------------------------------------------------------------------ what is there at a stop


def test_a_check_says_its_time_on_the_missions_clock() -> None:
    mission = replace(team(TORPID), obstacles=(still(ir.Disc((1.0, 3.0), 0.1), "pole"),))
    places = [(1.0, 1.0, 1.0)], [(1.0, 2.0, 1.0)], [(1.0, 1.5, 1.0)]
    stops = [each for at, own in zip((-0.5, 2.0, 4.0), places, strict=True) for each in stop(at, places=own)]
    certificate = judge_stops(mission, standing(mission), 1.0, stops)
    check = named(certificate.checks, "flown obstacle")
    assert check.margin == pytest.approx(1.0 - 0.1 - 0.1 - 0.02, abs=1e-4)
    assert check.at is not None
    assert 2.0 <= check.at <= 3.5
    assert certificate.boxes[0].claim.times.tolist() == [0.0, 0.5, 1.5, 2.0, 3.0, 3.5, 4.5]


def test_what_is_worst_as_a_stop_begins_is_of_that_stop() -> None:
    """Stops follow each other on the clock on which they are judged: this one begins there as another ends."""
    places = [(1.0, 1.0, 1.0)], [(1.0, 0.5, 1.0)], [(1.0, 2.0, 1.0)]
    stops = [each for at, own in zip((-0.5, 2.0, 4.0), places, strict=True) for each in stop(at, places=own)]
    check = named(judge_stops(team(TORPID), standing(team(TORPID)), 1.0, stops).checks, "flown world")
    assert (check.margin, check.at) == pytest.approx((0.48, 2.0))
    # In the last one it rises, and is too high as it begins to hover.
    high = straight((1.0, 2.0, 1.0), (0.5, 0.0), (1.0, 0.0))
    high.coefficients[0, 2, 1] = high.coefficients[1, 2, 2] = 16.0
    high.coefficients[1, 2, 0] = 1.0
    stops[2] = Stop(4.0, (high,), ())
    check = named(judge_stops(team(TORPID), standing(team(TORPID)), 1.0, stops).checks, "flown world")
    assert (check.margin, check.at) == pytest.approx((10.0 - 17.0 - 0.02, 5.5))


@pytest.mark.parametrize(("growth", "age"), [(0.0, 0.0), (0.02, 0.0), (0.02, 5.0)])
def test_what_moves_and_grows_is_where_it_is_at_the_stop(growth: float, age: float) -> None:
    car = moving(ir.Disc((1.0, 6.0), 0.1), (0.0, 2.0, 4.0), ((0.0, 0.0, 0.0), (0.0, -2.0, 0.0), (0.0, 1.0, 0.0)), "car")
    mission = replace(team(TORPID), obstacles=(replace(car, growth=growth, age=age),))
    stops = stop(0.25, 1.5, 3.0, places=PLACES[:1])
    check = named(judge_stops(mission, standing(mission), 1.0, stops).checks, "flown obstacle")
    # It is nearest, 3 m away, in the second stop, after which it grows for 3 s in all.
    assert check.margin == pytest.approx(3.0 - 0.1 - 0.12 - growth * (3.0 + age), abs=1e-4)
    assert check.at == 1.5


def car(*times: float, offsets: Sequence[float], shape: ir.Shape | None = None) -> ir.Obstacle:
    """A disc of 0.1 m at (1, 6), moved along y."""
    return moving(shape or ir.Disc((1.0, 6.0), 0.1), times, [(0.0, each, 0.0) for each in offsets], "car")


@pytest.mark.parametrize(
    ("obstacle", "margins"),
    [
        # From a second before the stop on, for half a second and the hover that is judged with it.
        (car(0.0, 2.0, 4.0, offsets=(0.0, 0.0, -2.0)), (5.0, 4.5, 3.0)),
        (car(3.5, 4.0, 4.5, offsets=(0.0, -3.0, 0.0)), (5.0, 5.0, 2.0)),
        (car(4.25, 4.5, offsets=(0.0, -3.0)), (5.0, 5.0, 2.0)),
        (car(4.5, 4.75, offsets=(0.0, -3.0)), (5.0, 5.0, 5.0)),
        (car(2.75, 3.0, offsets=(-3.0, 0.0)), (2.0, 2.0, 5.0)),
        (car(3.75, 3.875, 4.0, offsets=(0.0, -3.0, 0.0)), (5.0, 5.0, 2.0)),
        (car(0.0, 8.0, offsets=(-2.0, 2.0)), (3.0, 3.5, 4.5)),
        (replace(car(0.0, 8.0, offsets=(0.0, 0.0)), growth=0.125), (4.8125, 4.625, 4.375)),
        (replace(still(ir.Disc((1.0, 6.0), 0.1), "car"), growth=0.125, age=2.0), (4.5625, 4.375, 4.125)),
    ],
)
def test_what_changes_is_looked_at_for_as_long_as_a_stop_and_a_second_last(
    obstacle: ir.Obstacle, margins: tuple[float, ...]
) -> None:
    """The stops begin at 0, 1 and 3 s: they are looked at until 1.5, 2.5 and 4.5 s."""
    mission = replace(team(TORPID), obstacles=(obstacle,))
    stops = stop(0.0, 1.0, 3.0, places=PLACES[:1])
    if obstacle.growth:
        margins = tuple(5.0 - 0.125 * (end + obstacle.age) for end in (1.5, 2.5, 4.5))
    for number, margin in enumerate(margins):
        (check,) = [
            each
            for each in judge_stops(mission, standing(mission), 1.0, [stops[number]]).checks
            if each.name == "flown obstacle"
        ]
        assert (check.margin, check.at) == pytest.approx((margin - 0.1 - 0.12, stops[number].at), abs=6e-3), number
    check = named(judge_stops(mission, standing(mission), 1.0, stops).checks, "flown obstacle")
    least = min(margins)
    assert (check.margin, check.at) == pytest.approx((least - 0.22, stops[margins.index(least)].at), abs=6e-3)
    assert check.subject == "car"


def test_of_every_stop_it_is_said_whether_it_fails() -> None:
    """The first is well; the second begins elsewhere, the third is beside a pole, the fourth meets what moves."""
    pole = still(ir.Disc((1.0, 4.0), 0.1), "pole")
    mission = replace(team(TORPID), obstacles=(pole, car(0.0, 3.5, 3.75, 4.0, 4.25, offsets=(0, 0, -5, -5, 0))))
    moved = [(1.0, 1.0, 1.0), (1.0, 1.0, 1.0 + 4.1e-6), (1.0, 3.9, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0 + 3.9e-6)]
    stops = [
        each for at, place in zip((0.0, 0.5, 1.0, 3.0, 4.5), moved, strict=True) for each in stop(at, places=[place])
    ]
    assert failing_stops(mission, standing(mission), 1.0, stops) == {1, 2, 3}
    assert failing_stops(mission, standing(mission), 1.0, stops[:1]) == set()
    assert failing_stops(mission, standing(mission), 1.0, stops[2:4]) == {0, 1}
    # On another clock none of them begins where the flight is, but those who stand there.
    assert failing_stops(replace(mission, obstacles=()), standing(mission), 1.0, stops) == {1, 2}


def test_a_stop_fails_by_whom_it_is_off_from_by_too_much() -> None:
    mission = team(TORPID, TORPID)
    for index, off, failing in ((0, 3.9e-6, set()), (0, 4.1e-6, {1}), (1, 11.9e-6, set()), (1, 12.1e-6, {1})):
        places = [list(place) for place in PLACES]
        places[index][2] += off
        stops = [*stop(0.0), *stop(1.0, places=places), *stop(2.0)]
        assert failing_stops(mission, standing(mission), 1.0, stops) == failing


def test_whoever_lands_is_clear_by_the_least_of_all_stops() -> None:
    mission = replace(team(TORPID, TORPID), obstacles=(still(ir.Disc((1.0, 2.0), 0.1, ir.Prism(0.0, 0.5)), "block"),))
    stops = [*stop(0.0, turns=((1,),)), *stop(1.0, turns=((0,), (1,))), *stop(2.0)]
    check = named(judge_stops(mission, standing(mission), 1.0, stops).checks, "landing")
    least = min(margin for each in stops for _, margin in landing_margins(mission, each))
    assert check == Check(
        "landing",
        "stops",
        least,
        "m",
        WAYPOINT,
        True,
        1.0,
        ("drone[0]",),
        "every agent that lands after a stop descends vertically without a collision",
    )
    assert least == pytest.approx(1.0 - 0.1 - 0.12, abs=2e-3)
    nobody = named(judge_stops(mission, standing(mission), 1.0, stop(0.0)).checks, "landing")
    assert nobody == Check("landing", "stops", 0.0, "m", WAYPOINT, True, detail="no agent lands")
    alone = team(TORPID)
    far = judge_stops(alone, standing(alone), 1.0, stop(0.0, places=PLACES[:1], turns=((0,),)))
    assert named(far.checks, "landing").margin == 1000.0


@pytest.mark.parametrize("pads", [False, True])
def test_batteries_last_until_everybody_stands(pads: bool) -> None:
    stops = [*stop(0.5, turns=((0,), (1,))), *stop(1.0, turns=((0, 1),)), *stop(4.0)]
    mission = team(TORPID, TORPID)
    if pads:
        mission = replace(mission, agents=tuple(replace(agent, pad=ir.Pad(None, SPAN)) for agent in mission.agents))
    landing = stops[0].landing(mission)
    assert last_to_stand(mission, stops[0], 3.0) == pytest.approx(3.0 + 0.5 + 0.5 + sum(landing))
    latest = max(last_to_stand(mission, each, 1.5 + 2.0) for each in stops)
    assert latest == pytest.approx(max(1.5 + 2.0 + 0.5 + 0.5 + sum(landing), 1.5 + 2.0 + 4.0 + 0.5))
    agents = (
        replace(agent, vehicle=replace(TORPID, endurance=endurance))
        for agent, endurance in zip(mission.agents, (latest, latest - 1.0), strict=True)
    )
    found = verify_safe_end(replace(mission, agents=tuple(agents)), standing(mission), 2.0, 1.5, stops)
    begun = "takeoff" if pads else "the start of the polynomials"
    detail = f"all agents have landed {latest:g} s after {begun}"
    assert [each for each in found.checks if each.name == "safe end endurance"] == [
        Check("safe end endurance", "drone[0]", 0.0, "s", 0.0, True, agents=("drone[0]",), detail=detail),
        Check("safe end endurance", "drone[1]", -1.0, "s", 0.0, False, agents=("drone[1]",), detail=detail),
    ]
    without = verify_safe_end(mission, standing(mission), 2.0, 1.5, stops)
    assert not [each for each in without.checks if each.name == "safe end endurance"]
