"""Resolution of shapes and of the motion of obstacles: metres, altitudes, offsets at times, and growth.

    says MC104 MC201 MC205 MC207 MC210 MC303 MC512

Shapes belong to regions and obstacles. A plane shape has its altitude range in a volume.

Validity of polygons: enough corners, positive area, no repeated corner, no intersecting sides.

Resolution of the world and its points: metres, with the world's number of coordinates.

says MC205 MC512
"""

from __future__ import annotations

import math
from typing import TypeAlias, assert_never

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Fix, Label
from missionc.base.source import Span
from missionc.base.units import UNITS, Dimension, Seconds
from missionc.frontend.resolve.context import PLAIN, REPORTED, Context, Declared, Kind, Unresolved, ordered
from missionc.frontend.resolve.resolve_quantities import evaluate, excerpt, fitted, resolved_number, shown, with_unit_of
from missionc.frontend.syntax import ast

Corner: TypeAlias = tuple[float, float]


class Simple:
    """Result for a valid polygon, whose sides meet only at the corners."""


SIMPLE = Simple()


def fault(corners: tuple[Corner, ...]) -> str | Simple:
    """Fault of the polygon, as a phrase for a message that starts with it, or ``SIMPLE`` for a valid polygon."""
    if len(corners) < 3:
        return f"has {len(corners)} corners; it needs three"
    for index, corner in enumerate(corners):
        if corner == corners[index - 1]:
            second = index + 1 if index else len(corners)
            return f"has corner {second} where corner {second - 1 if index else 1} is"
    if area(corners) == 0:
        return "has no area"
    return _meeting_sides(corners)


def area(corners: tuple[Corner, ...]) -> float:
    """Signed area of a polygon, m²; positive if the corners run counterclockwise."""
    origin_x, origin_y = corners[0]
    shifted = [(x - origin_x, y - origin_y) for x, y in corners]
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(shifted, shifted[1:] + shifted[:1], strict=True)) / 2


def _meeting_sides(corners: tuple[Corner, ...]) -> str | Simple:
    """Phrase for two sides that intersect, or ``SIMPLE``; a sweep line visits the sides by their left ends."""
    sides = []
    for index, (a, b) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
        (left, right), (low, high) = sorted((a[0], b[0])), sorted((a[1], b[1]))
        sides.append((left, right, low, high, index))
    sides.sort()
    swept: list[tuple[float, float, float, float, int]] = []
    for side in sides:
        left, _, low, high, index = side
        swept = [other for other in swept if other[1] >= left]
        for other in [other[4] for other in swept if other[2] <= high and other[3] >= low]:
            if _meet(corners, index, other):
                first, second = sorted((index, other))
                return f"crosses itself: side {first + 1} meets side {second + 1}"
        swept.append(side)
    return SIMPLE


def _meet(corners: tuple[Corner, ...], side: int, other: int) -> bool:
    """Return whether two sides share more than the corner between adjacent sides."""
    count = len(corners)
    if (other + 1) % count == side:
        side, other = other, side
    ends = [corners[place % count] for place in (side, side + 1, other, other + 1)]
    if (side + 1) % count == other:
        return _folds_back(ends[0], ends[1], ends[3])
    return _touch(*ends)


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _folds_back(start: Corner, corner: Corner, end: Corner) -> bool:
    """Return whether the second of two adjacent sides runs back over the first."""
    ahead = (corner[0] - start[0]) * (end[0] - corner[0]) + (corner[1] - start[1]) * (end[1] - corner[1])
    return _turn(start, corner, end) == 0 and ahead < 0


