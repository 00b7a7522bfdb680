"""Shapes of a drawing: lines, curves, wide segments and faces of one entity, in its block's coordinates.

Coordinates of an entity with an extrusion vector become those of its block: the entity's axes follow from the vector.

Elliptical arcs and splines become chords within a tolerance. The number of chords follows from the second derivative
``P''``: over a parameter step ``h``, a chord is no further from its curve than ``h² max‖P''‖ / 8``. So chords are
counted before any is computed.

Source:
    Autodesk, "DXF Reference": "Object Coordinate Systems", and the group codes of each entity.
    Zheng and Sederberg, "Estimating tessellation parameter intervals for rational curves and surfaces" (2000).
    Piegl and Tiller, "The NURBS Book", 3.3, for the control points of a derivative.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record

Points: TypeAlias = NDArray[np.float64]
"""Array of points, (points, 3), or (points, 2) if seen from above."""

WIDEST = math.pi / 4
"""Maximum angle of a chord in an arc, radians, for any tolerance."""


class UnusableError(Exception):
    """Error: a part of a drawing gives no area.

    Args:
        reason: text that follows the name of the part.
        way_out: one action that helps.
    """

    def __init__(self, reason: str, way_out: str = "correct this entity in the drawing") -> None:
        super().__init__(reason)
        self.way_out = way_out


class Straight(Record):
    """Polyline: straight segments from point to point."""

    corners: Points

    def chords(self, tolerance: float) -> int:
        return len(self.corners) - 1

    def points(self, tolerance: float) -> Points:
        """Corners of the polyline, (points, 3); the tolerance has no effect."""
        return self.corners

    def split(self, count: int) -> Points:
        """Corners of the polyline, (points, 3); the count has no effect."""
        return self.corners


class Arc(Record):
    """Elliptical arc ``centre + growth (across cos angle + up sin angle)``.

    Args:
        sweep: radians from ``start`` to the end, negative if the arc is clockwise.
        growth: factor of the radius at the start and at the end, linear between; differs from 1 on the edges of a wide
            arc.
    """

    centre: Points
    across: Points
    up: Points
    start: float
    sweep: float
    growth: tuple[float, float] = (1.0, 1.0)

    def chords(self, tolerance: float) -> int:
        radius = max(float(np.linalg.norm(self.across)), float(np.linalg.norm(self.up)))
        first, last = self.growth
        bend = radius * (max(abs(first), abs(last)) * self.sweep**2 + 2 * abs(last - first) * abs(self.sweep))
        return max(_whole(math.sqrt(bend / (8 * tolerance))), _whole(abs(self.sweep) / WIDEST), 1)

    def points(self, tolerance: float) -> Points:
        """Ends of chords that approximate the arc within a tolerance, (points, 3)."""
        return self.split(self.chords(tolerance))

    def split(self, count: int) -> Points:
        """Ends of ``count`` chords of the arc with equal angles, (count + 1, 3)."""
        share = np.linspace(0.0, 1.0, count + 1)[:, None]
        angle = self.start + self.sweep * share
        growth = self.growth[0] + (self.growth[1] - self.growth[0]) * share
        return self.centre + growth * (self.across * np.cos(angle) + self.up * np.sin(angle))


class Spline:
    """B-spline curve of ``ezdxf``, polynomial or rational.

    Raises:
        UnusableError: a weight is not positive.
    """

    def __init__(self, spline: Any) -> None:
        self._spline, degree, knots = spline, spline.degree, np.array(spline.knots(), dtype=float)
        points = np.array([point.xyz for point in spline.control_points])
        weights = np.array(spline.weights() or np.ones(len(points)), dtype=float)[:, None]
        if not weights.min() > 0:
            raise UnusableError("has a weight that is not positive")
        points = points - points.mean(axis=0)
        reach = float(np.linalg.norm(points, axis=1).max())
        bend = _second_derivative(points * weights, knots, degree) + reach * _second_derivative(weights, knots, degree)
        self._bend = bend / float(weights.min())
        self._breaks = np.unique(knots[degree : len(points) + 1])

    def chords(self, tolerance: float) -> int:
        return sum(self._counts(tolerance))

    def points(self, tolerance: float) -> Points:
        """Ends of chords that approximate the spline within a tolerance, (points, 3)."""
        spans = zip(self._breaks[:-1], self._breaks[1:], self._counts(tolerance), strict=True)
        steps = [np.linspace(low, high, count, endpoint=False) for low, high, count in spans]
        return np.array([point.xyz for point in self._spline.points([*np.concatenate(steps), self._breaks[-1]])])

    def _counts(self, tolerance: float) -> list[int]:
        density = math.sqrt(self._bend / (8 * tolerance))
        return [max(_whole(float(span) * density), 1) for span in np.diff(self._breaks)]


Curve: TypeAlias = Straight | Arc | Spline


def _second_derivative(points: NDArray[np.float64], knots: NDArray[np.float64], degree: int) -> float:
    """Upper bound on the norm of a B-spline's second derivative, which may jump at knots.

    Args:
        points: control points, (points, coordinates).
        knots: (points + degree + 1,).
    """
    for order in (degree, degree - 1):
        gaps = (knots[order + 1 : order + len(points)] - knots[1 : len(points)])[:, None]
        points = np.divide(
            order * np.diff(points, axis=0), gaps, out=np.zeros((len(gaps), points.shape[1])), where=gaps > 0
        )
        knots = knots[1:-1]
    return float(np.linalg.norm(points, axis=1).max(initial=0.0))


def _whole(value: float) -> int:
    """The value rounded up to an integer.

    Raises:
        UnusableError: the value is not finite.
    """
    if not math.isfinite(value):
        raise UnusableError("has a coordinate or size that is not a finite number")
    return math.ceil(value)


Edge: TypeAlias = Straight | Arc
Band: TypeAlias = tuple[Edge, Edge]
"""Two edges of a wide segment, with points at the same fractions of its length."""

MITRE = 5.0
"""Maximum reach of a corner of a wide line, in half widths; a sharper corner is cut off."""

HIGHEST_DEGREE = 10
"""Maximum degree of a spline that ``ezdxf`` can evaluate."""

FRAME_POINT, SMOOTHED, ROUND_START, ROUND_END = 16, 4, 64, 1024
"""DXF flags of an invisible vertex, of a smoothed mesh, and of the half discs at the ends of a multiline."""


@dataclasses.dataclass(frozen=True)
class Shape:
    """Geometry of one drawing entity: its lines, wide segments, hatch boundaries and faces.

    Args:
        lines: sequences of curves end to end, filled if the ends meet or it is ``closed``.
        boundaries: boundaries of a hatch: sets of such sequences in any order whose ends meet.
        faces: corners of flat faces, (points, 3) each.
        style: style of a hatch, as in group code 75.
        extrusion: vector of the extrusion.
    """

    lines: Sequence[Sequence[Curve]] = ()
    closed: bool = False
    bands: Sequence[Band] = ()
    boundaries: Sequence[Sequence[Sequence[Curve]]] = ()
    faces: Sequence[Points] = ()
    style: int = 0
    extrusion: Points | None = None

    def curves(self) -> Iterator[Curve]:
        for group in (*self.lines, *self.bands, *(line for lines in self.boundaries for line in lines)):
            yield from group

    @cached_property
    def curved(self) -> bool:
        return not all(isinstance(curve, Straight) for curve in self.curves())

    @cached_property
    def empty(self) -> bool:
        """True if the entity draws nothing, or only points that all coincide."""
        straight = [curve.corners for curve in self.curves() if isinstance(curve, Straight)]
        return not (self.faces or self.curved or any((each != each[:1]).any() for each in straight))

    def corners(self, tolerance: float) -> int:
        """Number of corners of the shape if all chords are within the tolerance."""
        bands = 2 * sum(max(edge.chords(tolerance) for edge in band) for band in self.bands)
        return bands + sum(curve.chords(tolerance) for curve in self.curves()) + sum(map(len, self.faces))


def shape_of(entity: Any) -> Shape:
    """Geometry of an entity of one of the kinds in ``READ``.

    Raises:
        UnusableError: the entity gives no area.
    """
    try:
        shape = READ[entity.dxftype()](entity)
        thickness = float(entity.dxf.thickness) if entity.dxf.hasattr("thickness") else 0.0
        return replace(shape, extrusion=thickness * _Frame(entity).up) if thickness else shape
    except UnusableError:
        raise
    except Exception:  # the library fails in many ways on malformed files
        raise UnusableError("cannot be read") from None


class _Frame:
    """Axes of an entity's own coordinate system, in the coordinates of its block.

    Args:
        elevation: elevation of points with two coordinates.
    """

    def __init__(self, entity: Any, elevation: float = 0.0) -> None:
        axes = entity.ocs()
        self.right, self.ahead, self.up = (np.array(axis.xyz) for axis in (axes.ux, axes.uy, axes.uz))
        self.elevation = elevation

    def lift(self, points: object, height: float | None = None) -> Points:
        """Points in coordinates of the block, (…, 3), from an entity's points, (…, 2), at its elevation or a given
        height.
        """
        flat = np.asarray(points, dtype=float)
        lifted: Points = flat[..., :1] * self.right + flat[..., 1:2] * self.ahead
        return lifted + (self.elevation if height is None else height) * self.up

    def arc(
        self, centre: Points, radius: float, start: float, sweep: float, growth: tuple[float, float] = (1.0, 1.0)
    ) -> Arc:
        return Arc(centre, radius * self.right, radius * self.ahead, start, sweep, growth)


def _vectors(points: Iterable[Any]) -> Points:
    return np.array([point.xyz for point in points], dtype=float).reshape(-1, 3)


def _line(entity: Any) -> Shape:
    return Shape([[Straight(_vectors((entity.dxf.start, entity.dxf.end)))]])


def _circle(entity: Any) -> Shape:
    return Shape([[_round(entity, 0.0, math.tau)]])


def _arc(entity: Any) -> Shape:
    start, end = math.radians(entity.dxf.start_angle), math.radians(entity.dxf.end_angle)
    return Shape([[_round(entity, start, _turn(start, end))]])


def _round(entity: Any, start: float, sweep: float) -> Arc:
    frame, centre = _Frame(entity), entity.dxf.center
    return frame.arc(frame.lift(centre.xyz[:2], centre.z), abs(entity.dxf.radius), start, sweep)


def _turn(start: float, end: float) -> float:
    """Counterclockwise angle from ``start`` to ``end``, radians; a full turn if they are equal."""
    return (end - start) % math.tau or math.tau


def _ellipse(entity: Any) -> Shape:
    ellipse = entity.construction_tool()
    centre, major, minor = _vectors((ellipse.center, ellipse.major_axis, ellipse.minor_axis))
    return Shape([[Arc(centre, major, minor, ellipse.start_param, _turn(ellipse.start_param, ellipse.end_param))]])


def _spline(entity: Any) -> Shape:
    _check_degree(entity.dxf.degree)
    return Shape([[Spline(entity.construction_tool())]], entity.closed)


def _check_degree(degree: int) -> None:
    if degree > HIGHEST_DEGREE:
        raise UnusableError(f"has the degree {degree}; the limit is {HIGHEST_DEGREE}")


def _quadrilateral(entity: Any) -> Shape:
    return Shape(faces=[_vectors(entity.wcs_vertices())])


def _mesh(entity: Any) -> Shape:
    if entity.dxf.get("subdivision_levels", 0):
        raise UnusableError("is smoothed")
    vertices = np.array([tuple(vertex) for vertex in entity.vertices], dtype=float).reshape(-1, 3)
    return Shape(faces=[vertices[list(face)] for face in entity.faces])


def _light_polyline(entity: Any) -> Shape:
    width = float(entity.dxf.get("const_width", 0.0))
    vertices = [(x, y, width or first, width or last, bulge) for x, y, first, last, bulge in entity.get_points()]
    return _wide_line(vertices, entity.closed, _Frame(entity, float(entity.dxf.get("elevation", 0.0))))


def _polyline(entity: Any) -> Shape:
    if entity.is_poly_face_mesh:
        return Shape(faces=[_vectors(face.points()) for face in entity.indexed_faces()[1]])
    if entity.is_polygon_mesh:
        return _polygon_mesh(entity)
    drawn = [vertex.dxf for vertex in entity.vertices if not vertex.dxf.get("flags", 0) & FRAME_POINT]
    if entity.is_3d_polyline:
        return Shape([[Straight(_vectors(vertex.location for vertex in drawn))]], entity.is_closed)
    first, last = (entity.dxf.get(f"default_{name}", 0.0) for name in ("start_width", "end_width"))
    vertices = [
        (*each.location.xyz[:2], each.get("start_width", first), each.get("end_width", last), each.get("bulge", 0.0))
        for each in drawn
    ]
    elevated = entity.dxf.hasattr("elevation") or not drawn
    elevation = entity.dxf.elevation if elevated else drawn[0].location
    return _wide_line(vertices, entity.is_closed, _Frame(entity, elevation.z))


def _polygon_mesh(entity: Any) -> Shape:
    if entity.dxf.flags & SMOOTHED:
        raise UnusableError("is smoothed")
    grid = _vectors(vertex.dxf.location for vertex in entity.vertices)
    grid = grid.reshape(entity.dxf.m_count, entity.dxf.n_count, 3)
    for axis, closed in enumerate((entity.is_m_closed, entity.is_n_closed)):
        grid = np.concatenate([grid, grid.take([0], axis)], axis) if closed else grid
    faces = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=2)
    return Shape(faces=list(faces.reshape(-1, 4, 3)))


def _multiline(entity: Any) -> Shape:
    """Area of a multiline: the strip between its outermost parallel lines, with round ends as discs."""
    offsets = [[line[0] for line in vertex.line_params if line] or [0.0] for vertex in entity.vertices]
    middle, mitres = (_vectors(getattr(v, of) for v in entity.vertices) for of in ("location", "miter_direction"))
    low, high = (middle + mitres * np.array([[outermost(each)] for each in offsets]) for outermost in (min, max))
    style = entity.style.dxf.flags if entity.style and not entity.is_closed else 0
    normal = np.array(entity.dxf.extrusion.normalize().xyz)
    ends = [at for at, flag in ((0, ROUND_START), (-1, ROUND_END)) if style & flag]
    halves = {at: (high[at] - low[at]) / 2 for at in ends}
    discs = [Arc(low[at] + half, half, np.cross(normal, half), 0.0, math.tau) for at, half in halves.items()]
    if entity.is_closed:
        middle, low, high = (np.concatenate([each, each[:1]]) for each in (middle, low, high))
    edges = ([Straight(np.stack(piece)) for piece in pairwise(each)] for each in (low, high))
    return Shape([[Straight(middle)], *([disc] for disc in discs)], bands=list(zip(*edges, strict=True)))


def _hatch(entity: Any) -> Shape:
    frame = _Frame(entity, float(entity.dxf.elevation.z))
    offset = entity.dxf.offset_vector if entity.dxftype() == "MPOLYGON" else (0.0, 0.0)
    boundaries: list[Sequence[Sequence[Curve]]] = []
    for path in entity.paths:
        if hasattr(path, "vertices"):
            vertices = [(x + offset[0], y + offset[1], 0.0, 0.0, bulge) for x, y, bulge in path.vertices]
            boundaries.append(_wide_line([*vertices, vertices[0]], False, frame).lines)
        else:
            boundaries.append([[_boundary_edge(edge, frame)] for edge in path.edges])
    return Shape(boundaries=boundaries, style=entity.dxf.get("hatch_style", 0))


def _boundary_edge(edge: Any, frame: _Frame) -> Curve:
    """Curve of a hatch boundary; the loader has already made clockwise curves counterclockwise."""
    match edge.EDGE_TYPE:
        case "LineEdge":
            return Straight(frame.lift([tuple(edge.start), tuple(edge.end)]))
        case "ArcEdge":
            start, end = math.radians(edge.start_angle), math.radians(edge.end_angle)
            return frame.arc(frame.lift(tuple(edge.center)), abs(edge.radius), start, _turn(start, end))
        case "EllipseEdge":
            x, y = edge.major_axis
            major, minor = frame.lift([(x, y), (-y * edge.ratio, x * edge.ratio)], 0.0)
            start, sweep = edge.start_param, _turn(edge.start_param, edge.end_param)
            return Arc(frame.lift(tuple(edge.center)), major, minor, start, sweep)
        case _:
            return _boundary_spline(edge, frame)


def _boundary_spline(edge: Any, frame: _Frame) -> Spline:
    from ezdxf.math import BSpline, fit_points_to_cad_cv

    _check_degree(edge.degree)
    if edge.control_points:
        points = frame.lift([tuple(point) for point in edge.control_points])
        return Spline(BSpline(points, edge.degree + 1, edge.knot_values or None, edge.weights or None))
    tangents = [tuple(each) for each in (edge.start_tangent, edge.end_tangent) if each is not None]
    lifted = frame.lift(tangents, 0.0) if len(tangents) == 2 else None
    return Spline(fit_points_to_cad_cv(frame.lift([tuple(point) for point in edge.fit_points]), lifted))


# ----------------------------------------------------------------- wide lines

Vertex: TypeAlias = tuple[float, float, float, float, float]
"""Vertex of a polyline: ``x, y``, the widths at the start and end of the next segment, and its bulge."""


def _wide_line(vertices: Sequence[Vertex], closed: bool, frame: _Frame) -> Shape:
    if not any(any(vertex[2:]) for vertex in vertices):
        return Shape([[Straight(frame.lift([vertex[:2] for vertex in vertices]))]], closed)
    following = pairwise([*vertices, vertices[0]] if closed else vertices)
    segments = [_Segment(first, last) for first, last in following if first[:2] != last[:2]]
    middle = [segment.edge(0, frame) for segment in segments]
    if not any(any(vertex[2:4]) for vertex in vertices):
        return Shape([middle], closed)
    bands = [(segment.edge(1, frame), segment.edge(-1, frame)) for segment in segments]
    joints = pairwise([*segments, segments[0]] if closed else segments)
    faces = [frame.lift(corner) for first, last in joints for corner in _mitre(first, last)]
    return Shape([middle], closed, bands, faces=faces)


class _Segment:
    """Segment of a wide line, straight or an arc; ``headings`` are its unit tangents at both ends."""

    def __init__(self, first: Vertex, last: Vertex) -> None:
        self.ends = np.array([first[:2], last[:2]], dtype=float)
        self.halves, self.sweep = (first[2] / 2, first[3] / 2), 4 * math.atan(first[4])
        chord = self.ends[1] - self.ends[0]
        length = float(np.hypot(*chord))
        self.headings = [_turned(chord / length, turn) for turn in (-self.sweep / 2, self.sweep / 2)]
        self.radius = length / 2 / abs(math.sin(self.sweep / 2)) if self.sweep else math.inf

    def edge(self, side: int, frame: _Frame) -> Edge:
        """Left (``side`` 1) or right (-1) edge of the segment, or its middle line (0)."""
        if not self.sweep:
            return Straight(frame.lift([self.corner(side, at) for at in (0, 1)]))
        inwards = math.copysign(1.0, self.sweep)
        outwards = -inwards * _turned(self.headings[0], math.pi / 2)
        centre, start = self.ends[0] - self.radius * outwards, math.atan2(outwards[1], outwards[0])
        first, last = (1 - side * inwards * half / self.radius for half in self.halves)
        return frame.arc(frame.lift(centre), self.radius, start, self.sweep, (first, last))

    def corner(self, side: int, at: int) -> Points:
        """End point of an edge, (2,), at the start (``at`` 0) or at the end (1) of the segment."""
        corner: Points = self.ends[at] + side * self.halves[at] * _turned(self.headings[at], math.pi / 2)
        return corner

    def slope(self, side: int, at: int) -> Points:
        """Tangent vector of an edge at one of its ends, (2,)."""
        return self.headings[at] if self.sweep else self.corner(side, 1) - self.corner(side, 0)


def _turned(vector: Points, angle: float) -> Points:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([cosine * vector[0] - sine * vector[1], sine * vector[0] + cosine * vector[1]])


def _cross(first: Points, last: Points) -> float:
    return float(first[0] * last[1] - first[1] * last[0])


def _mitre(first: _Segment, last: _Segment) -> Iterator[list[Points]]:
    """Yield the wedge on the outer side of a corner, up to the intersection of both edges, as points (2,)."""
    turn = _cross(first.headings[1], last.headings[0])
    if not turn or not (first.halves[1] or last.halves[0]):
        return
    side, middle = (-1 if turn > 0 else 1), last.ends[0]
    corners = first.corner(side, 1), last.corner(side, 0)
    slopes = first.slope(side, 1), last.slope(side, 0)
    across = _cross(*slopes)
    steps = [_cross(corners[1] - corners[0], slope) / across for slope in slopes[::-1]] if across else []
    reach = MITRE * max(first.halves[1], last.halves[0])
    tip = corners[0] + steps[0] * slopes[0] if steps and steps[0] > 0 > steps[1] else middle
    meets = tip is not middle and float(np.hypot(*(tip - middle))) <= reach
    yield [middle, corners[0], *([tip] if meets else []), corners[1]]


READ: dict[str, Callable[[Any], Shape]] = {
    "ARC": _arc,
    "CIRCLE": _circle,
    "ELLIPSE": _ellipse,
    **dict.fromkeys(("HATCH", "MPOLYGON"), _hatch),
    **dict.fromkeys(("SPLINE", "HELIX"), _spline),
    "LINE": _line,
    "LWPOLYLINE": _light_polyline,
    "MESH": _mesh,
    "MLINE": _multiline,
    "POLYLINE": _polyline,
    **dict.fromkeys(("SOLID", "TRACE", "3DFACE"), _quadrilateral),
}
"""Function that reads the geometry of an entity, for each supported kind of entity."""
