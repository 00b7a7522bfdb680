"""How an agent moves: the kind of dynamics and its bounds.

says MC013 MC014 MC201 MC206 MC210
"""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.units import Dimension
from missionc.diagnostics import code
from missionc.diagnostics.model import Fix
from missionc.resolve.context import REPORTED, Context
from missionc.resolve.resolve_quantities import (
    number,
    shown,
    with_unit_of,
)
from missionc.resolve.resolve_settings import (
    known_settings,
    missing,
    relation,
    unknown_word,
)
from missionc.syntax import ast

SETTINGS: dict[str, tuple[str, ...]] = {
    "single_integrator": ("speed",),
    "double_integrator": ("speed", "acceleration"),
    "unicycle": ("speed", "turn"),
}
"""The kinds of dynamics and the settings each takes."""

UNMOVED = ir.SingleIntegrator(REPORTED)
"""In place of dynamics that have been reported."""


def resolve_dynamics(context: Context, dynamics: ast.Dynamics) -> ir.Dynamics:
    kind = dynamics.name.text
    if kind not in SETTINGS:
        unknown_word(context, dynamics.name, tuple(SETTINGS), "`dynamics`", "kind")
        return UNMOVED
    settings = known_settings(context, dynamics.settings, SETTINGS[kind], f"`{kind}`")
    slowest, fastest = _speeds(context, dynamics, settings)
    if kind == "unicycle":
        return ir.Unicycle(slowest, fastest, _turn(context, settings))
    if slowest > 0:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"the lowest speed is {shown(slowest)} m/s; only a `unicycle` has one above 0",
            settings["speed"].span,
            help="write `speed <= V`, or take a `unicycle`",
        )
    if kind == "single_integrator":
        return ir.SingleIntegrator(fastest)
    return ir.DoubleIntegrator(fastest, _acceleration(context, dynamics, settings))


def _speeds(context: Context, dynamics: ast.Dynamics, settings: dict[str, ast.Setting]) -> tuple[float, float]:
    """The lowest and the highest speed; the lowest is 0 where only a bound above is given."""
    speed = settings.get("speed")
    if speed is None:
        missing(context, f"the speed of `{dynamics.name.text}`", dynamics.span, "write `speed <= V`")
        return REPORTED, REPORTED
    relation(context, speed, "<=", "..")
    fastest = number(context, speed.high, Dimension.SPEED, "the highest speed", above=0)
    if speed.low is None:
        return 0.0, fastest
    low = with_unit_of(speed.low, speed.high, Dimension.SPEED)
    slowest = number(context, low, Dimension.SPEED, "the lowest speed", least=0)
    if slowest > fastest:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"the lowest speed, {shown(slowest)} m/s, is above the highest, {shown(fastest)} m/s",
            speed.span,
            help=f"write `speed {shown(fastest)}..{shown(slowest)} m/s`",
            fix=Fix(speed.span, f"speed {shown(fastest)}..{shown(slowest)} m/s"),
        )
    return slowest, fastest


def _acceleration(context: Context, dynamics: ast.Dynamics, settings: dict[str, ast.Setting]) -> float:
    setting = settings.get("acceleration")
    if setting is None:
        way_out = "write `acceleration <= A`"
        missing(context, f"the acceleration of `{dynamics.name.text}`", dynamics.span, way_out)
        return REPORTED
    relation(context, setting, "<=")
    return number(context, setting.high, Dimension.ACCELERATION, "the acceleration", above=0)


def _turn(context: Context, settings: dict[str, ast.Setting]) -> float:
    setting = settings.get("turn")
    if setting is None:
        return math.inf
    relation(context, setting, "<=")
    return number(context, setting.high, Dimension.TURN, "the turning rate", above=0)
