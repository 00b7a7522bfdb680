"""Random drawings, each with its area according to ezdxf after exploding the blocks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import reduce
from io import StringIO
from typing import Any

import ezdxf
import numpy as np
import shapely
from ezdxf import path
from ezdxf.disassemble import make_primitive, recursive_decompose
from ezdxf.layouts import BaseLayout
from ezdxf.math import Vec3
from shapely.affinity import affine_transform

from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.maps.feature import Area, Circle, MapPoint
from missionc.ir.places import FileRequest

ezdxf.options.write_fixed_meta_data_for_testing = True  # the same drawing always gives the same text

FINE = 1e-4
"""Maximum distance in metres of the referee's chords inside their arcs."""

DOWN, UP = (0, 0, -1), (0, 0, 1)


def asked(text: str, kind: str = "region", limits: Limits | None = None, **words: Any) -> FileRequest:
    """Declaration that takes places from the text of a drawing."""
    source = Source("floor.dxf", "", text.encode())
    return FileRequest(kind, (source,), Span(source, 0, 0), limits or Limits(), **words)


def text_of(document: Any) -> str:
    stream = StringIO()
    document.write(stream)
    return stream.getvalue()


def polygons_of(shape: Area | Circle | MapPoint) -> shapely.Geometry:
    """Area of a feature."""
    match shape:
        case Circle(centre, radius):
            return shapely.Point(centre).buffer(radius, quad_segs=256)
        case Area(polygons):
            return shapely.union_all([shapely.Polygon(outer, holes) for outer, *holes in polygons])
        case MapPoint():
            return shapely.Point()


def random_drawing(generator: np.random.Generator, kind: str = "", deepest: int = 3) -> str:
    """Text of a drawing in metres: one entity in rotated, mirrored, stretched and repeated blocks.

    Args:
        kind: one of ``ENTITIES``; any of them if it is empty.
    """
    document = ezdxf.new(units=6)
    draw = ENTITIES[kind or str(generator.choice(list(ENTITIES)))]
    uniform = draw is _wide
    layout: BaseLayout = document.modelspace()
    for depth in range(int(generator.integers(0, deepest + 1)), 0, -1):
        block = document.blocks.new(f"B{depth}", base_point=tuple(generator.uniform(-2, 2, 2)))
        scale = generator.choice([-1.5, -1, -0.5, 0.5, 1, 2], 2)
        insert = layout.add_blockref(f"B{depth}", tuple(generator.uniform(-20, 20, 2)))
        insert.dxf.rotation = float(generator.choice([0, 90, generator.uniform(0, 360)]))
        insert.dxf.xscale, insert.dxf.yscale = (scale[0], scale[0]) if uniform else scale
        insert.dxf.zscale = abs(insert.dxf.xscale)
        if not uniform:
            insert.dxf.extrusion = DOWN if generator.random() < 0.3 else UP
        if generator.random() < 0.3:
            insert.dxf.row_count, insert.dxf.column_count = (int(each) for each in generator.integers(1, 4, 2))
            insert.dxf.row_spacing, insert.dxf.column_spacing = generator.uniform(10, 30, 2)
        layout = block
    draw(layout, generator)
    return text_of(document)


def referee_area(text: str) -> shapely.Geometry:
    """Union of all closed outlines and faces, with blocks transformed by the matrix of their insertion.

    Insertions are followed level by level, since ``ezdxf`` turns a block within a stretched one wrongly.
    """
    document = ezdxf.read(StringIO(text))

    def area(layout: BaseLayout) -> shapely.Geometry:
        own = [entity for entity in layout if entity.dxftype() != "INSERT"]
        parts = [area_of_entities(own)]
        for insert in layout.query("INSERT"):
            inside = area(insert.block())
            for copy in insert.multi_insert() if insert.mcount > 1 else [insert]:
                rows = [row[:2] for row in copy.matrix44().rows()]
                (a, d), (b, e), _, (x, y) = rows
                parts.append(affine_transform(inside, (a, b, d, e, x, y)))
        return shapely.union_all(parts)

    return area(document.modelspace())


