"""Interval arithmetic: exact where the ends are, and the next double beyond them; measures of agents in boxes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.trace import Array
from missionc.base.units import Metres
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union
from missionc.verification.impossibility.intervals import (
    Boxes,
    Interval,
    IntervalView,
    between,
    exactly,
    greater,
    length,
    less,
    must_be_apart,
    pairwise,
    signed_distances,
)
from tests.support.random_runs import BASE, MAST, SPAN, mission_of


def of(low: float, high: float) -> Interval:
    return Interval(np.array([low]), np.array([high]))


def ends(interval: Interval) -> tuple[float, float]:
    return float(interval.low.ravel()[0]), float(interval.high.ravel()[0])


def beyond(low: float, high: float, often: int = 1) -> tuple[float, float]:
    """So many doubles further out at both ends."""
    for _ in range(often):
        low, high = float(np.nextafter(low, -math.inf)), float(np.nextafter(high, math.inf))
    return low, high


def holds(interval: Interval, low: float, high: float) -> bool:
    """Whether it holds all between these two, and next to nothing else."""
    begin, end = ends(interval)
    return begin < low < begin + 1e-8 and end - 1e-8 < high < end


def test_sums_and_products_hold_the_ends_and_one_double_more() -> None:
    one = of(-1.0, 2.0)
    assert ends(one + of(3.0, 5.0)) == beyond(2.0, 7.0)
    assert ends(one + 3.0) == ends(3.0 + one) == beyond(2.0, 5.0)
    assert ends(-one) == (-2.0, 1.0)
    assert ends(one - of(3.0, 5.0)) == beyond(-6.0, -1.0)
    assert ends(one - 3.0) == beyond(-4.0, -1.0)
    assert ends(3.0 - one) == beyond(1.0, 4.0)
    assert ends(np.array([3.0]) - one) == beyond(1.0, 4.0)
    assert ends(one * 3.0) == ends(3.0 * one) == beyond(-3.0, 6.0)
    assert ends(one * -3.0) == beyond(-6.0, 3.0)
    assert ends(one / 2.0) == beyond(-0.5, 1.0)
    assert ends(one / -2.0) == beyond(-1.0, 0.5)


def test_a_size_is_least_at_0_where_that_lies_between() -> None:
    sizes = {(-1.0, 2.0): (0.0, 2.0), (-3.0, 2.0): (0.0, 3.0), (1.0, 2.0): (1.0, 2.0), (-3.0, -1.0): (1.0, 3.0)}
    for (low, high), found in sizes.items():
        assert ends(abs(of(low, high))) == found
    assert ends(abs(of(0.0, 2.0))) == (0.0, 2.0)
    assert ends(abs(of(-2.0, 0.0))) == (0.0, 2.0)


def test_the_greater_and_the_lesser_of_two() -> None:
    assert ends(greater(of(-1.0, 2.0), of(0.0, 1.0))) == (0.0, 2.0)
    assert ends(less(of(-1.0, 2.0), of(0.0, 1.0))) == (-1.0, 1.0)
    assert ends(greater(of(-1.0, 2.0), 3.0)) == (3.0, 3.0)
    assert ends(less(of(-1.0, 2.0), 0.5)) == (-1.0, 0.5)
    assert exactly(2.0).low == exactly(2.0).high == 2.0


def test_a_length_is_between_those_of_the_nearest_and_the_furthest() -> None:
    assert holds(length([of(3.0, 6.0), of(-4.0, -8.0 + 16.0)]), 3.0, 10.0)
    assert holds(length([of(3.0, 6.0), of(4.0, 8.0)]), 5.0, 10.0)
    assert holds(length([of(-6.0, -3.0)]), 3.0, 6.0)
    low, high = ends(length([of(-1.0, 1.0), of(0.0, 0.0)]))
    assert low == float(np.nextafter(0.0, -math.inf))
    assert 1.0 < high < 1.0 + 1e-12


def boxes(low: tuple[float, ...], high: tuple[float, ...]) -> Boxes:
    return np.array([low]), np.array([high])


FLAT = boxes((3.0, 0.0), (4.0, 1.0))
HIGH = boxes((3.0, 0.0, 5.0), (4.0, 1.0, 6.0))


@pytest.mark.parametrize(
    ("shape", "where", "low", "high"),
    [
        # Beside a box of two metres; within one that is wider, where its nearest side is above or below.
        (Box((0.0, -1.0), (2.0, 3.0)), FLAT, 1.0, 2.0),
        (Box((0.0, -3.0), (9.0, 3.0)), FLAT, -3.0, -2.0),
        (Box((0.0, 4.0), (0.0, 9.0)), FLAT, math.hypot(3, 3), math.hypot(4, 4)),
        (Disc((0.0, 0.0), 1.0), FLAT, 2.0, math.hypot(4, 1) - 1),
        (Disc((3.5, 0.5), 2.0), FLAT, -2.0, math.sqrt(0.5) - 2),
        (Disc((0.0, 0.0), 1.0, Prism(0.0, 5.5)), HIGH, 2.0, math.hypot(math.hypot(4, 1) - 1, 0.5)),
        (Disc((3.5, 0.5), 2.0, Prism(0.0, 4.0)), HIGH, 1.0, 2.0),
        (Disc((3.5, 0.5), 2.0, Prism(0.0, 9.0)), HIGH, -2.0, math.sqrt(0.5) - 2),
        (Disc((3.5, 0.5), 9.0, Prism(4.0, 8.0)), HIGH, -2.0, -1.0),
        (Ball((0.0, 0.0, 5.0), 1.0), HIGH, 2.0, math.hypot(4, 1, 1) - 1),
        (Box((0.0, 0.0, 0.0), (9.0, 1.0, 2.0)), HIGH, 3.0, 4.0),
        (Union(Disc((0.0, 0.0), 1.0), Box((0.0, -3.0), (9.0, 3.0))), FLAT, -3.0, -2.0),
        (Intersection(Disc((0.0, 0.0), 1.0), Box((0.0, -3.0), (9.0, 3.0))), FLAT, 2.0, math.hypot(4, 1) - 1),
        (Difference(Box((0.0, -3.0), (9.0, 3.0)), Disc((0.0, 0.0), 1.0)), FLAT, -3.0, -2.0),
        (Difference(Box((0.0, -3.0), (9.0, 3.0)), Disc((3.5, 0.5), 4.0)), FLAT, 4 - math.sqrt(0.5), 4.0),
    ],
)
def test_distances_to_shapes_are_those_of_the_nearest_and_the_furthest_point(
    shape: Shape, where: Boxes, low: float, high: float
) -> None:
    assert holds(signed_distances(shape, where), low, high)


def test_distances_to_a_polygon_are_that_of_the_middle_and_half_a_diagonal() -> None:
    square = ((0.0, -1.0), (1.0, -1.0), (1.0, 3.0), (0.0, 3.0))
    half = math.sqrt(0.5)
    assert holds(signed_distances(Polygon(square), FLAT), 2.5 - half, 2.5 + half)
    # Two metres above it and two and a half beside it, or a metre above.
    low, high = 2.5 - half, 2.5 + half
    band = signed_distances(Polygon(square, Prism(0.0, 4.0)), HIGH)
    assert holds(band, math.hypot(low, 1.0), math.hypot(high, 2.0))


def test_ways_between_boxes_lead_from_the_first_to_the_second() -> None:
    x, y = between(boxes((0.0, 0.0), (1.0, 2.0)), boxes((5.0, -1.0), (6.0, 0.0)))
    assert ends(x) == beyond(4.0, 6.0)
    assert ends(y) == beyond(-3.0, 0.0)


def test_each_of_one_list_is_beside_each_of_the_other() -> None:
    one: Boxes = np.zeros((2, 2)), np.ones((2, 2))
    other: Boxes = np.full((3, 2), 5.0), np.full((3, 2), 6.0)
    here, there = pairwise(one, other)
    assert [each.shape for each in (*here, *there)] == [(2, 1, 2)] * 2 + [(1, 3, 2)] * 2
    assert length(between(here, there)).low.shape == (2, 3)


def team(*radii: float) -> ir.Mission:
    mission = replace(mission_of(len(radii), 2), separation=Metres(0.25))
    return replace(
        mission,
        agents=tuple(
            replace(agent, radius=Metres(radius), altitude=Metres(2.0 + agent.index))
            for agent, radius in zip(mission.agents, radii, strict=True)
        ),
    )


TEAM = team(0.5, 0.125, 1.0)
PLACES = {1: boxes((0.0, 0.0), (0.5, 0.0)), 0: boxes((3.0, 4.0), (3.0, 4.0)), 2: boxes((0.5, 0.0), (0.5, 0.0))}
VIEW = IntervalView(TEAM, PLACES, of(1.0, 2.0))
"""The second agent is the one that is asked."""


def test_bodies_are_apart_by_their_radii_and_the_separation_but_for_what_is_let_pass() -> None:
    assert must_be_apart(TEAM, 0, 1) == pytest.approx(0.875 - 1.2e-5, rel=1e-12)
    assert must_be_apart(TEAM, 1, 2) == pytest.approx(1.375 - 1.2e-5, rel=1e-12)


def test_who_is_asked_is_the_first_who_is_somewhere() -> None:
    assert VIEW.place(None) is PLACES[1]
    assert VIEW.place(0) is PLACES[0]
    assert VIEW.radius() == 0.125
    assert ends(VIEW.coordinate(0)) == (0.0, 0.5)
    assert ends(VIEW.altitude()) == beyond(3.0, 3.0)
    assert ends(VIEW.speed()) == (1.0, 2.0)
    assert ends(VIEW.nothing()) == ends(VIEW.nothing(of_team=True)) == (0.0, 0.0)
    assert ends(VIEW.larger(of(0.0, 3.0), of(1.0, 2.0))) == (1.0, 3.0)
    above = IntervalView(replace(TEAM, world=ir.World((0.0,) * 3, (9.0,) * 3, SPAN)), {0: HIGH})
    assert ends(above.altitude()) == (5.0, 6.0)


def test_distances_are_at_least_what_bodies_keep() -> None:
    assert holds(VIEW.apart(None, 0), math.hypot(2.5, 4.0), 5.0)
    assert holds(VIEW.apart(0, 2), math.hypot(2.5, 4.0), math.hypot(2.5, 4.0))
    # The third is half a metre away at most, and keeps more.
    least = must_be_apart(TEAM, 1, 2)
    assert ends(VIEW.apart(None, 2)) == (least, least)
    assert ends(VIEW.apart(1, 1))[0] <= 0.0
    assert ends(VIEW.apart(1, 1))[1] == pytest.approx(0.5)


def test_distances_to_places_and_errors_of_edges() -> None:
    assert holds(VIEW.to_beacon(replace(MAST, position=(1.0, 2.0))), math.hypot(0.5, 2.0), math.hypot(1.0, 2.0))
    assert holds(VIEW.outside(replace(BASE, shape=Disc((0.0, 3.0), 1.0))), 2.0, math.hypot(0.5, 3.0) - 1)
    assert holds(VIEW.formation_error(ir.FormationEdge(1, 0, 6.0)), 1.0, 6.0 - math.hypot(2.5, 4.0))
    assert holds(VIEW.formation_error(ir.FormationEdge(1, 0, (3.0, 3.0))), 1.0, math.hypot(0.5, 1.0))
    assert holds(VIEW.formation_error(ir.FormationEdge(0, 1, (-3.0, -3.0))), 1.0, math.hypot(0.5, 1.0))


def test_what_is_not_seen_is_an_error() -> None:
    alone = IntervalView(TEAM, {1: FLAT})
    resource = ir.Resource("fuel", (0,), 1.0, 1.0, 1.0, 0.0, (), SPAN)
    asked: dict[str, Callable[[], object]] = {
        "another agent is not seen here": lambda: alone.apart(None, 0),
        "no speed is seen here": alone.speed,
        "a graph is not seen here": lambda: alone.weakest_link(TEAM.graphs[0]),
        "the steps before are not seen here": lambda: alone.level(resource),
        "no heading is seen here": lambda: alone.facing(0.0, 1.0),
    }
    for words, ask in asked.items():
        with pytest.raises(ValueError, match=words):
            ask()
    with pytest.raises(ValueError, match="the steps before are not seen here"):
        alone.flagged(ir.Flag("wet", (0,), BASE, None, SPAN))


def test_intervals_of_many_are_worked_out_at_once() -> None:
    many: Array = np.array([1.0, -2.0, 3.0])
    found = abs(Interval(many, many + 1.0))
    assert found.low.tolist() == [1.0, 1.0, 3.0]
    assert found.high.tolist() == [2.0, 2.0, 4.0]
