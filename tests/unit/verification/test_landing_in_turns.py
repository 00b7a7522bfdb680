"""Landing after a stop: by how much each is clear in its turn of others and obstacles, and which turns those are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import Pieces
from missionc.verification.flight.verify_whole_flight import (
    Stop,
    above_pads,
    in_turns,
    landing_margins,
    pad_turns,
    pads_suffice,
)
from tests.support.legal_plans import mission_of, moving, still

Places = Sequence[tuple[float, ...]]

FIRST = ir.Vehicle("first", tracking=0.0625, downwash_radius=0.375, downwash_height=0.25, vertical_speed=0.5)
SECOND = ir.Vehicle("second", tracking=0.125, downwash_radius=0.625, downwash_height=0.375, vertical_speed=0.5)
NEAR = (1.0, 1.0, 1.0), (1.75, 1.0, 3.0)
"""0.75 m apart seen from above, and 2 m in height."""


def team(places: Places, *vehicles: ir.Vehicle, radii: Sequence[float] = (0.1, 0.2, 0.1, 0.1)) -> ir.Mission:
    made = mission_of(places, 4, separation=0.0)
    agents = (
        replace(agent, vehicle=vehicle, radius=Metres(radius))
        for agent, vehicle, radius in zip(made.agents, vehicles, radii, strict=False)
    )
    return replace(made, agents=tuple(agents))


def stop(places: Places, *turns: tuple[int, ...], at: float = 2.0, seconds: float = 0.5) -> Stop:
    pieces = []
    for place in places:
        coefficients = np.zeros((2, 4, 8))
        coefficients[0, :3, 0] = 9.0
        coefficients[1, :3, 0] = place
        pieces.append(Pieces(np.array([seconds, 1.0]), coefficients))
    return Stop(at, tuple(pieces), turns)


def margins(mission: ir.Mission, own: Stop) -> list[tuple[int, float]]:
    """To a billionth of a metre."""
    return [(index, round(margin, 9)) for index, margin in landing_margins(mission, own)]


def flat(places: Places, *vehicles: ir.Vehicle) -> ir.Mission:
    """In a plane, where nothing has a height."""
    return team([place[:2] for place in places], *vehicles)


# ------------------------------------------------------------------------------ clear of others


@pytest.mark.parametrize(
    ("turns", "expected"),
    [
        # At once: 1 m of both downwashes and 0.1875 m that both may miss.
        (((0, 1),), [(0, 0.75 - 1.1875), (1, 0.75 - 1.1875)]),
        # The lower one first: the other hovers 2 m above, and needs 0.8125 m of it; then bodies alone.
        (((0,), (1,)), [(0, 2.0 - 0.8125), (1, 0.75 - 0.3 - 0.1875)]),
        # The higher one first comes past the other.
        (((1,), (0,)), [(1, 0.75 - 1.1875), (0, 0.75 - 0.3 - 0.1875)]),
        (((1,),), [(1, 0.75 - 1.1875)]),
        (((0,),), [(0, 2.0 - 0.8125)]),
        ((), []),
    ],
)
def test_who_lands_is_clear_of_who_lands_with_it_who_hovers_and_who_stands(
    turns: tuple[tuple[int, ...], ...], expected: list[tuple[int, float]]
) -> None:
    found = margins(team(NEAR, FIRST, SECOND), stop(NEAR, *turns))
    assert found == [(index, round(margin, 9)) for index, margin in expected]


@pytest.mark.parametrize(
    ("figures", "of", "radius", "need"),
    [
        ({"pair_distance": 0.75}, 0, 0.1, 0.75),
        ({"pair_distance": 0.75}, 1, 0.1, 0.75),
        ({"pair_distance": 0.5}, 1, 0.1, 0.625),
        ({}, 0, 0.5, 0.7),
        ({"downwash_height": 0.875}, 0, 0.1, 1.25),
    ],
)
def test_above_another_it_needs_the_largest_of_bodies_pair_distance_and_downwash(
    figures: dict[str, float], of: int, radius: float, need: float
) -> None:
    vehicles = [FIRST, SECOND]
    vehicles[of] = replace(vehicles[of], **figures)  # type: ignore[arg-type]
    mission = team(NEAR, *vehicles, radii=(radius, 0.2))
    assert margins(mission, stop(NEAR, (0,))) == [(0, round(2.0 - need - 0.1875, 9))]


def test_far_enough_aside_nobody_has_to_be_above() -> None:
    apart = (1.0, 1.0, 1.0), (4.0, 5.0, 1.0)
    assert margins(team(apart, FIRST, SECOND), stop(apart, (0,), (1,))) == [(0, 5.0 - 1.1875), (1, 5.0 - 0.4875)]


def test_the_nearest_of_all_decides() -> None:
    places = (1.0, 1.0, 1.0), (4.0, 1.0, 1.0), (1.0, 3.0, 1.0), (9.0, 9.0, 1.0)
    plain = [replace(ir.PLAIN, vertical_speed=1.0)] * 4
    mission = team(places, *plain, radii=(0.1, 0.2, 0.3, 0.4))
    assert margins(mission, stop(places, (0, 1), (2,))) == [
        (0, 2.0 - 0.4),
        (1, 3.0 - 0.3),
        (2, 2.0 - 0.4),
    ]
    alone = team(places[:1], plain[0])
    assert margins(alone, stop(places[:1], (0,))) == [(0, math.inf)]


# ------------------------------------------------------------------------------ clear of obstacles

APART = (1.0, 1.0, 3.0), (8.0, 1.0, 1.0)
"""From 3 m it takes 13 s to land at 0.5 m/s, from 1 m 4.2 s."""


def test_a_turn_lasts_as_long_as_the_slowest_in_it() -> None:
    mission = team(APART, FIRST, replace(SECOND, vertical_speed=0.25))
    assert stop(APART, (0,), (1,), (0, 1)).landing(mission) == [13.0, 8.4, 13.0]
    own = stop(APART)
    assert (own.seconds, own.places.tolist()) == (0.5, [list(place) for place in APART])


def test_what_stands_is_as_far_as_from_the_column() -> None:
    table = still(ir.Disc((1.0, 3.0), 0.5, ir.Prism(0.0, 0.5)), "table")
    post = still(ir.Disc((8.0, 2.0), 0.25, ir.Prism(0.0, 9.0)), "post")
    high = still(ir.Disc((1.0, 1.5), 0.25, ir.Prism(5.0, 9.0)), "high")
    mission = replace(team(APART, FIRST, SECOND), obstacles=(table, post, high))
    found = list(landing_margins(mission, stop(APART, (0,), (1,))))
    assert [index for index, _ in found] == [0, 1]
    assert [margin for _, margin in found] == pytest.approx([1.5 - 0.1625, 0.75 - 0.325], abs=3e-3)


@pytest.mark.parametrize(
    ("turns", "end"), [(((0,), (1,)), (15.5, 19.7)), (((1,), (0,)), (19.7, 6.7)), (((0, 1),), (15.5, 15.5))]
)
def test_what_moves_counts_from_the_stop_on_until_they_stand(
    turns: tuple[tuple[int, ...], ...], end: tuple[float, float]
) -> None:
    """It comes along y at 0.1 m/s towards both; the stop is over at 2.5 s."""
    comes = moving(ir.Box((0.0, 6.0), (9.0, 7.0)), (0.0, 30.0), [(0.0, 0.0), (0.0, -3.0)], "comes")
    mission = replace(flat(APART, FIRST, SECOND), obstacles=(comes,))
    found = dict(landing_margins(mission, stop(APART, *turns)))
    expected = [5.0 - 0.1 * end[0] - 0.1625, 5.0 - 0.1 * end[1] - 0.325]
    assert [found[0], found[1]] == pytest.approx(expected, abs=0.012)


def test_what_has_gone_when_the_stop_is_over_is_not_there() -> None:
    walls = ir.Box((0.0, 2.0), (9.0, 3.0))
    goes = moving(walls, (0.0, 2.0, 3.0), [(0.0, 0.0), (0.0, 0.0), (0.0, 1.0)], "goes")
    mission = replace(flat(APART, FIRST, SECOND), obstacles=(goes,))
    found = dict(landing_margins(mission, stop(APART, (0, 1))))
    assert [found[0], found[1]] == pytest.approx([1.5 - 0.1625, 1.5 - 0.325], abs=0.012)


def test_what_grows_is_as_large_as_when_they_stand() -> None:
    wall = replace(still(ir.Box((0.0, 4.0, 0.0), (9.0, 5.0, 9.0)), "grows"), growth=0.0625)
    mission = replace(team(APART, FIRST, SECOND), obstacles=(wall,))
    found = dict(landing_margins(mission, stop(APART, (0,), (1,))))
    assert [found[0], found[1]] == pytest.approx([3.0 - 15.5 * 0.0625 - 0.1625, 3.0 - 19.7 * 0.0625 - 0.325], abs=0.012)


# ------------------------------------------------------------------------------ which turns


def test_as_many_land_at_once_as_can_the_lowest_first() -> None:
    assert in_turns(team(NEAR, FIRST, SECOND), stop(NEAR)) == ((0,), (1,))
    assert in_turns(team(NEAR[::-1], FIRST, SECOND), stop(NEAR[::-1])) == ((1,), (0,))
    assert in_turns(team(APART, FIRST, SECOND), stop(APART)) == ((0, 1),)
    level = (1.0, 1.0, 1.0), (1.75, 1.0, 1.0)
    assert in_turns(team(level, FIRST, SECOND), stop(level)) == ()
    assert in_turns(team(level, ir.PLAIN, ir.PLAIN), stop(level)) == ((0, 1),)
    # The second is the lowest: the others land with it, or after it.
    places = (5.0, 5.0, 3.0), (1.0, 1.0, 1.0), (1.5, 1.0, 3.0)
    assert in_turns(team(places, *[FIRST] * 3), stop(places)) == ((0, 1), (2,))


@pytest.mark.parametrize(("enough", "turns"), [(1.1874, ((0,),)), (1.1876, ()), (0.2624, ((0,), (1,)))])
def test_who_lands_is_clear_by_enough(enough: float, turns: tuple[tuple[int, ...], ...]) -> None:
    assert in_turns(team(NEAR, FIRST, SECOND), stop(NEAR), enough) == turns


def test_who_is_slow_keeps_others_in_the_air_no_longer_than_they_may_be() -> None:
    """The quick one is down 4.2 s after 2.5 s, the slow one after 13 s; in between a wall comes for the quick one."""
    wall, path = ir.Box((7.0, 5.0), (9.0, 6.0)), [(0.0, 0.0), (0.0, 0.0), (0.0, -5.0)]
    for begins, turns in ((6.7, ((1,), (0,))), (15.6, ((0, 1),)), (5.5, ((0,),))):
        comes = moving(wall, (0.0, begins, begins + 0.5), path, "comes")
        mission = replace(flat(APART, FIRST, SECOND), obstacles=(comes,))
        assert in_turns(mission, stop(APART)) == turns, begins


def test_a_turn_begins_when_the_one_before_it_is_over() -> None:
    """After 4.2 s of the first turn the second lasts 13 s more: it is over at 19.7 s."""
    wall, path = ir.Box((0.0, 5.0), (3.0, 6.0)), [(0.0, 0.0), (0.0, 0.0), (0.0, -5.0)]
    for begins, turns in ((19.75, ((0,), (1,))), (19.0, ((0,),))):
        comes = moving(wall, (0.0, begins, begins + 0.5), path, "comes")
        assert in_turns(replace(flat(NEAR, FIRST, SECOND), obstacles=(comes,)), stop(NEAR)) == turns, begins


# ------------------------------------------------------------------------------ above pads


def test_above_pads_everybody_is_at_rest_and_obstacles_do_not_count() -> None:
    own = above_pads(np.array(NEAR), ((1,),))
    assert (own.at, own.seconds, own.turns) == (0.0, 1.0, ((1,),))
    assert own.places.tolist() == [list(place) for place in NEAR]
    for pieces, place in zip(own.pieces, NEAR, strict=True):
        assert pieces.duration.tolist() == [1.0, 1.0]
        expected = np.zeros((2, 4, 8))
        expected[:, :3, 0] = place
        assert (pieces.coefficients == expected).all()
    table = still(ir.Disc((1.0, 1.0), 0.5, ir.Prism(0.0, 0.5)), "table")
    mission = replace(team(NEAR, FIRST, SECOND), obstacles=(table,))
    assert pad_turns(mission, np.array(NEAR)) == ((0,), (1,))
    assert pads_suffice(mission, NEAR)
    level = (1.0, 1.0, 1.0), (1.75, 1.0, 1.0)
    assert not pads_suffice(mission, level)
    assert pad_turns(mission, np.array(level)) == ()


@pytest.mark.parametrize(("less", "turns"), [(0.9e-6, ((0, 1),)), (1.1e-6, ())])
def test_pads_may_be_nearer_by_what_is_nothing(less: float, turns: tuple[tuple[int, ...], ...]) -> None:
    """0.3 m of bodies, of who has no vehicle."""
    hovers = np.array([(1.0, 1.0, 1.0), (1.0, 1.3 - less, 1.0)])
    assert pad_turns(team(NEAR, ir.PLAIN, ir.PLAIN), hovers) == turns