def exploded_area(text: str) -> shapely.Geometry:
    """Union of all closed outlines and faces, after ``ezdxf`` has exploded the blocks."""
    return area_of_entities(recursive_decompose(ezdxf.read(StringIO(text)).modelspace()))


def area_of_entities(entities: Iterable[Any]) -> shapely.Geometry:
    parts, loose = [], []
    for entity in entities:
        mesh = make_primitive(entity).mesh
        if mesh is not None:
            parts += [_polygon(face) for face in mesh.faces_as_vertices()]
        elif entity.dxftype() == "HATCH":
            rings = [_polygon(each.flattening(FINE, 16)) for each in path.from_hatch(entity)]
            parts.append(reduce(shapely.symmetric_difference, rings))
        else:
            line = path.make_path(entity, segments=64)
            corners = list(line.flattening(FINE, 16))
            if line.is_closed:
                parts.append(_polygon(corners))
            else:
                loose.append(shapely.LineString([(p.x, p.y) for p in corners]))
    rings = shapely.polygonize([shapely.set_precision(line, 1e-7) for line in loose])
    return shapely.union_all([*parts, *rings.geoms])


def _polygon(points: Any) -> shapely.Geometry:
    corners = [(point.x, point.y) for point in points]
    distinct = [
        each for each, before in zip(corners, corners[-1:] + corners, strict=False) if math.dist(each, before) > 1e-9
    ]
    return shapely.Polygon(distinct) if len(distinct) > 2 else shapely.Polygon()


# ------------------------------------------------------------------- entities


def _up_or_down(generator: np.random.Generator) -> dict[str, object]:
    return {"extrusion": DOWN if generator.random() < 0.4 else UP}


def _tilted(generator: np.random.Generator) -> dict[str, object]:
    """Extrusion at an angle of at most 60 degrees to the vertical, in half of all cases."""
    if generator.random() < 0.5:
        return _up_or_down(generator)
    angle, turn = generator.uniform(0.01, 1.0), generator.uniform(0, math.tau)
    return {"extrusion": (math.sin(angle) * math.cos(turn), math.sin(angle) * math.sin(turn), math.cos(angle))}


