"""Resolution of dynamics: the kind of an agent's motion and its bounds.

says MC013 MC014 MC201 MC206 MC210
"""

from __future__ import annotations

from missionc import ir
from missionc.base.units import Dimension
from missionc.diagnostics import code
from missionc.diagnostics.model import Fix
from missionc.ir.dynamics import DYNAMICS, Limit, by_word
from missionc.resolve.context import REPORTED, Context
from missionc.resolve.resolve_quantities import number, shown, with_unit_of
from missionc.resolve.resolve_settings import known_settings, missing, relation, unknown_word
from missionc.syntax import ast

SETTINGS: dict[str, tuple[str, ...]] = {
    kind.word: ("speed", *(limit.setting for limit in kind.limits)) for kind in DYNAMICS
}
"""The kinds of dynamics and the settings each takes."""

UNMOVED = DYNAMICS[0].of(REPORTED, REPORTED, *(REPORTED for _ in DYNAMICS[0].limits))
"""In place of dynamics that have been reported."""


def resolve_dynamics(context: Context, dynamics: ast.Dynamics) -> ir.Dynamics:
    word = dynamics.name.text
    if word not in SETTINGS:
        unknown_word(context, dynamics.name, tuple(SETTINGS), "`dynamics`", "kind")
        return UNMOVED
    kind = by_word[word]
    settings = known_settings(context, dynamics.settings, SETTINGS[word], f"`{word}`")
    slowest, fastest = _speeds(context, dynamics, settings)
    if slowest > 0 and not kind.may_be_restless:
        restless = " or ".join(f"`{each.word}`" for each in DYNAMICS if each.may_be_restless)
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"the lowest speed is {shown(slowest)} m/s; only a {restless} has one above 0",
            settings["speed"].span,
            help=f"write `speed <= V`, or take a {restless}",
        )
    return kind.of(slowest, fastest, *(_limit(context, dynamics, settings, limit) for limit in kind.limits))


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


def _limit(context: Context, dynamics: ast.Dynamics, settings: dict[str, ast.Setting], limit: Limit) -> float:
    setting = settings.get(limit.setting)
    if setting is None and limit.default is not None:
        return limit.default
    if setting is None:
        way_out = f"write `{limit.setting} <= {limit.setting[0].upper()}`"
        missing(context, f"the {limit.setting} of `{dynamics.name.text}`", dynamics.span, way_out)
        return REPORTED
    relation(context, setting, "<=")
    return number(context, setting.high, limit.dimension, limit.name, above=0)
