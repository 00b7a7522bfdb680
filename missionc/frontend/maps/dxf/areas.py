"""Areas of drawn shapes, seen from above, in metres, and outlines of lines whose ends meet.

    in   a shape, its position, the mission's metres
    out  an area or a disc, and the lines that do not close

Closed lines are filled, up to the outer edge of their width. Faces are united. A hatch is filled by its style.

Lines whose ends meet are joined to rings. A ring runs only through points at which exactly two ends meet: if more meet,
the pairs that belong together are unknown.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.frontend.maps.dxf.blocks import Placed
from missionc.frontend.maps.dxf.shapes import Arc, Band, Curve, Points, Shape, UnusableError
from missionc.frontend.maps.feature import Area, Circle, Corners

SAME = 1e-6
"""Tolerance in metres up to which two ends count as equal."""


class Ring(Record):
    """Closed outline of joined lines: indices of the lines in order, corners (points, 2) in metres, and the largest
    gap.
    """

    lines: tuple[int, ...]
    corners: Points
    gap: float


def join_ends(lines: Sequence[Points], tolerance: float) -> tuple[list[Ring], list[int]]:
    """Rings of lines whose ends meet, in the order of the first line of each, and the indices of the other lines.

    Args:
        lines: (points, 2) each, metres, at least one point.
        tolerance: maximum distance of two ends that meet, metres.
    """
    if len(lines) == 1 and np.hypot(*(lines[0][0] - lines[0][-1])) <= SAME:
        return [_ring(lines, [(0, 0)])], []
    nodes = _nodes(np.array([end for line in lines for end in (line[0], line[-1])]), tolerance).reshape(-1, 2)
    leaving: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for number, ends in enumerate(nodes.tolist()):
        for side, node in enumerate(ends):
            leaving[node].append((number, side))
    rings, used = [], set[int]()
    # Start from points with more or fewer than two ends: a ring may touch another there. The others are rings through
    # pairs.
    for start in sorted(leaving, key=lambda node: len(leaving[node]) == 2):
        for first in leaving[start]:
            if first[0] in used:
                continue
            chain, node = [first], int(nodes[first[0], 1 - first[1]])
            while node != start and len(leaving[node]) == 2:
                one, other = leaving[node]
                arrived = chain[-1][0], 1 - chain[-1][1]
                chain.append(other if one == arrived else one)
                node = int(nodes[chain[-1][0], 1 - chain[-1][1]])
            used.update(number for number, _ in chain)
            if node == start:
                rings.append(_ring(lines, chain))
    rings.sort(key=lambda ring: min(ring.lines))
    joined = {number for ring in rings for number in ring.lines}
    return rings, [number for number in range(len(lines)) if number not in joined]


def _nodes(ends: Points, tolerance: float) -> NDArray[np.intp]:
    """Index of the node at each end, (ends,); equal ends, or mutually nearest ones, share a node.

    Args:
        ends: (ends, 2), metres.
        tolerance: maximum distance of two ends that meet, metres.
    """
    _, nodes, counts = np.unique(np.round(ends / SAME), axis=0, return_inverse=True, return_counts=True)
    nodes = nodes.reshape(-1)
    (alone,) = np.nonzero(counts[nodes] == 1)
    points, nearest = shapely.points(ends[alone]), np.arange(len(alone))
    one, other = shapely.STRtree(points).query_nearest(
        points, max_distance=tolerance, exclusive=True, all_matches=False
    )
    nearest[one] = other
    mutual = nearest[nearest] == np.arange(len(alone))
    nodes[alone[mutual]] = np.minimum(nodes[alone], nodes[alone[nearest]])[mutual]
    return nodes


def _ring(lines: Sequence[Points], chain: list[tuple[int, int]]) -> Ring:
    pieces = [lines[number][:: -1 if side else 1] for number, side in chain]
    gaps = [np.hypot(*(piece[0] - pieces[at - 1][-1])) for at, piece in enumerate(pieces)]
    corners = np.concatenate([piece[1:] for piece in pieces])
    return Ring(tuple(number for number, _ in chain), corners, float(max(gaps)))


SAGITTA = 0.01
"""Maximum distance in metres between a chord and its arc."""

GAP = 0.001
"""Maximum distance in metres between two ends that meet."""

ROUND = 1e-9
"""Tolerance in metres for two equal points, and relative to the radius for the distortion of a circle."""

THIN = 1e-12
"""Area below which an outline counts as empty, relative to the square of its length."""

OUTERMOST, NO_ISLANDS = 1, 2
"""Numbers of hatch styles; every other style fills the points within an odd number of boundaries."""


class DrawingFrame(Record):
    """Conversion of a drawing's coordinates to metres: unit of the drawing, origin, and maximum distance from the
    origin.
    """

    unit: float
    origin: tuple[float, float]
    farthest: float

    def metres(self, points: Points) -> Points:
        """Points of the drawing, (…, 2), converted to metres, (…, 2).

        Raises:
            UnusableError: a point is not finite, or too far away.
        """
        placed: Points = self.origin + self.unit * points
        if not np.isfinite(placed).all():
            raise UnusableError("has a coordinate that is not a finite number")
        far = placed[(np.abs(placed) > self.farthest).any(axis=-1)]
        if len(far):
            raise UnusableError(f"has a point at {far[0, 0]:g}, {far[0, 1]:g} m, too far from the origin")
        return placed

    def tolerance(self, placed: Placed) -> float:
        """Tolerance of a chord, in the units of the block that contains the curve.

        Raises:
            UnusableError: the size of the block is not finite.
        """
        axes = placed.matrix[:3, :2]
        if not np.isfinite(axes).all():
            raise UnusableError("is in a block whose size is not a finite number")
        return SAGITTA / max(self.unit * float(np.linalg.norm(axes, 2)), np.finfo(float).tiny)


def disc_of(placed: Placed, shape: Shape, world: DrawingFrame) -> Circle | None:
    """Disc of a circle entity; None for another entity, or if the transformation makes the circle an ellipse."""
    arc = shape.lines[0][0] if placed.entity.dxftype() == "CIRCLE" else None
    if not isinstance(arc, Arc):
        return None
    across, up = world.unit * placed.seen(np.stack([arc.across, arc.up]), vectors=True)
    radius = float(np.hypot(*across))
    distortion = max(abs(radius - float(np.hypot(*up))), abs(float(across @ up)) / radius) if radius else 0.0
    if not 0 < radius <= world.farthest or distortion > ROUND * radius:
        return None
    x, y = world.metres(placed.seen(arc.centre)[None])[0]
    return Circle((float(x), float(y)), radius)


def area_of(placed: Placed, shape: Shape, world: DrawingFrame, *, grown: bool) -> tuple[Area | None, list[Points]]:
    """Area of an entity's shape, and its open lines, (points, 2) each, metres.

    Args:
        grown: if true, grow the area by the distance of chords inside their arcs.

    Raises:
        UnusableError: the shape crosses itself, has no area seen from above, or contains a value that is not a number.
    """
    tolerance = world.tolerance(placed)

    def seen(points: Points) -> Points:
        return world.metres(placed.seen(points))

    if shape.extrusion is not None and np.hypot(*placed.seen(shape.extrusion, vectors=True)) * world.unit > GAP:
        raise UnusableError("is extruded at an angle to the vertical")
    lines = [seen(_end_to_end(line, tolerance)) for line in shape.lines]
    closed = [line for line in lines if shape.closed or np.hypot(*(line[0] - line[-1])) <= GAP]
    loose = [] if len(closed) == len(lines) or shape.bands else lines
    parts = [outline(line) for line in closed if not (shape.bands and len(line) < 3)]
    parts += _hulls([seen(quadrilateral) for band in shape.bands for quadrilateral in _split(band, tolerance)])
    parts += _hatched([[seen(_end_to_end(line, tolerance)) for line in each] for each in shape.boundaries], shape.style)
    parts += _faces([seen(face) for face in shape.faces], upright=bool(shape.bands))
    if not parts:
        return None, loose
    return area_from(parts, SAGITTA if grown and shape.curved else 0.0), loose


def area_from(parts: Sequence[shapely.Geometry], growth: float) -> Area:
    """Union of parts, grown by ``growth`` metres.

    Raises:
        UnusableError: the union has no area.
    """
    union = parts[0] if len(parts) == 1 else shapely.simplify(shapely.union_all(parts), 0.0)
    if growth:
        union = shapely.buffer(union, growth, join_style="mitre")
    polygons = [part for part in shapely.get_parts(union) if part.geom_type == "Polygon" and part.area > 0]
    if not polygons:
        raise UnusableError("has no area seen from above")
    return Area(tuple(tuple(map(_corners, (each.exterior, *each.interiors))) for each in polygons))


def outline(ring: Points) -> shapely.Polygon:
    """Polygon of a ring, (points, 2), metres.

    Raises:
        UnusableError: the ring crosses itself, or has no area.
    """
    ring = ring[: len(ring) - int(np.hypot(*(ring[0] - ring[-1])) <= ROUND)]
    polygon = shapely.Polygon(ring) if len(ring) > 2 else shapely.Polygon()
    valid = shapely.is_valid(polygon)
    if _is_thin(polygon if valid else shapely.make_valid(polygon)):
        raise UnusableError("has no area seen from above")
    if not valid:
        raise UnusableError("crosses itself")
    return polygon


def _is_thin(polygon: shapely.Geometry) -> bool:
    return bool(polygon.area <= THIN * polygon.length**2)


def _corners(ring: shapely.LinearRing) -> Corners:
    return tuple((float(x), float(y)) for x, y in ring.coords[:-1])


def _end_to_end(curves: Sequence[Curve], tolerance: float) -> Points:
    first, *rest = (curve.points(tolerance) for curve in curves)
    return np.concatenate([first, *(points[1:] for points in rest)])


def _split(band: Band, tolerance: float) -> Points:
    """Corners of the quadrilaterals between the two edges of a wide segment, (quadrilaterals, 4, 3)."""
    count = max(edge.chords(tolerance) for edge in band)
    left, right = (edge.split(count) for edge in band)
    return np.stack([left[:-1], left[1:], right[1:], right[:-1]], axis=1)


def _hulls(pieces: Sequence[Points]) -> list[shapely.Geometry]:
    return [hull for hull in map(shapely.convex_hull, map(shapely.MultiPoint, pieces)) if hull.geom_type == "Polygon"]


def _faces(faces: Sequence[Points], *, upright: bool) -> list[shapely.Geometry]:
    """Polygons of faces, (points, 3) each, seen from above.

    A vertical face has no area, and must lie on the border of the others.

    Raises:
        UnusableError: a vertical face lies elsewhere, unless ``upright`` allows it.
    """
    polygons = [shapely.Polygon(face) for face in faces if len(face) > 2]
    polygons = [each if shapely.is_valid(each) else shapely.convex_hull(each) for each in polygons]
    parts = [each for each in polygons if not _is_thin(each)]
    standing = [each for each in polygons if _is_thin(each)]
    border = shapely.buffer(shapely.union_all(parts), GAP)
    shapely.prepare(border)
    if not upright and not all(shapely.covers(border, standing)):
        raise UnusableError("has a vertical face")
    return parts


def _hatched(boundaries: Iterable[Sequence[Points]], style: int) -> list[shapely.Geometry]:
    """Filled polygons of a hatch, from its boundary curves, (points, 2) each.

    Raises:
        UnusableError: a boundary is open.
    """
    polygons = []
    for curves in boundaries:
        rings, rest = join_ends(curves, GAP)
        if rest:
            raise UnusableError("has a boundary that is open")
        polygons += [outline(ring.corners) for ring in rings]
    if style == NO_ISLANDS:
        return polygons
    if style == OUTERMOST:
        inner, _ = shapely.STRtree(polygons).query(polygons, predicate="covered_by")
        polygons = [each for each, depth in zip(polygons, np.bincount(inner), strict=True) if depth <= 2]
    while len(polygons) > 1:  # in pairs, so that a hatch with many islands stays fast
        odd = polygons[len(polygons) // 2 * 2 :]
        polygons = [*shapely.symmetric_difference(polygons[:-1:2], polygons[1::2]), *odd]
    return polygons
