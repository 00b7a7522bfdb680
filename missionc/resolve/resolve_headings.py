"""Resolution of headings: the angle to either side, and the direction or the beacon that is faced.

says MC101 MC104 MC201 MC210
"""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.units import Dimension
from missionc.diagnostics import code
from missionc.diagnostics.model import Label
from missionc.ir import About
from missionc.resolve.context import REPORTED, Context
from missionc.resolve.names import Declared, Kind, Unresolved
from missionc.resolve.resolve_quantities import number, shown
from missionc.resolve.typed import Typed
from missionc.syntax import ast


def resolve_facing(context: Context, facing: ast.Facing) -> Typed:
    """``heading within 10 deg of 90 deg``, which holds in all cases where something of it has been reported."""
    within, towards = _within(context, facing.within), _towards(context, facing.towards)
    if math.isnan(within) or (isinstance(towards, float) and math.isnan(towards)):
        return Typed(ir.Truth(True, facing.span), About.EITHER, facing.span)
    return Typed(ir.Holds(ir.Facing(towards, within), facing.span), About.AGENT, facing.span)


def _within(context: Context, angle: ast.Quantity) -> float:
    value = number(context, angle, Dimension.ANGLE, "the angle to either side", above=0)
    if value < math.pi or math.isnan(value):
        return value
    context.report(
        code.VALUE_OUT_OF_RANGE,
        f"the angle to either side is {shown(math.degrees(value))} deg; no heading is more than 180 deg from another",
        angle.span,
        help="write an angle of less than `180 deg`, with its unit",
    )
    return REPORTED


def _towards(context: Context, towards: ast.Quantity) -> float | ir.Beacon:
    if not isinstance(towards, ast.Name):
        return number(context, towards, Dimension.ANGLE, "the direction")
    declared = context.names.declared.get(towards.text)
    if declared is not None and declared.kind is Kind.REGION:
        _no_place(context, towards, declared)
        return REPORTED
    found = context.find(towards, Kind.PARAM, Kind.BEACON, needed="an angle or a beacon")
    if isinstance(found, Unresolved):
        return REPORTED
    if found.kind is Kind.PARAM:
        return number(context, towards, Dimension.ANGLE, "the direction")
    return context.beacons.get(towards.text, REPORTED)


# ------------------------------------------------------------------ messages


def _no_place(context: Context, name: ast.Name, declared: Declared) -> None:
    region = context.regions.get(name.text)
    where = _middle(region.shape) if region is not None else None
    place = "(X, Y)" if where is None else f"({', '.join(map(shown, where))})"
    context.report(
        code.WRONG_KIND,
        f"`{name.text}` is a region, which lies in many directions at once; an angle or a beacon is needed here",
        name.span,
        labels=(Label(declared.span, "declared here"),),
        help=f"declare a point of it, as in `beacon {name.text}_middle = {place}`, and name that",
    )


def _middle(shape: ir.Shape) -> ir.Vector | None:
    match shape:
        case ir.Box(low, high):
            return tuple((begin + end) / 2 for begin, end in zip(low, high, strict=True))
        case ir.Disc(centre, _, None):
            return centre
        case _:
            return None
