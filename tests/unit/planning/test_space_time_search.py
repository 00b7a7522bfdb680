"""Motions of least effort through the cells of a grid and layers of time."""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
import pytest

from missionc.planning.space_time_search import least_effort


def effort(cost: np.ndarray, cells: list[tuple[int, ...]]) -> float:
    moves = sum(float(np.sum(np.subtract(there, here) ** 2)) for here, there in pairwise(cells))
    return moves + sum(float(cost[(layer, *cell)]) for layer, cell in enumerate(cells[:-1]))


def test_a_motion_without_costs_moves_evenly_and_straight() -> None:
    cells = least_effort(np.zeros((4, 9, 3)), (0, 1), (8, 1), 2.0)
    assert cells is not None
    assert cells.tolist() == [[0, 1], [2, 1], [4, 1], [6, 1], [8, 1]]


def test_a_motion_waits_until_a_cell_is_free() -> None:
    cost = np.zeros((4, 5, 1))
    cost[:3, 2] = np.inf
    cells = least_effort(cost, (0, 0), (4, 0), 2.0)
    assert cells is not None
    assert 2 not in cells[:3, 0].tolist()


def test_there_is_no_motion_through_a_wall_that_never_opens_nor_over_a_longer_way_than_there_is_time() -> None:
    wall = np.zeros((4, 5, 1))
    wall[:, 2:4] = np.inf
    assert least_effort(wall, (0, 0), (4, 0), 2.0) is None
    assert least_effort(np.zeros((3, 5, 1)), (0, 0), (4, 0), 1.0) is None


@pytest.mark.parametrize("seed", range(5))
def test_no_other_motion_takes_less_effort(seed: int) -> None:
    cost = np.random.default_rng(seed).uniform(0, 3, (3, 4, 3))
    cost[np.random.default_rng(seed + 100).random(cost.shape) < 0.2] = np.inf
    first, last, reach = (0, 0), (3, 2), 1.5
    ways = ([first, *between, last] for between in product(product(range(4), range(3)), repeat=2))
    within = [
        way for way in ways if all(np.linalg.norm(np.subtract(there, here)) <= reach for here, there in pairwise(way))
    ]
    least = min(effort(cost, way) for way in within)
    cells = least_effort(cost, first, last, reach)
    if cells is None:
        assert least == np.inf
    else:
        assert effort(cost, [tuple(cell) for cell in cells.tolist()]) == pytest.approx(least)
