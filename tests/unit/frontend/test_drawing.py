"""Drawings: every entity where the world has it, what is left out by name, and counts before any work."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import shapely

pytest.importorskip("ezdxf")

import ezdxf
from ezdxf.math import Vec3

from missionc.base.diagnostics.code import FILE_TOO_LARGE, MAP_FEATURE, MAP_OPTION, MAP_UNREADABLE, Code
from missionc.base.diagnostics.map_error import MapError
from missionc.base.limits import Limits
from missionc.frontend.maps.drawing import drawing
from missionc.frontend.maps.dxf.areas import SAGITTA
from missionc.frontend.maps.feature import Circle, MapPoint
from missionc.frontend.maps.read_map import Reading
from missionc.ir.places import LeftOut
from tests.support.random_drawings import DOWN, asked, polygons_of, text_of

SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]


def new() -> tuple[Any, Any]:
    document = ezdxf.new(units=6)
    return document, document.modelspace()


def read(document: Any, kind: str = "region", **words: Any) -> Reading:
    return drawing(asked(text_of(document), kind, **words))


def area(document: Any, kind: str = "region", **words: Any) -> shapely.Geometry:
    return shapely.union_all([polygons_of(feature.shape) for feature in read(document, kind, **words).features])


def refusal(document: Any, kind: str = "obstacle", **words: Any) -> MapError:
    with pytest.raises(MapError) as raised:
        read(document, kind, **words)
    return raised.value


def same(first: shapely.Geometry, second: shapely.Geometry, within: float = 1e-9) -> bool:
    return bool(shapely.symmetric_difference(first, second).area <= within)


# ----------------------------------------------------------- world coordinates


def test_a_column_of_a_mirrored_block_stands_where_the_drawing_shows_it() -> None:
    document, space = new()
    document.blocks.new("column").add_circle((1, 1), 0.5)
    space.add_blockref("column", (6, 2), dxfattribs={"xscale": -1})
    space.add_blockref("column", (-6, 2), dxfattribs={"extrusion": DOWN})
    space.add_circle((-5, 3), 0.5, dxfattribs={"extrusion": DOWN})
    assert [feature.shape for feature in read(document).features] == [Circle((5, 3), 0.5)] * 3


def test_a_stretched_circle_is_an_ellipse_and_a_tilted_one_too() -> None:
    document, space = new()
    document.blocks.new("column").add_circle((0, 0), 1)
    space.add_blockref("column", (5, 5), dxfattribs={"xscale": 2, "yscale": -1})
    space.add_circle((0, 0), 1, dxfattribs={"extrusion": (math.sqrt(3) / 2, 0, 0.5)})
    stretched, tilted = (polygons_of(feature.shape) for feature in read(document).features)
    assert stretched.bounds == pytest.approx((3, 4, 7, 6), abs=SAGITTA)
    assert tilted.bounds == pytest.approx((-0.5, -1, 0.5, 1), abs=SAGITTA)


def test_rows_and_columns_turn_with_the_block_and_are_not_stretched() -> None:
    document, space = new()
    document.blocks.new("column").add_circle((1, 0), 0.25)
    insert = space.add_blockref("column", (0, 0), dxfattribs={"xscale": 2, "yscale": 2, "rotation": 90})
    insert.grid((2, 3), (10, 5))
    centres = {tuple(np.round(feature.shape.centre, 9)) for feature in read(document).features}
    assert centres == {(-10.0 * row, 2 + 5.0 * column) for row in range(2) for column in range(3)}


def test_bulges_turn_over_in_a_mirrored_block() -> None:
    document, space = new()
    block = document.blocks.new("half")
    block.add_lwpolyline([(-1, 0, 1), (1, 0, 0)], format="xyb", close=True)
    space.add_blockref("half", (0, 0), dxfattribs={"yscale": -1})
    assert area(document).bounds == pytest.approx((-1, 0, 1, 1), abs=SAGITTA)


def test_the_points_of_beacons_are_mirrored_as_well() -> None:
    document, space = new()
    document.blocks.new("mast").add_point((1, 1))
    space.add_blockref("mast", (6, 2), dxfattribs={"xscale": -1})
    space.add_circle((0, 0), 1)
    reading = read(document, "beacon")
    assert [feature.shape for feature in reading.features] == [MapPoint((5, 3))]
    assert reading.left_out == (LeftOut("CIRCLE", "not a point", 1),)


# ----------------------------------------------------------------------- kinds


def _solid(space: Any) -> None:
    space.add_solid([(0, 0), (4, 0), (0, 4), (4, 4)])


def _trace(space: Any) -> None:
    space.add_trace([(0, 0), (4, 0), (0, 4), (4, 4)])


def _face(space: Any) -> None:
    space.add_3dface([(0, 0, 1), (4, 0, 2), (4, 4, 3), (0, 4, 2)])


def _mesh(space: Any) -> None:
    with space.add_mesh().edit_data() as data:
        data.vertices = [Vec3(x, y, z) for z in (0, 2) for x, y in SQUARE]
        data.faces = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5)]


def _polyface(space: Any) -> None:
    space.add_polyface()
    space.add_polyface().append_faces([[(*corner, 0) for corner in SQUARE], [(0, 0, 0), (4, 0, 0), (2, 2, 3)]])


def _polygon_mesh(space: Any) -> None:
    mesh = space.add_polymesh((3, 3))
    for row in range(3):
        for column in range(3):
            mesh.set_mesh_vertex((row, column), (2 * row, 2 * column, row))


def _multiline(space: Any) -> None:
    space.add_mline([(0, 2), (4, 2)], dxfattribs={"scale_factor": 4, "justification": 1})


def _lines(space: Any) -> None:
    for first, last in ((0, 1), (2, 1), (2, 3), (0, 3)):
        space.add_line(SQUARE[first], SQUARE[last])


def _open_polyline(space: Any) -> None:
    space.add_lwpolyline([*SQUARE, SQUARE[0]])


def _wide(space: Any) -> None:
    space.add_lwpolyline([(0, 2), (4, 2)], dxfattribs={"const_width": 4})


def _wide_outline(space: Any) -> None:
    space.add_lwpolyline([(1, 1), (3, 1), (3, 3), (1, 3)], close=True, dxfattribs={"const_width": 2})


def _default_width(space: Any) -> None:
    space.add_polyline2d([(0, 2), (4, 2)], dxfattribs={"default_start_width": 4, "default_end_width": 4})


def _smoothed(space: Any) -> None:
    line = space.add_polyline2d([*SQUARE, (9, 9)], close=True)
    line.vertices[-1].dxf.flags = 16


def test_each_kind_of_flat_area_is_read(subtests: pytest.Subtests) -> None:
    for draw in [
        *(_solid, _trace, _face, _mesh, _polyface, _polygon_mesh, _multiline, _lines, _open_polyline, _wide),
        *(_wide_outline, _default_width, _smoothed),
    ]:
        with subtests.test(draw=draw):
            document, space = new()
            draw(space)
            assert same(area(document), shapely.box(0, 0, 4, 4))


def test_a_width_may_grow_along_a_line() -> None:
    document, space = new()
    space.add_lwpolyline([(0, 0, 2, 4), (3, 0, 0, 0)], format="xyse")
    assert same(area(document), shapely.Polygon([(0, -1), (0, 1), (3, 2), (3, -2)]))


def test_a_wide_arc_is_a_ring() -> None:
    document, space = new()
    space.add_lwpolyline([(-3, 0, 1), (3, 0, 1)], format="xyb", close=True, dxfattribs={"const_width": 1})
    space.add_lwpolyline([(-3, 10, 1), (3, 10, 0)], format="xyb", dxfattribs={"const_width": 1})
    whole, half = (polygons_of(feature.shape) for feature in read(document).features)
    assert whole.area == pytest.approx(math.pi * 3.5**2, rel=1e-2)
    assert half.area == pytest.approx(math.pi / 2 * (3.5**2 - 2.5**2), rel=1e-2)


def test_a_corner_of_a_wide_line_is_mitred_unless_it_is_sharp() -> None:
    document, space = new()
    space.add_lwpolyline([(0, 0), (4, 0), (4, 4)], dxfattribs={"const_width": 1})
    space.add_lwpolyline([(10, 0), (14, 0), (10, 0.5)], dxfattribs={"const_width": 1})
    square, sharp = (polygons_of(feature.shape) for feature in read(document).features)
    assert same(square, shapely.union(shapely.box(0, -0.5, 4.5, 0.5), shapely.box(3.5, -0.5, 4.5, 4)))
    assert sharp.bounds[2] < 14.5


def test_the_round_end_of_a_multiline_is_drawn() -> None:
    document, space = new()
    style = document.mline_styles.new("ROUND")
    style.elements.append(1)
    style.elements.append(-1)
    style.dxf.flags = 1024
    space.add_mline([(0, 0), (4, 0)], dxfattribs={"style_name": "ROUND", "justification": 1})
    assert area(document).bounds == pytest.approx((0, -1, 5, 1), abs=SAGITTA)


def _hatch(style: int) -> Any:
    document, space = new()
    hatch = space.add_hatch(dxfattribs={"hatch_style": style})
    for side in (5, 4, 3):
        hatch.paths.add_polyline_path([(-side, -side), (side, -side), (side, side), (-side, side)])
    return document


@pytest.mark.parametrize(("style", "expected"), [(0, 100 - 64 + 36), (1, 100 - 64), (2, 100)])
def test_a_hatch_is_filled_by_its_style(style: int, expected: float) -> None:
    assert area(_hatch(style)).area == expected


def test_an_obstacle_covers_its_curves_around_a_hole_too() -> None:
    document, space = new()
    hatch = space.add_hatch()
    for radius in (5, 3):
        hatch.paths.add_edge_path().add_arc((0, 0), radius, 0, 360)
    drawn = shapely.Point(0, 0).buffer(5, quad_segs=512) - shapely.Point(0, 0).buffer(3, quad_segs=512)
    assert shapely.difference(drawn, area(document, "obstacle")).area < 1e-9
    assert area(document, "obstacle").area < drawn.area + 2 * SAGITTA * 2 * math.pi * 8


def test_the_boundary_of_a_hatch_may_have_edges_in_any_order_and_shorter_than_a_gap() -> None:
    document, space = new()
    edges = space.add_hatch().paths.add_edge_path()
    corners = [(1e-2 * math.cos(at * math.tau / 200), 1e-2 * math.sin(at * math.tau / 200)) for at in range(200)]
    for at in np.random.default_rng(1).permutation(200):
        edges.add_line(corners[at], corners[(at + 1) % 200])
    assert same(area(document), shapely.Polygon(corners))


def test_a_rational_spline_is_the_circle_that_it_stands_for() -> None:
    document, space = new()
    curve = ezdxf.math.rational_bspline_from_arc((0, 0), 100, 0, 360)
    space.add_spline().apply_construction_tool(curve)
    circle = shapely.Point(0, 0).buffer(100, quad_segs=4096)
    assert shapely.hausdorff_distance(area(document).exterior, circle.exterior) <= SAGITTA


# ---------------------------------------------------------------- joined lines


def test_ends_that_nearly_meet_are_joined_and_an_obstacle_covers_the_gap() -> None:
    document, space = new()
    for first, last in ((0, 1), (1, 2), (2, 3)):
        space.add_line(SQUARE[first], SQUARE[last])
    space.add_line((0, 4.0005), (0.0005, 0))
    assert same(area(document), shapely.box(0, 0, 4, 4), 0.005)
    assert shapely.covers(area(document, "obstacle"), shapely.box(0, 0, 4, 4))


def test_arcs_and_lines_of_one_layer_make_an_outline_together() -> None:
    document, space = new()
    space.add_line((-1, 0), (1, 0))
    space.add_arc((0, 0), 1, 0, 180)
    space.add_circle((5, 5), 1)
    half, circle = read(document).features
    assert polygons_of(half.shape).area == pytest.approx(math.pi / 2, rel=0.02)
    assert circle.shape == Circle((5, 5), 1)


def test_two_outlines_that_touch_in_a_corner_are_two() -> None:
    document, space = new()
    for x, y in ((0, 0), (1, 1)):
        corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
        for at in range(4):
            space.add_line(corners[at - 1], corners[at])
    assert [polygons_of(feature.shape).area for feature in read(document).features] == [1, 1]


@pytest.mark.parametrize(
    "last",
    [[(0, 4), (0, 0.002)], [(0, 4), (0, 0)], [(0, 4), (0, 0), (0, -1)]],
    ids=["a gap that is too wide", "another layer", "a tail"],
)
def test_what_makes_no_single_outline_is_refused_as_open(last: list[tuple[float, float]]) -> None:
    document, space = new()
    for first, second in ((0, 1), (1, 2), (2, 3)):
        space.add_line(SQUARE[first], SQUARE[second], dxfattribs={"layer": "A"})
    for at in range(len(last) - 1):
        layer = "B" if last == [(0, 4), (0, 0)] else "A"
        space.add_line(last[at], last[at + 1], dxfattribs={"layer": layer})
    error = refusal(document)
    assert error.finding.code is MAP_FEATURE
    assert "LINE in layer `A` is open at" in str(error)
    assert "1 mm" in error.finding.help


# ---------------------------------------------------------------------- layers


def _layered() -> Any:
    document, space = new()
    document.layers.add("Walls")
    space.add_circle((1, 0), 0.1, dxfattribs={"layer": "Walls"})
    space.add_circle((2, 0), 0.1, dxfattribs={"layer": "WALLS"})
    space.add_circle((3, 0), 0.1, dxfattribs={"layer": "Racks"})
    block = document.blocks.new("rack")
    block.add_circle((4, 0), 0.1)
    block.add_circle((5, 0), 0.1, dxfattribs={"layer": "walls"})
    space.add_blockref("rack", (0, 0), dxfattribs={"layer": "RACKS"})
    return document


@pytest.mark.parametrize(("layer", "expected"), [("wAlls", [1, 2, 5]), ("racks", [3, 4]), ("WALLS", [1, 2, 5])])
def test_names_of_layers_ignore_case_need_no_entry_and_pass_into_blocks(layer: str, expected: list[int]) -> None:
    reading = read(_layered(), layers=(layer,))
    assert [feature.shape.centre[0] for feature in reading.features] == expected  # type: ignore[union-attr]
    assert reading.left_out == (LeftOut("CIRCLE", "on another layer", 5 - len(expected)),)


def test_a_layer_that_nothing_is_on_is_refused_with_those_there_are() -> None:
    error = refusal(_layered(), layers=("Doors",))
    assert error.finding.code is MAP_OPTION
    assert error.finding.help == "use one of the layers `0`, `Defpoints`, `RACKS`, `Walls`"


def test_a_layer_may_be_named_in_the_letters_of_an_older_code_page() -> None:
    document = ezdxf.new("R2000", units=6)
    document.encoding = "cp1252"
    document.modelspace().add_circle((0, 0), 1, dxfattribs={"layer": "WÄNDE"})
    content = text_of(document).encode("cp1252")
    declaration = asked("", layers=("Wände",))
    declaration.sources[0].__init__("floor.dxf", "", content)  # type: ignore[misc]
    assert len(drawing(declaration).features) == 1


# -------------------------------------------------------------------- left out


def test_everything_that_is_not_read_is_counted_by_kind_and_reason() -> None:
    document, space = new()
    document.layers.add("OFF").off()
    document.layers.add("FROZEN").freeze()
    space.add_circle((0, 0), 1)
    space.add_circle((0, 0), 1, dxfattribs={"layer": "OFF"})
    space.add_circle((0, 0), 1, dxfattribs={"invisible": 1})
    space.add_text("hall")
    space.add_point((1, 1))
    space.add_linear_dim((0, 2), (0, 0), (3, 0)).render()
    space.add_polyface()
    space.add_blockref("other", (0, 0)).dxf.layer = "FROZEN"
    document.blocks.new("other").add_circle((0, 0), 1)
    document.add_xref_def("walls.dxf", "walls")
    space.add_blockref("walls", (0, 0)).grid((1, 3), (1, 1))
    document.layout("Layout1").add_line((0, 0), (1, 1))
    reading = read(document)
    assert [feature.shape for feature in reading.features] == [Circle((0, 0), 1)]
    assert [(each.kind, each.reason, each.count) for each in reading.left_out] == [
        ("CIRCLE", "hidden", 3),
        ("DIMENSION", "not an area", 1),
        ("INSERT", "an external reference", 3),
        ("LINE", "in paper space", 1),
        ("POINT", "not an area", 1),
        ("POLYLINE", "without extent", 1),
        ("TEXT", "not an area", 1),
    ]


def test_a_hidden_layer_is_read_if_the_mission_names_it() -> None:
    document, space = new()
    document.layers.add("FROZEN").freeze()
    document.blocks.new("rack").add_circle((0, 0), 1)
    space.add_blockref("rack", (2, 2), dxfattribs={"layer": "FROZEN"})
    assert [feature.shape for feature in read(document, layers=("frozen",)).features] == [Circle((2, 2), 1)]


def test_an_entity_that_the_library_does_not_know_is_named() -> None:
    document, space = new()
    space.add_circle((0, 0), 1, dxfattribs={"layer": "0"})
    strange = text_of(document).replace("\nCIRCLE\n", "\nAEC_WALL\n")
    assert drawing(asked(strange)).left_out == (LeftOut("AEC_WALL", "unsupported kind", 1),)


# --------------------------------------------------------------------- refused


def _upright(space: Any) -> None:
    space.add_3dface([(0, 0, 0), (4, 0, 0), (4, 0, 3), (0, 0, 3)])


def _fin(space: Any) -> None:
    space.add_polyface().append_faces([[(*corner, 0) for corner in SQUARE], [(2, 2, 0), (9, 2, 0), (9, 2, 3)]])


def _standing_circle(space: Any) -> None:
    space.add_circle((0, 0), 1, dxfattribs={"extrusion": (1, 0, 0)})


def _lying_cylinder(space: Any) -> None:
    space.add_circle((0, 0), 1, dxfattribs={"extrusion": (0.6, 0, 0.8), "thickness": 5})


def _rounded_mesh(space: Any) -> None:
    _mesh(space)
    space.query("MESH").first.dxf.subdivision_levels = 2


def _no_number(space: Any) -> None:
    space.add_circle((0, 0), math.nan)


def _no_place(space: Any) -> None:
    space.add_circle((math.inf, 0), 1)


def _no_bulge(space: Any) -> None:
    space.add_lwpolyline([(0, 0, math.nan), (1, 0, 0)], format="xyb", close=True)


def _far_away(space: Any) -> None:
    space.add_lwpolyline([(0, 0), (1e12, 0), (1e12, 1e12)], close=True)


def _crossing(space: Any) -> None:
    space.add_lwpolyline([(0, 0), (4, 4), (4, 0), (0, 4)], close=True)


def _bad_spline(space: Any) -> None:
    spline = space.add_spline()
    spline.control_points, spline.knots = [(0, 0), (1, 0), (1, 1), (0, 1)], [0, 0, 0]


def _steep_spline(space: Any) -> None:
    space.add_spline().set_open_uniform([(at % 7, at % 5) for at in range(80)], degree=60)


def _unweighted(space: Any) -> None:
    space.add_spline().set_open_rational([(0, 0), (1, 0), (1, 1), (0, 1)], [1, 0, 1, 1])


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (_upright, "3DFACE in layer `0` has a vertical face"),
        (_fin, "has a vertical face"),
        (_standing_circle, "has no area seen from above"),
        (_lying_cylinder, "is extruded at an angle"),
        (_rounded_mesh, "MESH in layer `0` is smoothed"),
        (_no_number, "CIRCLE in layer `0` has a coordinate or size that is not a finite number"),
        (_no_place, "not a finite number"),
        (_no_bulge, "not a finite number"),
        (_far_away, "too far from the origin"),
        (_crossing, "LWPOLYLINE in layer `0` crosses itself"),
        (_bad_spline, "SPLINE in layer `0` cannot be read"),
        (_steep_spline, "has the degree 60; the limit is 10"),
        (_unweighted, "has a weight that is not positive"),
    ],
)
def test_an_entity_that_makes_no_area_is_refused_by_its_kind_and_layer(
    draw: Callable[[Any], None], words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    document, space = new()
    draw(space)
    error = refusal(document)
    assert error.finding.code is MAP_FEATURE
    assert words in str(error)
    assert error.finding.help
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("header", "code", "words"),
    [
        (" 10\n6.0\n 20\n1.0\n", MAP_OPTION, "does not state the length of its unit"),
        (" 70\n0\n", MAP_OPTION, "does not state the length of its unit"),
        (" 70\n99\n", MAP_OPTION, "does not state the length of its unit"),
        ("  1\nmetres\n", MAP_OPTION, "does not state the length of its unit"),
        (" 70\nx\n", MAP_UNREADABLE, "damaged near line"),
    ],
)
def test_a_unit_that_is_none_is_asked_for(header: str, code: Code, words: str) -> None:
    text = text_of(new()[0]).replace("$INSUNITS\n 70\n6\n", f"$INSUNITS\n{header}")
    with pytest.raises(MapError, match=words) as raised:
        drawing(asked(text))
    assert raised.value.finding.code is code


def test_a_unit_that_the_mission_states_comes_before_the_drawing() -> None:
    document, space = new()
    space.add_circle((1000, 0), 500)
    text = text_of(document).replace("$INSUNITS\n 70\n6\n", "$INSUNITS\n 70\n99\n")
    assert [feature.shape for feature in drawing(asked(text, unit=1e-3)).features] == [Circle((1, 0), 0.5)]


@pytest.mark.parametrize(("number", "metres"), [(1, 0.0254), (13, 1e-6), (14, 0.1), (21, 1200 / 3937)])
def test_units_of_drawings_are_known(number: int, metres: float) -> None:
    document, space = new()
    space.add_circle((0, 0), 1 / metres)
    document.header["$INSUNITS"] = number
    (feature,) = read(document).features
    assert feature.shape.radius == pytest.approx(1, rel=1e-12)  # type: ignore[union-attr]


# --------------------------------------------------------------- before work


def test_blocks_without_anything_that_is_read_are_counted_and_not_taken_apart() -> None:
    document, space = new()
    document.blocks.new("B0").add_text("hall")
    for level in range(1, 40):
        block = document.blocks.new(f"B{level}")
        for _ in range(3):
            block.add_blockref(f"B{level - 1}", (0, 0))
    space.add_blockref("B39", (0, 0)).grid((30_000, 30_000), (1, 1))
    space.add_circle((0, 0), 1)
    reading = read(document)
    assert len(reading.features) == 1
    assert reading.left_out == (LeftOut("TEXT", "not an area", 30_000**2 * 3**39),)


def test_copies_of_blocks_are_multiplied_out_before_any_is_made() -> None:
    document, space = new()
    document.blocks.new("inner").add_circle((0, 0), 1)
    document.blocks.new("outer").add_blockref("inner", (0, 0)).grid((300, 300), (1, 1))
    space.add_blockref("outer", (0, 0)).grid((300, 300), (1, 1))
    error = refusal(document)
    assert error.finding.code is FILE_TOO_LARGE
    assert "8100000000 entities" in str(error)
    assert "map_features=8100000000" in error.finding.help


def test_more_copies_than_any_limit_allows_are_refused_without_a_flag() -> None:
    document, space = new()
    document.blocks.new("B0").add_circle((0, 0), 1)
    for level in range(1, 40):
        document.blocks.new(f"B{level}").add_blockref(f"B{level - 1}", (0, 0)).grid((30_000, 30_000), (1, 1))
    space.add_blockref("B39", (0, 0))
    error = refusal(document)
    assert "more than 1000000000000000 entities" in str(error)
    assert error.finding.help == "use a smaller file"


def test_chords_are_counted_before_any_is_made() -> None:
    document, space = new()
    document.blocks.new("disc").add_ellipse((0, 0), (1e5, 0), 0.5)
    space.add_blockref("disc", (0, 0)).grid((10, 10), (1, 1))
    error = refusal(document, limits=Limits(map_corners=1000))
    assert error.finding.code is FILE_TOO_LARGE
    count = int(str(error).split(" has ")[1].split()[0])
    assert count == 100 * math.ceil(math.tau * math.sqrt(1e5 / 8 / SAGITTA))
    assert f"map_corners={count}" in error.finding.help


def test_the_edges_of_a_hatch_and_the_points_of_a_spline_count_as_corners() -> None:
    document, space = new()
    space.add_lwpolyline([(at, at % 2) for at in range(600)], close=True)
    space.add_spline().set_open_uniform([(at, at % 2) for at in range(600)])
    space.add_hatch().paths.add_polyline_path([(at, at % 2) for at in range(600)])
    assert "corners (arcs as chords)" in str(refusal(document, limits=Limits(map_corners=1700)))


def test_the_lines_of_a_drawing_are_counted_before_it_is_read() -> None:
    error = refusal(new()[0], limits=Limits(map_lines=100))
    assert error.finding.code is FILE_TOO_LARGE
    assert "map_lines=" in error.finding.help


@pytest.mark.parametrize("depth", [1, 2, 300])
def test_blocks_that_contain_themselves_or_are_nested_too_deep_are_refused(depth: int) -> None:
    document, space = new()
    for level in range(depth):
        block = document.blocks.new(f"B{level}")
        if level:
            block.add_blockref(f"b{level - 1}", (0, 0))
    innermost = document.blocks.get("B0")
    if depth > 2:
        innermost.add_circle((0, 0), 1)
    else:
        innermost.add_blockref(f"B{depth - 1}", (0, 0))
    space.add_blockref(f"B{depth - 1}", (0, 0))
    error = refusal(document)
    assert error.finding.code is MAP_FEATURE
    assert ("contains itself" if depth < 3 else "nested more than 256 deep") in str(error)


def test_a_block_that_is_not_defined_is_refused() -> None:
    document, space = new()
    space.add_blockref("column", (0, 0))
    assert "the block `column` is not defined" in str(refusal(document))