def _star(generator: np.random.Generator, corners: int) -> list[tuple[float, float]]:
    """Corners of an outline that does not cross itself, counter-clockwise."""
    angles = (np.arange(corners) + generator.uniform(0.3, 0.7, corners)) * math.tau / corners
    radii, (x, y) = generator.uniform(3, 5, corners), generator.uniform(-5, 5, 2)
    return [(x + r * math.cos(a), y + r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]


def _circle(layout: BaseLayout, generator: np.random.Generator) -> None:
    centre = tuple(generator.uniform(-5, 5, 3))
    layout.add_circle(centre, generator.uniform(0.5, 4), dxfattribs=_tilted(generator))


def _ellipse(layout: BaseLayout, generator: np.random.Generator) -> None:
    major = (*generator.uniform(1, 4, 2), 0)
    layout.add_ellipse(tuple(generator.uniform(-5, 5, 2)), major, generator.uniform(0.2, 1))


def _polyline(layout: BaseLayout, generator: np.random.Generator) -> None:
    bulges = generator.choice([0, 0, 0.2, -0.1], 6)
    vertices = [(x, y, bulge) for (x, y), bulge in zip(_star(generator, 6), bulges, strict=True)]
    add = layout.add_lwpolyline if generator.random() < 0.5 else layout.add_polyline2d
    add(vertices, format="xyb", close=True, dxfattribs=_up_or_down(generator))


def _spline(layout: BaseLayout, generator: np.random.Generator) -> None:
    points = [Vec3(each) for each in _star(generator, 7)]
    spline = layout.add_spline()
    if generator.random() < 0.5:
        weights = list(generator.uniform(0.5, 2, 7))
        spline.set_open_rational([*points, points[0]], [*weights, weights[0]], degree=int(generator.integers(2, 5)))
    else:
        spline.set_open_uniform([*points, points[0]], degree=int(generator.integers(2, 5)))


def _lines(layout: BaseLayout, generator: np.random.Generator) -> None:
    corners = _star(generator, 5)
    ends = [*zip(corners, corners[1:] + corners[:1], strict=True)]
    for at in generator.permutation(5):
        layout.add_line(*ends[at][:: int(generator.choice([-1, 1]))])


def _quadrilateral(layout: BaseLayout, generator: np.random.Generator) -> None:
    first, second, third, fourth = ((x, y, float(generator.uniform(-1, 1))) for x, y in _convex(generator))
    if generator.random() < 0.5:
        layout.add_3dface([first, second, third, fourth])
    else:
        add = layout.add_solid if generator.random() < 0.5 else layout.add_trace
        flat = [(x, y, 1.0) for x, y, _ in (first, second, fourth, third)]
        add(flat, dxfattribs=_up_or_down(generator))


def _convex(generator: np.random.Generator) -> list[tuple[float, float]]:
    angles = (np.arange(4) + generator.uniform(0.2, 0.8, 4)) * math.tau / 4
    return [(4 * math.cos(angle), 4 * math.sin(angle)) for angle in angles]


def _mesh(layout: BaseLayout, generator: np.random.Generator) -> None:
    low = [(x, y, 0.0) for x, y in _convex(generator)]
    corners = [*low, *((x, y, 2.0) for x, y, _ in low)]
    faces = [(0, 1, 2, 3), (4, 5, 6, 7), *((at, (at + 1) % 4, 4 + (at + 1) % 4, 4 + at) for at in range(4))]
    if generator.random() < 0.5:
        with layout.add_mesh().edit_data() as data:
            data.vertices, data.faces = [*map(Vec3, corners)], faces
    else:
        layout.add_polyface().append_faces([[corners[at] for at in face] for face in faces])


def _hatch(layout: BaseLayout, generator: np.random.Generator) -> None:
    hatch = layout.add_hatch(dxfattribs=_up_or_down(generator))
    hatch.paths.add_polyline_path([(x, y, generator.choice([0, 0.2])) for x, y in _star(generator, 5)])
    edges = hatch.paths.add_edge_path()
    x, y = generator.uniform(-2, 2, 2)
    if generator.random() < 0.5:
        edges.add_arc((x, y), 1.5, 0, 180)
        edges.add_line((x - 1.5, y), (x + 1.5, y))
    else:
        edges.add_ellipse((x, y), (1.5, 0.5), 0.5, 0, 360)


def _wide(layout: BaseLayout, generator: np.random.Generator) -> None:
    """Add corners of at most 60 degrees, at which ezdxf fills the outer wedge as in drawings."""
    headings = np.cumsum(generator.uniform(-1, 1, 4))
    places = np.cumsum(3 * np.stack([np.cos(headings), np.sin(headings)], axis=1), axis=0)
    widths = generator.uniform(0.2, 1, 5) if generator.random() < 0.5 else np.repeat(generator.uniform(0.2, 1), 5)
    vertices = [(x, y, first, last) for (x, y), first, last in zip(places, widths, widths[1:], strict=False)]
    layout.add_lwpolyline(vertices, format="xyse", dxfattribs=_up_or_down(generator))


ENTITIES: dict[str, Callable[[BaseLayout, np.random.Generator], None]] = {
    "circle": _circle,
    "ellipse": _ellipse,
    "hatch": _hatch,
    "lines": _lines,
    "mesh": _mesh,
    "polyline": _polyline,
    "quadrilateral": _quadrilateral,
    "spline": _spline,
    "wide": _wide,
}
"""Entities of the innermost block, by name."""
