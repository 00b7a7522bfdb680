"""Resolution of the world and its points: metres, with the world's number of coordinates.

says MC205 MC512
"""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.source import Span
from missionc.base.units import Dimension
from missionc.frontend.resolve.context import REPORTED, Context
from missionc.frontend.resolve.resolve_quantities import excerpt, resolved_number
from missionc.frontend.syntax import ast

WORDS = {1: "one coordinate", 2: "two coordinates", 3: "three coordinates"}


def coordinates(context: Context, point: ast.Point) -> ir.Vector:
    """Coordinates of a point as written, in metres, whatever their number."""
    return tuple(resolved_number(context, item, Dimension.LENGTH, "the coordinate") for item in point.coordinates)


def resolve_point(context: Context, point: ast.Point) -> ir.Vector:
    """Position of a point in metres.

    All NaN if it does not have the world's number of coordinates, which is reported.
    """
    values = coordinates(context, point)
    if context.dimension in (0, len(values)):
        return values
    kind = "plane" if context.dimension == 2 else "volume"
    context.report(
        code.WRONG_DIMENSION,
        f"`{excerpt(point.span)}` has {counted_points(len(values))}; "
        f"the world is a {kind}, with {counted_points(context.dimension)}",
        point.span,
        help=f"write {counted_points(context.dimension)}",
    )
    return (REPORTED,) * context.dimension


def plane_point(context: Context, point: ast.Point, what: str, otherwise: str) -> tuple[float, float]:
    """Point with two coordinates, metres, in a mission of two or three dimensions.

    Another number of coordinates is reported.
    """
    match coordinates(context, point):
        case (x, y):
            return x, y
        case values:
            context.report(
                code.WRONG_DIMENSION,
                f"`{excerpt(point.span)}` has {counted_points(len(values))}; {what} has two",
                point.span,
                help=otherwise if context.dimension == 3 else "write two coordinates",
            )
            return REPORTED, REPORTED


def known(*points: ir.Vector) -> bool:
    """Return whether no coordinate of the points is NaN, the replacement for an invalid coordinate."""
    return not any(math.isnan(value) for point in points for value in point)


def counted_points(count: int) -> str:
    return WORDS.get(count, f"{count} coordinates")


def resolve_world(context: Context, world: ast.World) -> None:
    """Set the corners of the world; its number of coordinates stays 0 if they disagree, which is reported."""
    first, second = coordinates(context, world.low), coordinates(context, world.high)
    if len(first) not in (2, 3) or len(first) != len(second):
        wrong = world.low if len(first) not in (2, 3) else world.high
        context.report(
            code.WRONG_DIMENSION,
            f"the corners of the world have {counted_points(len(first))} and {counted_points(len(second))}",
            wrong.span,
            help="write the same number of coordinates for both corners",
        )
        return
    context.dimension = len(first)
    if not known(first, second):
        context.low = context.high = (REPORTED,) * len(first)
        return
    context.low = tuple(map(min, first, second))
    context.high = tuple(map(max, first, second))
    if any(low == high for low, high in zip(context.low, context.high, strict=True)):
        no_area(context, "the world", world.span)


def resolve_offset(context: Context, items: tuple[ast.Quantity, ...], span: Span) -> ir.Vector:
    """Offset in metres; in a volume, two coordinates leave the altitude unchanged."""
    values = tuple(resolved_number(context, item, Dimension.LENGTH, "the offset") for item in items)
    return as_many(context, padded(context, values), span)


def padded(context: Context, values: ir.Vector) -> ir.Vector:
    return (*values, 0.0) if context.dimension == 3 and len(values) == 2 else values


def as_many(context: Context, values: ir.Vector, span: Span) -> ir.Vector:
    """The values if they match the world's number of coordinates; otherwise NaN, which is reported."""
    if context.dimension in (0, len(values)):
        return values
    context.report(
        code.WRONG_DIMENSION,
        f"`{excerpt(span)}` has {counted_points(len(values))}; the world has {counted_points(context.dimension)}",
        span,
        help=f"write {counted_points(context.dimension)}",
    )
    return (REPORTED,) * context.dimension


# ------------------------------------------------------------------ messages


def no_area(context: Context, what: str, span: Span) -> None:
    noun = "volume" if context.dimension == 3 else "area"
    context.report(code.NO_AREA, f"{what} has no {noun}", span, help="make it larger")
