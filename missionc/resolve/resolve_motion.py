"""Resolution of an obstacle's motion: offsets of its shape at times, and how fast it grows.

says MC201 MC205 MC210 MC303
"""

from __future__ import annotations

import math
from typing import assert_never

from missionc import ir
from missionc.base.units import UNITS, Dimension, Seconds
from missionc.diagnostics import code
from missionc.diagnostics.model import Label
from missionc.resolve.amounts import PLAIN
from missionc.resolve.context import REPORTED, Context
from missionc.resolve.resolve_points import as_many, padded, resolve_offset
from missionc.resolve.resolve_quantities import evaluate, fitted, number, shown
from missionc.syntax import ast


def resolve_motion(context: Context, motion: ast.Motion | None) -> ir.Still | ir.Path:
    match motion:
        case None | ast.AlongFile():  # what a file holds took its place, or is reported
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
    """How fast an obstacle grows on all sides, m/s, at least 0; NaN once it is reported."""
    return 0.0 if growth is None else number(context, growth, Dimension.SPEED, "the growth", least=0)


def _unit(context: Context, motion: ast.Moving) -> float:
    """What the unit after the bracket makes of the plain numbers in it; NaN once it is reported."""
    if motion.unit is None:
        return 1.0
    dimension, factor = UNITS.get(motion.unit, (Dimension.NUMBER, REPORTED))
    if dimension is Dimension.SPEED:
        return factor
    context.report(
        code.WRONG_UNIT,
        f"`{motion.unit}` is {dimension.value}; a speed is needed here",
        motion.unit_span or motion.span,
        help="write the velocity in m/s",
    )
    return REPORTED


def _speed(context: Context, item: ast.Quantity, factor: float) -> float:
    """One coordinate of a velocity; a plain number has the unit after the bracket."""
    amount = evaluate(context, item)
    value = fitted(context, amount, Dimension.SPEED, item)
    return value * factor if amount.powers == PLAIN else value


def _along(context: Context, along: ast.Along) -> ir.Path:
    times = [number(context, item.time, Dimension.TIME, "the time", least=0) for item in along.waypoints]
    offsets = tuple(resolve_offset(context, item.offset, item.span) for item in along.waypoints)
    for index in range(1, len(times)):
        if times[index] <= times[index - 1]:
            context.report(
                code.BOUNDS_REVERSED,
                f"times run backwards: {shown(times[index])} s stands after {shown(times[index - 1])} s",
                along.waypoints[index].time.span,
                labels=(Label(along.waypoints[index - 1].time.span, "the time before"),),
                help="give the offsets in the order of their times, each time once",
            )
    return ir.Path(tuple(map(Seconds, times)), offsets)
