"""Resolution of the time step, the horizon and windows: conversion of seconds to numbers of steps.

says MC210 MC302 MC303 MC304 MC305 MC306
"""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Fix, Label
from missionc.base.units import Dimension, Steps
from missionc.frontend.resolve.context import REPORTED, Context
from missionc.frontend.resolve.resolve_quantities import (
    POWERS,
    evaluate,
    excerpt,
    fitted,
    is_reported,
    resolved_number,
    shown,
    swapped,
)
from missionc.frontend.syntax import ast

ROUNDING = 1e-9
"""Relative tolerance for a quotient to count as an integer (4.7 s / 0.1 s is 47)."""


def as_whole(value: float) -> float:
    """The nearest integer if the value is within the rounding tolerance, else the value itself."""
    nearest = float(round(value)) if math.isfinite(value) else value
    return nearest if abs(value - nearest) <= ROUNDING * max(1.0, abs(value)) else value


def resolve_time(context: Context, time: ast.Time, stretch: float = 1.0) -> None:
    """Set the step in seconds and the number of steps; the step stays NaN if either is invalid.

    The number of steps is ``stretch`` times the written number, rounded.
    """
    step = resolved_number(context, time.step, Dimension.TIME, "the step", above=0)
    horizon = resolved_number(context, time.horizon, Dimension.TIME, "the horizon", above=0)
    if math.isnan(step) or math.isnan(horizon):
        return
    steps = as_whole(horizon / step)
    longer = steps if stretch == 1 else math.ceil(as_whole(steps * stretch))
    if longer > context.limits.steps:
        _too_many(context, time, longer)
        return
    if steps != math.floor(steps):
        _horizon_not_whole(context, time, step, horizon, steps)
        return
    context.step = step
    context.steps = int(longer)


def resolve_window(context: Context, window: ast.Window) -> ir.Window:
    """Window with bounds as numbers of steps."""
    low = _steps(context, window.low)
    high = math.inf if window.high is None else _steps(context, window.high)
    if low > high:
        context.report(
            code.BOUNDS_REVERSED,
            f"bounds reversed: {_written(context, low)} is greater than {_written(context, high)}",
            window.span,
            help="write the earlier bound first",
            fix=None if window.high is None else swapped(window.low, window.high, ", "),
        )
    elif low == high:
        _whole_bound(context, window.low, low)
    elif math.isfinite(low) and math.ceil(low) > high:
        _no_step(context, window, low, high)
    else:
        _whole_bound(context, window.low, low)
        if window.high is not None:
            _whole_bound(context, window.high, high)
    last = None if window.high is None else Steps(_whole_or_zero(high))
    return ir.Window(Steps(_whole_or_zero(low)), last, window.span)


def resolve_period(context: Context, period: ast.Period) -> ir.Period:
    """Period as a number of steps, at least one."""
    steps = _steps(context, period.length, "the period", "it must be at least one step", "a period of one step or more")
    if steps < 1:
        _shorter_than_a_step(context, period, steps)
    else:
        _whole_bound(context, period.length, steps)
    return ir.Period(Steps(max(_whole_or_zero(steps), 1)), period.span)


def resolve_delay(context: Context, delay: ast.Quantity) -> Steps:
    """Delay as a number of steps, at most the mission's number of steps."""
    steps = _steps(context, delay, "the delay", "it must be at least 0", "a delay of at least 0")
    _whole_bound(context, delay, steps)
    if steps > context.steps and not math.isnan(context.step):
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"the delay of {_seconds(context, steps)} exceeds the horizon of {_seconds(context, context.steps)}",
            delay.span,
            help="write a shorter delay",
        )
    return Steps(_whole_or_zero(steps))


def _whole_or_zero(steps: float) -> int:
    return int(steps) if math.isfinite(steps) else 0


def _steps(
    context: Context,
    bound: ast.Quantity,
    what: str = "the bound",
    why: str = "it must be at least 0",
    instead: str = "a bound of at least 0",
) -> float:
    """Time bound as a number of steps, possibly fractional; NaN if it is invalid, or while the step is unknown."""
    amount = evaluate(context, bound)
    if is_reported(amount):
        return REPORTED
    in_steps = amount.powers == POWERS[Dimension.STEPS]
    value = amount.constant if in_steps else fitted(context, amount, Dimension.TIME, bound)
    if value < 0:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"{what} is {shown(value)}{' steps' if in_steps else ' s'}; {why}",
            bound.span,
            help=f"write {instead}",
        )
        return REPORTED
    return as_whole(value if in_steps else value / context.step)


# ------------------------------------------------------------------ messages


def _seconds(context: Context, steps: float) -> str:
    return f"{shown(steps * context.step)} s"


def _written(context: Context, steps: float) -> str:
    return f"{shown(steps)} steps" if math.isnan(context.step) else _seconds(context, steps)


def _whole_bound(context: Context, bound: ast.Quantity, steps: float) -> None:
    if math.isnan(steps) or steps == math.floor(steps):
        return
    context.report(
        code.NOT_WHOLE_STEPS,
        f"`{excerpt(bound.span)}` is {shown(steps)} steps of {shown(context.step)} s; expected a whole number",
        bound.span,
        help=f"write `{_seconds(context, math.floor(steps))}` or `{_seconds(context, math.ceil(steps))}`",
        fix=Fix(bound.span, _seconds(context, round(steps))),
    )


def _shorter_than_a_step(context: Context, period: ast.Period, steps: float) -> None:
    context.report(
        code.VALUE_OUT_OF_RANGE,
        f"the period is {_written(context, steps)}, shorter than a step",
        period.span,
        help=f"write `{_written(context, 1)}` or more",
    )


def _no_step(context: Context, window: ast.Window, low: float, high: float) -> None:
    around = f"[{_seconds(context, math.floor(low))}, {_seconds(context, math.ceil(high))}]"
    context.report(
        code.WINDOW_EMPTY,
        f"the window contains no sample time: the nearest are {_seconds(context, math.floor(low))}"
        f" and {_seconds(context, math.ceil(high))}",
        window.span,
        help=f"write `{around}`",
        fix=Fix(window.span, around),
    )


def _horizon_not_whole(context: Context, time: ast.Time, step: float, horizon: float, steps: float) -> None:
    shorter, longer = (f"{shown(count * step)} s" for count in (math.floor(steps), math.ceil(steps)))
    context.report(
        code.HORIZON_NOT_WHOLE,
        f"the horizon of {shown(horizon)} s is {shown(steps)} steps of {shown(step)} s; expected a whole number",
        time.horizon.span,
        labels=(Label(time.step.span, "the step"),),
        help=f"write `horizon {longer}`" if steps < 1 else f"write `horizon {shorter}` or `horizon {longer}`",
        fix=Fix(time.horizon.span, shorter if steps - math.floor(steps) < 0.5 and steps > 1 else longer),
    )


def _too_many(context: Context, time: ast.Time, steps: float) -> None:
    context.report(
        code.TOO_MANY_STEPS,
        f"the mission has {shown(steps)} steps; the limit is {context.limits.steps}",
        time.span,
        help="raise the limit with `--limit steps=VALUE`",
    )
