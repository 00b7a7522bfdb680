"""What single places say of areas, the geometries say too."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from missionc.base.units import Metres
from missionc.geometry.configuration_space import SURE, Area, Atlas, common, covers, disjoint, empty, without
from missionc.ir import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, World
from tests.support.random_runs import SPAN

COORDINATES = st.sampled_from([0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.5, 6.0])
SIZES = st.sampled_from([0.25, 0.5, 1.0, 2.0])


@st.composite
def shapes(draw: st.DrawFn, dimension: int, depth: int = 2) -> Shape:
    kinds = ["box", "disc", "polygon"] + ["ball"] * (dimension == 3) + ["combined"] * (depth > 0)
    kind = draw(st.sampled_from(kinds))
    if kind == "combined":
        combine = draw(st.sampled_from([Union, Intersection, Difference]))
        return combine(draw(shapes(dimension, depth - 1)), draw(shapes(dimension, depth - 1)))
    corner = tuple(draw(COORDINATES) for _ in range(dimension))
    sides = tuple(draw(SIZES) for _ in range(dimension))
    band = Prism(corner[2], corner[2] + sides[2]) if dimension == 3 else None
    if kind == "box":
        return Box(corner, tuple(low + side for low, side in zip(corner, sides, strict=True)))
    if kind == "disc":
        return Disc(corner[:2], Metres(sides[0]), band)
    if kind == "ball":
        return Ball(corner, Metres(sides[0]))
    x, y = corner[:2]
    return Polygon(((x, y), (x + sides[0], y), (x + sides[0] / 2, y + sides[1])), band)


@st.composite
def pairs(draw: st.DrawFn) -> tuple[Atlas, Area, Area]:
    """Two areas of one world, made as the checks make them."""
    dimension = draw(st.sampled_from([2, 3]))
    world = World((0.0,) * dimension, (6.0,) * dimension, SPAN)
    written = [draw(shapes(dimension)) for _ in range(3)]
    atlas = Atlas.of(world, written)
    taken = atlas.grown(atlas.union([atlas.inner(shape) for shape in written[1:]]), draw(SIZES) / 5, outer=False)
    weights = tuple(draw(st.sampled_from([-1.0, 0.0, 1.0])) for _ in range(dimension))
    near = written[0] if isinstance(written[0], Box | Ball) else Box(world.low, (1.0,) * dimension)
    first = draw(
        st.sampled_from(
            [
                atlas.outer(written[0]),
                atlas.near(near, draw(SIZES), outer=True),
                atlas.shrunk(atlas.outer(written[0]), draw(SIZES) / 5),
                atlas.half_space(weights, draw(COORDINATES)),
                common(without(atlas.whole(), taken), atlas.whole()),
            ]
        )
    )
    return atlas, first, draw(st.sampled_from([taken, atlas.inner(written[2]), atlas.outer(written[1])]))


@given(pairs())
def test_places_and_geometries_agree(drawn: tuple[Atlas, Area, Area]) -> None:
    atlas, first, second = drawn
    layers, one, other = atlas.layers(), first.geometry(), second.geometry()
    assert empty(first) == layers.empty(one)
    assert disjoint(first, second) == layers.disjoint(one, other)
    assert covers(second, first) == layers.covers(other, one)
    assert covers(first, second) == layers.covers(one, other)


@given(pairs())
def test_a_place_is_as_deep_in_an_area_and_as_far_from_it_as_is_said(drawn: tuple[Atlas, Area, Area]) -> None:
    atlas, first, second = drawn
    layers = atlas.layers()
    for area in (first, second):
        for place in [*first.seeds(), *second.seeds()][:20]:
            if area.depth(place) > SURE:
                assert layers.holds(area.geometry(), [place]) == [True]
            if area.away(place) > SURE:
                assert layers.holds(area.geometry(), [place]) == [False]
            (distance,) = layers.distances([place], area.geometry())
            assert distance <= max(-area.depth(place), 0.0) + 1e-9
            assert distance >= area.away(place) - 1e-3 or area.away(place) <= 0