def _between(a: Corner, b: Corner, point: Corner) -> bool:
    """Return whether a point on the line through ``a`` and ``b`` lies between them."""
    return min(a[0], b[0]) <= point[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= point[1] <= max(a[1], b[1])


def _touch(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Return whether the segments ``ab`` and ``cd`` have a common point."""
    turns = _turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b)
    if ((turns[0] > 0) != (turns[1] > 0)) and ((turns[2] > 0) != (turns[3] > 0)) and 0 not in turns:
        return True
    places = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    return any(turn == 0 and _between(*place) for turn, place in zip(turns, places, strict=True))


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


def resolve_motion(context: Context, motion: ast.Motion | None) -> ir.Still | ir.Path:
    match motion:
        case None | ast.AlongFile():  # the contents of the file replaced it, or are reported
            return ir.Still()
        case ast.Moving():
            factor = _unit(context, motion)
            speeds = tuple(_speed(context, item, factor) for item in motion.velocity.coordinates)
            velocity = as_many(context, padded(context, speeds), motion.velocity.span)
            if math.isnan(context.step):
                return ir.Still()
            horizon = context.step * context.steps
            rest = (0.0,) * len(velocity)
            return ir.Path((Seconds(0.0), Seconds(horizon)), (rest, tuple(speed * horizon for speed in velocity)))
        case ast.Along():
            return _along(context, motion)
        case _:
            assert_never(motion)


def resolve_growth(context: Context, growth: ast.Quantity | None) -> float:
    """Growth rate of an obstacle on all sides, m/s, at least 0; NaN if it is invalid, which is reported."""
    return 0.0 if growth is None else resolved_number(context, growth, Dimension.SPEED, "the growth", least=0)


def _unit(context: Context, motion: ast.Moving) -> float:
    """Factor for plain numbers in a velocity, from the unit after its bracket.

    NaN if it is invalid, which is reported.
    """
    if motion.unit is None:
        return 1.0
    dimension, factor = UNITS.get(motion.unit, (Dimension.NUMBER, REPORTED))
    if dimension is Dimension.SPEED:
        return factor
    context.report(
        code.WRONG_UNIT,
        f"expected a speed, found {dimension.value} in `{motion.unit}`",
        motion.unit_span or motion.span,
        help="write the velocity in m/s",
    )
    return REPORTED


def _speed(context: Context, item: ast.Quantity, factor: float) -> float:
    """Component of a velocity, m/s; a plain number has the unit after the bracket.

    Args:
        factor: m/s in that unit.
    """
    amount = evaluate(context, item)
    value = fitted(context, amount, Dimension.SPEED, item)
    return value * factor if amount.powers == PLAIN else value


def _along(context: Context, along: ast.Along) -> ir.Path:
    times = [resolved_number(context, item.time, Dimension.TIME, "the time", least=0) for item in along.waypoints]
    offsets = tuple(resolve_offset(context, item.offset, item.span) for item in along.waypoints)
    for index in range(1, len(times)):
        if times[index] <= times[index - 1]:
            context.report(
                code.BOUNDS_REVERSED,
                f"times are not increasing: {shown(times[index])} s follows {shown(times[index - 1])} s",
                along.waypoints[index].time.span,
                labels=(Label(along.waypoints[index - 1].time.span, "previous time"),),
                help="sort the offsets by time",
            )
    return ir.Path(tuple(map(Seconds, times)), offsets)


NOWHERE = ir.Box((REPORTED, REPORTED), (REPORTED, REPORTED))
"""Replacement for a shape that is invalid and has been reported."""

COMBINED: dict[str, type[ir.Union] | type[ir.Intersection] | type[ir.Difference]] = {
    "+": ir.Union,
    "*": ir.Intersection,
    "-": ir.Difference,
}
"""Shape class for each operator between shapes."""

# --------------------------------------------------------------------- shapes


def resolve_regions(context: Context) -> None:
    """Resolve every region and obstacle, in order of dependency."""
    items: list[ast.Region | ast.Obstacle] = [*context.declared(ast.Region), *context.declared(ast.Obstacle)]
    declarations = {item.name.text: item for item in items}
    shapes: dict[str, ir.Shape] = {}
    parts: dict[str, tuple[float, int]] = {}
    for name in ordered(context, {name: item.shape for name, item in declarations.items()}):
        item = declarations[name]
        shapes[name] = _within_limits(context, item, parts, resolve_shape(context, item.shape, shapes))
    for name, item in declarations.items():
        shape = shapes.get(name, NOWHERE)
        match item:
            case ast.Region():
                context.regions[name] = ir.Region(name, shape, item.name.span)
            case ast.Obstacle():
                motion = resolve_motion(context, item.motion)
                growth = resolve_growth(context, item.growth)
                context.obstacles[name] = ir.Obstacle(name, shape, motion, item.name.span, growth)


def resolve_shape(context: Context, shape: ast.Shape, made: dict[str, ir.Shape]) -> ir.Shape:
    """Shape with coordinates in metres.

    Args:
        made: shapes of the regions and obstacles that it names.
    """
    match shape:
        case ast.Name(text=text):
            declared = context.find(shape, Kind.REGION, Kind.OBSTACLE, needed="a region or an obstacle")
            if isinstance(declared, Unresolved):
                return NOWHERE
            if isinstance(declared.declaration, ast.Obstacle):
                _stays(context, shape, declared, declared.declaration)
            return made.get(text, NOWHERE)
        case ast.Box():
            return _box(context, shape)
        case ast.Disc(height=height):
            centre = plane_point(context, shape.centre, "the centre of a disc", "write a `ball`")
            band = _band(context, height)
            return ir.Disc(centre, _radius(context, shape.radius, "disc", shape.span), band)
        case ast.Cylinder():
            centre = plane_point(context, shape.centre, "the centre of a cylinder", "set its height with `height a..b`")
            radius = _radius(context, shape.radius, "cylinder", shape.span)
            return ir.Disc(centre, radius, _band(context, shape.height))
        case ast.Ball():
            return _ball(context, shape)
        case ast.Polygon():
            return _polygon(context, shape)
        case ast.Combined(operator=operator):
            left, right = resolve_shape(context, shape.left, made), resolve_shape(context, shape.right, made)
            return COMBINED[operator](left, right)
        case _:
            assert_never(shape)


def _box(context: Context, box: ast.Box) -> ir.Shape:
    if context.dimension == 3 and len(box.low.coordinates) == 2:
        first: ir.Vector = plane_point(context, box.low, "this box", "")
        second: ir.Vector = plane_point(
            context, box.high, "the other corner of this box", "write the same number of coordinates for both corners"
        )
        band = _band(context, box.height)
        assert band is not None
        first, second = (*first, band.low), (*second, band.high)
    else:
        first = resolve_point(context, box.low)
        same = known(first) or len(box.high.coordinates) != len(box.low.coordinates)
        second = resolve_point(context, box.high) if same else first  # a fault of both is reported for one
        if box.height is not None:
            _height_not_here(context, box.height, "the corners of this box already have heights")
    if len(first) != len(second) or not known(first, second):
        return NOWHERE
    low, high = tuple(map(min, first, second)), tuple(map(max, first, second))
    if any(a == b for a, b in zip(low, high, strict=True)):
        no_area(context, "the box", box.span)
    return ir.Box(low, high)


def _ball(context: Context, ball: ast.Ball) -> ir.Shape:
    if context.dimension == 2:
        context.report(
            code.WRONG_DIMENSION,
            "a ball needs three coordinates, but the world is a plane",
            ball.span,
            help="write `disc at (x, y) radius r`",
        )
        return NOWHERE
    return ir.Ball(resolve_point(context, ball.centre), _radius(context, ball.radius, "ball", ball.span))


def _polygon(context: Context, polygon: ast.Polygon) -> ir.Shape:
    if len(polygon.corners) > context.limits.shape_parts:
        too_many_parts(context, f"the polygon has {len(polygon.corners)} corners", polygon.span)
        return NOWHERE
    corners = tuple(
        plane_point(context, corner, "the corner of a polygon", "set its height with `height a..b`")
        for corner in polygon.corners
    )
    band = _band(context, polygon.height)
    if known(*corners):
        match fault(corners):
            case str() as phrase:
                context.report(
                    code.NO_AREA,
                    f"the polygon {phrase}",
                    polygon.span,
                    help="list each corner once, in order along the border",
                )
            case Simple():
                pass
    return ir.Polygon(corners, band)


def _radius(context: Context, radius: ast.Quantity, what: str, span: Span) -> float:
    value = resolved_number(context, radius, Dimension.LENGTH, f"the radius of the {what}", least=0)
    if value == 0:
        no_area(context, f"the {what}", span)
    return value


def _band(context: Context, height: ast.Height | None) -> ir.Prism | None:
    """Altitude range of a plane shape in a volume: its own, or that of the world; None in a plane."""
    if context.dimension != 3:
        if height is not None and context.dimension == 2:
            _height_not_here(context, height, "the world is a plane")
        return None
    if height is None:
        return ir.Prism(context.low[2], context.high[2])
    low = resolved_number(
        context, with_unit_of(height.low, height.high, Dimension.LENGTH), Dimension.LENGTH, "the height"
    )
    high = resolved_number(context, height.high, Dimension.LENGTH, "the height")
    if low > high:
        context.report(
            code.BOUNDS_REVERSED,
            f"bounds reversed: {shown(low)} m is greater than {shown(high)} m",
            height.span,
            help=f"write `height {shown(high)}..{shown(low)}`",
            fix=Fix(height.span, f"height {shown(high)}..{shown(low)}"),
        )
    elif low == high:
        no_area(context, "the height", height.span)
    return ir.Prism(low, high)


# --------------------------------------------------------------------- limits


def _within_limits(
    context: Context, item: ast.Region | ast.Obstacle, parts: dict[str, tuple[float, int]], shape: ir.Shape
) -> ir.Shape:
    """The shape itself, or ``NOWHERE`` if it has too many parts or too deep nesting, which is reported."""
    count, depth = _size(item.shape, parts)
    too_large = count > context.limits.shape_parts or (depth > context.limits.nesting and not math.isnan(count))
    parts[item.name.text] = (math.nan, 1) if too_large else (count, depth)
    if too_large:
        too_many_parts(
            context, f"`{item.name.text}` consists of {shown(count)} shapes, nested {depth} deep", item.shape.span
        )
    return NOWHERE if too_large else shape


def _size(shape: ast.Shape, parts: dict[str, tuple[float, int]]) -> tuple[float, int]:
    """Number of simple shapes in a shape, and its nesting depth.

    Args:
        parts: both numbers by named shape; NaN for a shape that is invalid and reported.
    """
    match shape:
        case ast.Name(text=text):
            return parts.get(text, (1, 1))
        case ast.Combined():
            left, right = _size(shape.left, parts), _size(shape.right, parts)
            return left[0] + right[0], 1 + max(left[1], right[1])
        case _:
            return 1, 1


# ------------------------------------------------------------------ messages


def too_many_parts(context: Context, what: str, span: Span) -> None:
    limits = context.limits
    context.report(
        code.TOO_LARGE_TO_EXPAND,
        f"{what}; the limits are {limits.shape_parts} and a depth of {limits.nesting}",
        span,
        help="raise the limit with `--limit shape_parts=VALUE`",
    )


def _stays(context: Context, name: ast.Name, declared: Declared, obstacle: ast.Obstacle) -> None:
    """Report an obstacle with a motion or growth, if its shape is used as a constant shape."""
    if obstacle.motion is None and obstacle.growth is None:
        return
    context.report(
        code.WRONG_KIND,
        f"expected a constant shape, but `{name.text}` {'grows' if obstacle.motion is None else 'moves'}",
        name.span,
        labels=(Label(declared.span, "declared here"),),
        help="declare its shape as a region and use the region in both places",
    )


def _height_not_here(context: Context, height: ast.Height, why: str) -> None:
    context.report(code.WRONG_DIMENSION, f"unexpected `height`: {why}", height.span, help="delete the height")
