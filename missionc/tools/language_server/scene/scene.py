"""The scene: what the map shows of a text, complete or not, and the pieces that a drag edits.

    in   a text, and the declarations of it that can be read
    out  plain values for the page

Lengths are in metres. ``parts`` are outlines to be filled, as in the report, each with an inner point for the name,
``inner``. ``pieces`` are simple shapes and points as written, with the places in the text of the numbers that a drag
edits. Places are counted as browsers do, in units of UTF-16.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias, assert_never

from missionc import ir
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.base.units import UNITS, Dimension
from missionc.frontend.resolve.polygon_faults import Simple, fault
from missionc.frontend.resolve.resolve_places import Places, resolve_places
from missionc.frontend.resolve.resolve_points import known
from missionc.frontend.syntax import ast

Json: TypeAlias = dict[str, Any]

_DIGITS = re.compile(r"[0-9.]+(?:[eE][+-]?[0-9]+)?")


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Makes pieces of the shapes in one text; what stands in an included file can be drawn, and not edited."""

    source: Source
    places: Places

    def span(self, span: Span) -> list[int] | None:
        """Where the words begin and end, in UTF-16; nothing where they stand in another file."""
        if span.source.name != self.source.name:
            return None
        return [self._units(span.start), self._units(span.end)]

    def shape(self, shape: ast.Shape) -> Iterator[Json]:
        """Each simple shape that a shape is made of; of those that it names, nothing."""
        match shape:
            case ast.Name():
                return
            case ast.Combined():
                yield from self.shape(shape.left)
                yield from self.shape(shape.right)
            case ast.Box():
                yield from self._piece("box", shape.span, (shape.low, shape.high))
            case ast.Disc() | ast.Ball() | ast.Cylinder():
                yield from self._piece("disc", shape.span, (shape.centre,), shape.radius)
            case ast.Polygon():
                yield from self._piece("polygon", shape.span, shape.corners)
            case _:
                assert_never(shape)

    def point(self, point: ast.Point) -> Iterator[Json]:
        yield from self._piece("point", point.span, (point,))

    def world(self, world: ast.World) -> Iterator[Json]:
        yield from self._piece("box", world.span, (world.low, world.high))

    def team(self, places: ast.Places) -> Iterator[Json]:
        """The points that say where agents are; a region has pieces of its own, and a file is edited elsewhere."""
        match places:
            case ast.InRegion() | ast.AtListed():
                return
            case ast.AtPoints(points=points):
                for point in points:
                    yield from self.point(point)
            case ast.OnLine(first=first, last=last):
                yield from self._piece("line", places.span, (first, last))
            case ast.OnGrid(low=low, high=high):
                yield from self._piece("box", places.span, (low, high))
            case _:
                assert_never(places)

    def _piece(
        self, form: str, span: Span, points: Iterable[ast.Point], radius: ast.Quantity | None = None
    ) -> Iterator[Json]:
        """One piece, seen from above; none where a number in it cannot be known."""
        corners = [[self._number(item) for item in point.coordinates[:2]] for point in points]
        around = None if radius is None else self._number(radius)
        numbers = [number for corner in corners for number in corner] + ([around] if around else [])
        if all(len(corner) == 2 for corner in corners) and all(math.isfinite(item["metres"]) for item in numbers):
            yield {"form": form, "span": self.span(span), "points": corners, "radius": around}

    def _number(self, quantity: ast.Quantity) -> Json:
        """How much it is, and how it is written; or why it cannot be edited by a drag."""
        metres = self.places.metres(quantity)
        if quantity.span.source.name != self.source.name:
            return {"metres": metres, "fixed": "it is in an included file"}
        match quantity:
            case (ast.Number() as digits) | ast.Negative(body=ast.Number() as digits):
                return self._written(metres, quantity.span, digits)
            case ast.Name(text=text):
                return {"metres": metres, "fixed": f"its value is the parameter {text}"}
            case _:
                return {"metres": metres, "fixed": "its value is computed"}

    def _written(self, metres: float, whole: Span, body: ast.Number) -> Json:
        dimension, factor = UNITS.get(body.unit or "m", (Dimension.NUMBER, 1.0))
        digits = _DIGITS.match(body.span.text)
        if dimension is not Dimension.LENGTH or digits is None:
            return {"metres": metres, "fixed": "its unit is not a length"}
        end = body.span.start + len(digits[0])
        decimals = len(digits[0].partition(".")[2]) if "e" not in digits[0].lower() else 0
        return {
            "metres": metres,
            "span": self.span(Span(whole.source, whole.start, end)),
            "unit": factor,
            "decimals": decimals,
        }

    def _units(self, offset: int) -> int:
        text = self.source.text
        if text.isascii():
            return offset
        return len(text[:offset].encode("utf-16-le", "surrogatepass")) // 2


