"""Scene: map of a text, complete or not, and its draggable pieces.

    in   a text and its readable declarations
    out  plain values for the page

Lengths are in metres. ``parts`` are filled outlines, as in the report; ``inner`` is a point inside for the name.
``pieces`` are simple shapes and points as written, with the spans in the text of the numbers that dragging edits. Spans
are in UTF-16 units, as in browsers.
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
from missionc.frontend.resolve.resolve_places import Places, resolve_places
from missionc.frontend.resolve.resolve_shapes import Simple, fault, known
from missionc.frontend.syntax import ast

Json: TypeAlias = dict[str, Any]

_DIGITS = re.compile(r"[0-9.]+(?:[eE][+-]?[0-9]+)?")


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Builder of draggable pieces from the shapes in one text; those from included files are drawn but not editable.

    Args:
        source: edited text.
        places: resolved regions, agents and world of the text.
    """

    source: Source
    places: Places

    def span(self, span: Span) -> list[int] | None:
        """Start and end of a span in UTF-16 units; None if it is in another file."""
        if span.source.name != self.source.name:
            return None
        return [self._units(span.start), self._units(span.end)]

    def shape(self, shape: ast.Shape) -> Iterator[Json]:
        """Yield the pieces of the simple shapes in a shape expression; named regions have pieces of their own."""
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
        """Yield the points of a team's agents; none for positions in a region or from a list."""
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
        """Yield one piece, seen from above; none if one of its numbers is unknown.

        Args:
            form: kind of shape.
            span: span of the shape in the text.
            points: corners, or the centre.
            radius: radius of a round shape.
        """
        corners = [[self._number(item) for item in point.coordinates[:2]] for point in points]
        around = None if radius is None else self._number(radius)
        numbers = [number for corner in corners for number in corner] + ([around] if around else [])
        if all(len(corner) == 2 for corner in corners) and all(math.isfinite(item["metres"]) for item in numbers):
            yield {"form": form, "span": self.span(span), "points": corners, "radius": around}

    def _number(self, quantity: ast.Quantity) -> Json:
        """Value of a number in metres with its text and span, or the reason why dragging cannot edit it."""
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
    """Map of a text and its draggable pieces; None if it has no valid world.

    Args:
        source: edited text.
        declarations: readable declarations.
        limits: maximum sizes of a mission.
    """
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
    """Yield the starts and finishes of a team's agents: bodies at points, or regions.

    Args:
        pieces: builder of pieces.
        places: resolved regions, agents and world of the text.
        team: declaration of the team.
    """
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
    """Offsets, (x, y) in metres, along the path of a moving obstacle; empty for a static or unknown one."""
    if isinstance(motion, ir.Still) or not known(*motion.offsets):
        return []
    return [list(offset[:2]) for offset in motion.offsets]


def _outline(world: ir.World, shape: ir.Shape) -> Json:
    """Filled outlines of a shape, with a point inside for its name; no outlines for an invalid shape."""
    from missionc.output.report.outlines import inner_point, solids  # with shapely, which loads slowly

    parts = solids(world, shape) if _sound(shape) else []
    return {"parts": parts, "inner": inner_point(world, parts)} if parts else {"parts": []}


def _sound(shape: ir.Shape) -> bool:
    """Return whether all numbers in a shape are known, and each of its parts has an area."""
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
