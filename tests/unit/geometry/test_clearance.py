"""Segments and motions against obstacles, with the radius and clearance of a body around them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from missionc import ir
from missionc.base.source import Source, Span
from missionc.base.units import Metres, Seconds, Steps
from missionc.geometry.clearance import (
    clear_motions,
    clear_of,
    clear_of_movers,
    clear_places,
    solids,
    standing_solids,
)
from missionc.geometry.displacement import displaced
from missionc.geometry.dynamics import Motions
from missionc.ir.distances.signed_distance import signed_distance

Array = NDArray[np.float64]

SPAN = Span(Source("test.mission", "words"), 0, 5)
BAND = ir.Prism(0.5, 1.5)

PLANE: list[ir.Shape] = [
    ir.Box((1.0, 1.0), (3.0, 2.0)),
    ir.Disc((2.0, 2.0), 0.8),
    ir.Polygon(((1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (2.0, 1.5))),
    ir.Union(ir.Disc((1.0, 1.0), 0.5), ir.Box((2.5, 2.5), (3.5, 3.0))),
    ir.Intersection(ir.Disc((1.5, 2.0), 1.0), ir.Disc((2.5, 2.0), 1.0)),
    ir.Difference(ir.Box((1.0, 1.0), (3.0, 3.0)), ir.Disc((2.0, 2.0), 0.9)),
    ir.Difference(ir.Disc((2.0, 2.0), 1.2), ir.Box((2.0, 0.0), (4.0, 4.0))),
]
VOLUME: list[ir.Shape] = [
    ir.Box((1.0, 1.0, 0.5), (3.0, 2.0, 1.5)),
    ir.Disc((2.0, 2.0), 0.8, BAND),
    ir.Polygon(((1.0, 1.0), (3.0, 1.0), (2.0, 3.0)), BAND),
    ir.Ball((2.0, 2.0, 1.0), 0.8),
    ir.Union(ir.Ball((1.0, 1.0, 1.0), 0.5), ir.Disc((3.0, 3.0), 0.4, BAND)),
    ir.Intersection(ir.Disc((2.0, 2.0), 1.0, BAND), ir.Ball((2.0, 2.0, 1.0), 0.9)),
    ir.Difference(ir.Box((1.0, 1.0, 0.0), (3.0, 3.0, 2.0)), ir.Disc((2.0, 2.0), 0.9, BAND)),
    ir.Difference(ir.Ball((2.0, 2.0, 1.0), 0.9), ir.Box((2.0, 2.0, 1.0), (3.0, 3.0, 2.0))),
]

seeds = st.integers(0, 2**32 - 1)


def gaps(shape: ir.Shape, start: Array, end: Array, generator: np.random.Generator) -> Array:
    """About the least distance of segments to a shape, by points of both; never less than the truth."""
    points = generator.uniform(0, 4, (60_000, start.shape[1])) * ([1.0, 1.0, 0.5][: start.shape[1]])
    tree = cKDTree(points[signed_distance(np, shape, points) <= 0])
    part = np.linspace(0, 1, 101)[:, None, None]
    return np.asarray(tree.query(start * (1 - part) + end * part)[0].min(axis=0))


def a_mission(*obstacles: ir.Obstacle, dimension: int = 2) -> ir.Mission:
    return ir.Mission(
        name="test",
        step=Seconds(1.0),
        steps=Steps(6),
        world=ir.World((0.0,) * dimension, (10.0,) * dimension, SPAN),
        regions=(),
        obstacles=obstacles,
        beacons=(),
        agents=(),
        teams=(),
        groups=(),
        graphs=(),
        formations=(),
        separation=Metres(0.0),
        clearance=Metres(0.0),
        requirements=(),
        preferences=(),
        objective=ir.Objective.NONE,
        solve=ir.SolveWith(),
        span=SPAN,
    )


def mover(shape: ir.Shape, times: tuple[float, ...], offsets: tuple[ir.Vector, ...]) -> ir.Obstacle:
    return ir.Obstacle("mover", shape, ir.Path(tuple(map(Seconds, times)), offsets), SPAN)


@settings(max_examples=20)
@pytest.mark.parametrize("shape", [*PLANE, *VOLUME], ids=str)
@given(seed=seeds)
def test_a_segment_called_clear_keeps_its_margin_and_one_well_away_is_called_clear(shape: ir.Shape, seed: int) -> None:
    generator = np.random.default_rng(seed)
    dimension = 2 if shape in PLANE else 3
    start = generator.uniform(0, 4, (60, dimension)) * ([1.0, 1.0, 0.5][:dimension])
    end = start + generator.normal(0, 0.7, (60, dimension))
    end[:5] = start[:5]
    margin = generator.uniform(0, 0.4, 60)
    clear = clear_of(solids(shape), start, end, margin)
    gap = gaps(shape, start, end, generator)
    assert np.all(gap[clear] >= margin[clear])
    cut = isinstance(shape, ir.Intersection | ir.Difference)
    assert dimension == 3 or np.all(clear[gap > margin + 0.1])
    assert cut or np.all(clear[gap > 1.5 * margin + 0.2])


def test_a_disc_is_passed_at_exactly_its_radius_and_the_margin() -> None:
    disc = solids(ir.Disc((0.0, 0.0), 1.0))
    start, end = np.array([[-2.0, 1.3], [-2.0, 1.29]]), np.array([[2.0, 1.3], [2.0, 1.29]])
    assert clear_of(disc, start, end, np.full(2, 0.3 - 1e-12)).tolist() == [True, False]


def test_a_segment_within_an_obstacle_is_not_clear() -> None:
    inside = np.array([[2.0, 1.5]])
    assert not clear_of(solids(PLANE[0]), inside, inside, np.zeros(1)).any()


def test_a_hole_cut_out_of_an_obstacle_is_free() -> None:
    hole = np.array([[2.0, 2.0]])
    assert clear_of(solids(PLANE[5]), hole, hole, np.full(1, 0.85)).all()


def test_an_agent_flies_over_a_low_obstacle_and_not_through_it() -> None:
    low = solids(ir.Box((1.0, 1.0, 0.0), (3.0, 2.0, 1.0)))
    start, end = np.array([[0.0, 1.5, 1.3], [0.0, 1.5, 0.9], [0, 1.5, 0.9]]), np.array([[4.0, 1.5, 1.3]] * 3)
    end[2] = [4.0, 1.5, 2.9]
    assert clear_of(low, start, end, np.full(3, 0.2)).tolist() == [True, False, True]


def test_a_prism_left_in_part_by_a_difference_keeps_its_floor_and_ceiling() -> None:
    block = solids(ir.Difference(ir.Box((0.0, 0.0, 0.0), (4.0, 4.0, 3.0)), ir.Box((0.0, 0.0, 1.0), (4.0, 4.0, 2.0))))
    places = np.array([[2.0, 2.0, 0.5], [2.0, 2.0, 1.5], [2.0, 2.0, 2.5]])
    assert clear_of(block, places, places, np.full(3, 0.4)).tolist() == [False, True, False]


def test_a_bent_motion_is_clear_of_what_its_chord_would_hit() -> None:
    motions = Motions(np.array([[0.0, 0.0]]), np.array([[2.0, 4.0]]), np.array([[0.0, -4.0]]))
    pole = solids(ir.Disc((2.0, 0.2), 0.3))
    assert clear_motions(pole, motions, 2.0, 0.1).all()
    assert not clear_of(pole, motions.position, motions.at(2.0), np.full(1, 0.1)).any()


def test_a_bent_motion_is_not_clear_of_what_it_bends_into() -> None:
    motions = Motions(np.array([[0.0, 0.0]]), np.array([[2.0, 4.0]]), np.array([[0.0, -4.0]]))
    assert not clear_motions(solids(ir.Disc((2.0, 2.2), 0.3)), motions, 2.0, 0.1).any()


def test_a_moving_obstacle_blocks_a_motion_only_while_it_is_there() -> None:
    truck = mover(ir.Disc((0.0, 0.0), 0.5), (0.0, 6.0), ((0.0, 0.0), (6.0, 0.0)))
    crossing = Motions(np.array([[2.5, -1.0]]), np.array([[0.0, 2.0]]), np.zeros((1, 2)))
    assert clear_of_movers(a_mission(truck), crossing, 0.1)[:, 0].tolist() == [True, True, False, True, True, True]


def test_two_that_swap_places_within_a_step_meet_between_its_ends() -> None:
    ball = mover(ir.Disc((0.0, 0.0), 0.2), (0.0, 1.0), ((0.0, 0.0), (4.0, 0.0)))
    against = Motions(np.array([[4.0, 0.0]]), np.array([[-4.0, 0.0]]), np.zeros((1, 2)))
    mission = a_mission(ball)
    assert not clear_of_movers(mission, against, 0.1)[0, 0]
    assert clear_places(mission, np.array([[4.0, 0.0]]), 0.1, range(7))[:, 0].tolist() == [True, *[False] * 6]


def test_a_moving_obstacle_that_turns_back_within_a_step_is_met_at_the_corner() -> None:
    there_and_back = mover(ir.Disc((0.0, 0.0), 0.2), (0.0, 0.5, 1.0), ((0.0, 0.0), (2.0, 0.0), (0.0, 0.0)))
    waiting = Motions(np.array([[2.3, 0.0]]), np.zeros((1, 2)), np.zeros((1, 2)))
    mission = a_mission(there_and_back)
    assert clear_of_movers(mission, waiting, 0.2)[:, 0].tolist() == [False, *[True] * 5]
    assert clear_places(mission, waiting.position, 0.2, range(7)).all()


@settings(max_examples=15)
@pytest.mark.parametrize("growth", [0.0, 0.3])
@given(seed=seeds)
def test_motions_called_clear_of_a_moving_obstacle_keep_their_margin_at_every_moment(growth: float, seed: int) -> None:
    generator = np.random.default_rng(seed)
    times = (0.3, 1.7, 2.4, 5.1)
    offsets = tuple(tuple(map(float, point)) for point in generator.uniform(0, 4, (4, 2)))
    obstacle = replace(mover(ir.Polygon(((0.0, 0.0), (1.0, 0.0), (0.0, 0.8))), times, offsets), growth=growth)
    mission = a_mission(obstacle)
    motions = Motions(
        generator.uniform(0, 5, (30, 2)),
        generator.normal(0, 1, (30, 2)),
        generator.choice([0.0, 1.0]) * np.ones((30, 2)),
    )
    clear = clear_of_movers(mission, motions, 0.2)
    for step in range(6):
        least = np.full(30, np.inf)
        for moment in np.linspace(0, 1, 101):
            place = motions.at(moment) - displaced(obstacle, step + moment, 2)
            least = np.minimum(least, signed_distance(np, obstacle.shape, place) - growth * (step + moment))
        assert np.all(least[clear[step]] >= 0.2 - 1e-9)
        assert np.all(clear[step][least > 0.25])


def test_an_obstacle_that_grows_blocks_from_when_it_has_come_so_far() -> None:
    crowd = replace(ir.Obstacle("crowd", ir.Disc((0.0, 0.0), 1.0), ir.Still(), SPAN), growth=0.5)
    mission = a_mission(crowd)
    waiting = Motions(np.array([[2.6, 0.0]]), np.zeros((1, 2)), np.zeros((1, 2)))
    # 1.5 m away, a margin of 0.1 m is left until it has grown by 1.5 m, at 3 s.
    assert clear_of_movers(mission, waiting, 0.1)[:, 0].tolist() == [True, True, True, False, False, False]
    assert clear_places(mission, waiting.position, 0.1, range(7))[:, 0].tolist() == [*[True] * 4, *[False] * 3]
    assert len(standing_solids(mission)) == 1


def test_obstacles_that_move_are_not_among_those_that_stand() -> None:
    still = ir.Obstacle("still", PLANE[0], ir.Still(), SPAN)
    assert len(standing_solids(a_mission(still, mover(PLANE[1], (0.0, 1.0), ((0.0, 0.0), (1.0, 0.0)))))) == 1
