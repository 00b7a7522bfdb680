"""Drawings at random: what is read of one covers the same area as ezdxf's own functions find in it."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("ezdxf")

import shapely

from missionc.frontend.maps.drawing import drawing
from missionc.frontend.maps.dxf.areas import SAGITTA
from tests.support.random_drawings import (
    ENTITIES,
    FINE,
    asked,
    exploded_area,
    polygons_of,
    random_drawing,
    referee_area,
)

SEEDS = 4
"""Drawings of each kind of entity."""


def area(text: str, kind: str) -> shapely.Geometry:
    return shapely.union_all([polygons_of(feature.shape) for feature in drawing(asked(text, kind)).features])


@pytest.mark.parametrize("kind", ENTITIES)
def test_a_region_is_the_drawn_area_but_for_the_chords_of_its_arcs(kind: str) -> None:
    for seed in range(SEEDS):
        text = random_drawing(np.random.default_rng(seed), kind)
        drawn = referee_area(text)
        strays = shapely.symmetric_difference(area(text, "region"), drawn)
        assert strays.area <= (SAGITTA + FINE) * drawn.length + 1e-6, seed


@pytest.mark.parametrize("kind", ENTITIES)
def test_blocks_are_taken_apart_as_ezdxf_does(kind: str) -> None:
    for seed in range(SEEDS // 2):
        text = random_drawing(np.random.default_rng(100 + seed), kind, deepest=1)
        drawn = exploded_area(text)
        strays = shapely.symmetric_difference(area(text, "region"), drawn)
        assert strays.area <= (SAGITTA + FINE) * drawn.length + 1e-6, seed


@pytest.mark.parametrize("kind", ENTITIES)
def test_an_obstacle_covers_the_drawn_area(kind: str) -> None:
    for seed in range(SEEDS // 2):
        text = random_drawing(np.random.default_rng(200 + seed), kind)
        drawn, read = referee_area(text), area(text, "obstacle")
        assert shapely.difference(drawn, read).area <= 2 * FINE * drawn.length, seed
        assert shapely.difference(read, drawn).area <= (SAGITTA + FINE) * 2 * drawn.length + 1e-6, seed
