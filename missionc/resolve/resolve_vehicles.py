"""Resolution of vehicles: a profile by its name, with figures of the mission's own; and the yaw of a team.

says MC201 MC206 MC209 MC210
"""

from __future__ import annotations

import math
from dataclasses import replace

from missionc import ir
from missionc.base.units import Dimension
from missionc.data.vehicles import profiles
from missionc.diagnostics import code
from missionc.diagnostics.suggest import Nothing
from missionc.resolve.context import Context
from missionc.resolve.resolve_quantities import SI, number, shown, whole, with_unit_of
from missionc.resolve.resolve_settings import known_settings, relation, unknown_word
from missionc.syntax import ast


def resolve_vehicle(context: Context, vehicle: ast.Vehicle) -> ir.Vehicle:
    """The profile with the mission's own figures in place of its."""
    known = profiles()
    name: str | Nothing = vehicle.name.text
    if name not in known:
        name = unknown_word(context, vehicle.name, tuple(known), "`vehicle`", "profile")
    profile = known[name] if isinstance(name, str) else ir.PLAIN
    settings = known_settings(context, vehicle.settings, tuple(ir.FIGURES), f"`{profile.name}`")
    values = {key: _value(context, key, setting) for key, setting in settings.items()}
    return replace(profile, **values)  # type: ignore[arg-type]


def resolve_yaw(context: Context, yaw: ast.Yaw) -> ir.Yaw:
    if yaw.angle is None:
        return ir.AlongPath()
    return ir.Fixed(number(context, yaw.angle, Dimension.ANGLE, "the yaw"))


def _value(context: Context, name: str, setting: ast.Setting) -> float | ir.Band:
    """NaN once it is reported, as everywhere in ``resolve``."""
    figure, what = ir.FIGURES[name], f"the `{name}`"
    relation(context, setting, figure.relation)
    if figure.relation == "..":
        return _band(context, figure, setting, what)
    if figure.whole:
        size = whole(context, setting.high, what, least=1)
        return size if math.isnan(size) else int(size)
    if figure.above:
        return number(context, setting.high, figure.dimension, what, above=0)
    return number(context, setting.high, figure.dimension, what, least=0)


def _band(context: Context, figure: ir.Figure, setting: ast.Setting, what: str) -> ir.Band:
    high = number(context, setting.high, figure.dimension, f"the upper end of {what}", above=0)
    if setting.low is None:
        return ir.Band(high, high)
    lower = with_unit_of(setting.low, setting.high, figure.dimension)
    low = number(context, lower, figure.dimension, f"the lower end of {what}", least=0)
    if low >= high:
        unit = SI[figure.dimension]
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"{what} runs from {shown(low)}{unit} to {shown(high)}{unit}, which is no band",
            setting.span,
            help="write the lower end first",
        )
    elif figure.around and (low >= 1 or high <= 1):
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"{what} runs from {shown(low)} to {shown(high)}, and at 1 a vehicle hovers",
            setting.span,
            help="write a band with 1 in it",
        )
    return ir.Band(low, high)
