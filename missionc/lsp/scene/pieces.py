"""Editable pieces: simple shapes and points as written, with the numbers in the text that a drag of them edits.

in   shapes and places of the syntax tree
out  plain values for the page

A place in the text is counted as browsers count, in units of UTF-16.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias, assert_never

from missionc.base.source import Source, Span
from missionc.base.units import UNITS, Dimension
from missionc.resolve.resolve_places import Places
from missionc.syntax import ast

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
            return {"metres": metres, "fixed": "it stands in a file that this one includes"}
        match quantity:
            case (ast.Number() as digits) | ast.Negative(body=ast.Number() as digits):
                return self._written(metres, quantity.span, digits)
            case ast.Name(text=text):
                return {"metres": metres, "fixed": f"it is the parameter {text}"}
            case _:
                return {"metres": metres, "fixed": "it is worked out from other numbers"}

    def _written(self, metres: float, whole: Span, body: ast.Number) -> Json:
        dimension, factor = UNITS.get(body.unit or "m", (Dimension.NUMBER, 1.0))
        digits = _DIGITS.match(body.span.text)
        if dimension is not Dimension.LENGTH or digits is None:
            return {"metres": metres, "fixed": "its unit is of no length"}
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