def scene(source: Source, declarations: Sequence[ast.Declaration], limits: Limits) -> Json | None:
    """What there is to draw; nothing where there is no world to draw it in."""
    places = resolve_places(source, declarations, limits)
    if places is None:
        return None
    pieces = Pieces(source, places)
    return {
        "dimension": places.world.dimension,
        "low": list(places.world.low[:2]),
        "high": list(places.world.high[:2]),
        "things": [thing for item in places.declarations for thing in _things(pieces, places, item)],
    }


def _things(pieces: Pieces, places: Places, item: ast.Declaration) -> Iterator[Json]:
    match item:
        case ast.World():
            yield _thing(pieces, "world", "the world", item.span, list(pieces.world(item)))
        case ast.Region(name=name, shape=shape) if name.text in places.regions:
            drawn = _outline(places.world, places.regions[name.text].shape)
            yield {**_thing(pieces, "region", name.text, item.span, list(pieces.shape(shape))), **drawn}
        case ast.Obstacle(name=name, shape=shape) if name.text in places.obstacles:
            obstacle = places.obstacles[name.text]
            drawn = _outline(places.world, obstacle.shape)
            way = _way(obstacle.motion)
            pieced = list(pieces.shape(shape))
            yield {**_thing(pieces, "obstacle", name.text, item.span, pieced), **drawn, "way": way}
        case ast.Beacon(name=name, position=position):
            yield _thing(pieces, "beacon", name.text, item.span, list(pieces.point(position)))
        case ast.Team():
            yield from _team(pieces, places, item)
        case _:
            return


def _team(pieces: Pieces, places: Places, team: ast.Team) -> Iterator[Json]:
    """Where the agents of a team start and end: their bodies at single points, or the region that they are in."""
    agents = [agent for agent in places.agents if agent.team == team.name.text]
    for item in team.items:
        if not isinstance(item, ast.Start | ast.Finish):
            continue
        kind = "start" if isinstance(item, ast.Start) else "finish"
        at = [agent.start if kind == "start" else agent.finish for agent in agents]
        points = [list(place.point[:2]) for place in at if place and place.point and known(place.point)]
        pieced = list(pieces.team(item.places))
        region = item.places.region.text if isinstance(item.places, ast.InRegion) else ""
        if pieced or points or region:
            radius = agents[0].radius if agents and known((agents[0].radius,)) else 0.0
            thing = _thing(pieces, kind, team.name.text, item.span, pieced)
            yield {**thing, "agents": points, "radius": radius, "region": region, "count": len(agents)}


def _thing(pieces: Pieces, kind: str, name: str, span: Span, pieced: list[Json]) -> Json:
    return {"kind": kind, "name": name, "span": pieces.span(span), "pieces": pieced}


def _way(motion: ir.Still | ir.Path) -> list[list[float]]:
    """The offsets that a moving obstacle passes; none of one that stays."""
    if isinstance(motion, ir.Still) or not known(*motion.offsets):
        return []
    return [list(offset[:2]) for offset in motion.offsets]


def _outline(world: ir.World, shape: ir.Shape) -> Json:
    """The shape in parts, and a point in it for its name; nothing where it is no shape yet, as a crossed polygon."""
    from missionc.output.report.outlines import inner_point, solids  # by shapely, which is long to load

    parts = solids(world, shape) if _sound(shape) else []
    return {"parts": parts, "inner": inner_point(world, parts)} if parts else {"parts": []}


def _sound(shape: ir.Shape) -> bool:
    """Whether all its numbers are known, and each part of it has an area."""
    left = [shape]
    while left:
        match left.pop():
            case ir.Box(low, high):
                sound = known(low, high) and all(a < b for a, b in zip(low, high, strict=True))
            case ir.Disc(centre, radius) | ir.Ball(centre, radius):
                sound = known(centre, (radius,)) and radius > 0
            case ir.Polygon(corners):
                sound = known(*corners) and isinstance(fault(corners), Simple)
            case ir.Union(one, other) | ir.Intersection(one, other) | ir.Difference(one, other):
                left += [one, other]
                sound = True
        if not sound:
            return False
    return True
