"""Occupancy grids as polygons: every occupied cell is covered, and nothing further away than was allowed."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from missionc.frontend.maps.occupancy_grid import Cells, vectorise, without_holes
from missionc.frontend.resolve.resolve_shapes import SIMPLE, fault

ROUNDING = 1e-6
"""Sides of a cell."""

GRIDS = st.tuples(st.integers(1, 14), st.integers(1, 14)).flatmap(lambda shape: arrays(np.bool_, shape))
STRAYS = st.sampled_from([0.5, 1.0, 2.5])


def as_area(cells: Cells) -> shapely.Geometry:
    """The occupied cells, one by one."""
    rows, columns = np.nonzero(cells)
    return shapely.union_all(shapely.box(columns, rows, columns + 1, rows + 1))


def hall(degrees: float, side: int = 120) -> Cells:
    """Walls around a floor with racks, turned about its middle."""
    y, x = np.mgrid[0:side, 0:side] + 0.5 - side / 2
    turn = np.radians(degrees)
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    reach = np.maximum(abs(u), abs(v))
    racks = (abs(u) < 28) & (abs(v) < 30) & (abs(u) > 6) & (np.mod(v, 12) < 5)
    cells: Cells = ((reach < 40) & (reach > 37)) | racks
    return cells


@settings(max_examples=150)
@given(GRIDS, STRAYS)
@example(np.ones((3, 3), dtype=bool), 0.5)
@example(np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], dtype=bool), 0.5)
@example(np.array([[1, 0], [0, 1]], dtype=bool), 0.5)
@example(np.zeros((2, 2), dtype=bool), 0.5)
def test_polygons_cover_every_occupied_cell_and_stray_no_further_than_allowed(cells: Cells, stray: float) -> None:
    polygons = vectorise(cells, stray, 40)
    area = shapely.union_all([shapely.Polygon(corners) for corners in polygons])
    occupied = as_area(cells)
    assert shapely.difference(occupied, area).area <= ROUNDING
    # What is left of the result beyond a circle around the cells, drawn a little too large.
    assert shapely.difference(area, shapely.buffer(occupied, stray * 1.001, quad_segs=64)).area <= ROUNDING


@settings(max_examples=100)
@given(GRIDS, STRAYS)
def test_every_polygon_is_simple_and_has_no_more_corners_than_allowed(cells: Cells, stray: float) -> None:
    for corners in vectorise(cells, stray, 12):
        assert fault(corners) is SIMPLE
        assert len(corners) <= 12


@pytest.mark.parametrize("degrees", [0, 7, 45])
def test_a_hall_becomes_few_polygons(degrees: float) -> None:
    cells = hall(degrees)
    assert len(vectorise(cells, 0.5, 1000)) <= 20
    assert sum(map(len, vectorise(cells, 1.0, 1000))) <= 220


def test_walls_along_the_axes_stay_as_they_are() -> None:
    cells = np.zeros((9, 12), dtype=bool)
    cells[2:4, 3:9] = True
    ((corners),) = vectorise(cells, 0.5, 1000)
    assert sorted(corners) == [(3, 2), (3, 4), (9, 2), (9, 4)]


def test_stairs_at_45_degrees_become_a_line() -> None:
    cells = np.tri(20, dtype=bool)
    ((corners),) = vectorise(cells, 0.5, 1000)
    assert len(corners) <= 5


def test_a_ring_is_cut_into_parts_without_holes() -> None:
    outer, hole = ((0, 0), (10, 0), (10, 10), (0, 10)), ((2, 2), (2, 8), (8, 8), (8, 2))
    parts = without_holes((outer, hole))
    assert len(parts) == 2
    assert sum(shapely.Polygon(part).area for part in parts) == pytest.approx(100 - 36)
