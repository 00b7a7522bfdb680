"""Evaluation of quantities and parameters: looks up names, computes units, converts numbers to SI.

    says MC001 MC006 MC010 MC104 MC106 MC201 MC202 MC209 MC210, and errors of a value

One evaluator serves numbers and comparisons: an ``Amount`` is a linear expression over variables (``x``, ``speed``,
``distance(base)``), and a number must have no such terms. A parameter has its value in the text, or the one from the
command line.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import TypeAlias, assert_never

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic, Fix, Label
from missionc.base.diagnostics.suggest import suggestion
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.base.units import UNITS, Dimension
from missionc.frontend.resolve.context import (
    PLAIN,
    REPORTED,
    STATE_WORDS,
    Amount,
    Context,
    Kind,
    Powers,
    Unresolved,
    as_written,
    kept,
    ordered,
    rounded,
    some_of,
)
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.parse import parse

POWERS: dict[Dimension, Powers] = {
    Dimension.NUMBER: PLAIN,
    Dimension.LENGTH: (1, 0, 0, 0),
    Dimension.TIME: (0, 1, 0, 0),
    Dimension.SPEED: (1, -1, 0, 0),
    Dimension.ACCELERATION: (1, -2, 0, 0),
    Dimension.JERK: (1, -3, 0, 0),
    Dimension.ANGLE: (0, 0, 1, 0),
    Dimension.TURN: (0, -1, 1, 0),
    Dimension.STEPS: (0, 0, 0, 1),
}

SI: dict[Dimension, str] = {
    Dimension.NUMBER: "",
    Dimension.LENGTH: " m",
    Dimension.TIME: " s",
    Dimension.SPEED: " m/s",
    Dimension.ACCELERATION: " m/s^2",
    Dimension.JERK: " m/s^3",
    Dimension.ANGLE: " rad",
    Dimension.TURN: " rad/s",
    Dimension.STEPS: " steps",
}


NO_AMOUNT = Amount(None)
"""Replacement for an amount that is invalid and has been reported; it fits everywhere."""

StateOf: TypeAlias = Callable[[Context, "ast.Name | ast.Distance"], Amount]
"""Function that resolves a state word or distance to an amount; outside comparisons it reports a finding."""


def number_needed(context: Context, state: ast.Name | ast.Distance) -> Amount:
    """Report a state word where a number is needed, and return ``NO_AMOUNT``."""
    context.report(
        code.WRONG_KIND,
        f"expected a number, found `{excerpt(state.span)}`, which changes with time",
        state.span,
        help="write a number with its unit",
    )
    return NO_AMOUNT


# ---------------------------------------------------------------- evaluation


def evaluate(context: Context, quantity: ast.Quantity, state_of: StateOf = number_needed) -> Amount:
    """Value of a quantity in SI units; ``NO_AMOUNT`` if a part of it is invalid, which is reported.

    Args:
        state_of: function that resolves state words and distances.
    """
    match quantity:
        case ast.Name(text=text) if text in STATE_WORDS:
            return state_of(context, quantity)
        case ast.Name(text=text):
            kinds = (Kind.PARAM,) if state_of is number_needed else (Kind.PARAM, Kind.RESOURCE)
            found = context.find(quantity, *kinds, needed=_needed(state_of))
            if isinstance(found, Unresolved):
                return NO_AMOUNT
            return context.params.get(text, NO_AMOUNT) if found.kind is Kind.PARAM else state_of(context, quantity)
        case ast.Distance():
            return state_of(context, quantity)
        case ast.Number(value=value, unit=None):
            return _in_range(context, Amount(as_written(value)), quantity)
        case ast.Number():
            return _with_unit(context, quantity)
        case ast.Negative(body=body):
            return scaled(evaluate(context, body, state_of), MINUS)
        case ast.Arithmetic():
            left = evaluate(context, quantity.left, state_of)
            right = evaluate(context, quantity.right, state_of)
            return _in_range(context, _combined(context, quantity, left, right), quantity)
        case ast.Extreme():
            return _extreme(context, quantity, [evaluate(context, part, state_of) for part in quantity.parts])
        case _:
            assert_never(quantity)


def _needed(state_of: StateOf) -> str:
    return "a parameter" if state_of is number_needed else "a parameter, a state or a `distance(…)`"


def _with_unit(context: Context, number: ast.Number) -> Amount:
    unit = number.unit or ""
    if unit not in UNITS:
        span = number.unit_span or number.span
        known, listed = () if "/" in unit else UNITS, f"use one of the units {', '.join(UNITS)}"
        context.report_unknown(code.UNKNOWN_UNIT, f"unknown unit `{unit}`", span, unit, known, listed)
        return NO_AMOUNT
    dimension, factor = UNITS[unit]
    return _in_range(context, Amount(as_written(number.value) * as_written(factor), POWERS[dimension]), number)


MINUS = Fraction(-1)


def scaled(amount: Amount, factor: Fraction) -> Amount:
    if amount.exact is None:
        return amount
    terms = tuple((weight * rounded(factor) if weight else weight, feature) for weight, feature in amount.terms)
    return Amount(kept(amount.exact * factor), amount.powers, terms)


def _combined(context: Context, quantity: ast.Arithmetic, left: Amount, right: Amount) -> Amount:
    if left.exact is None or right.exact is None:
        return NO_AMOUNT
    match quantity.operator:
        case "+":
            return added(context, quantity, left, right)
        case "-":
            return added(context, quantity, left, scaled(right, MINUS))
        case "*" if left.terms and right.terms:
            return _not_linear(context, quantity, "multiplies")
        case "*":
            factor, other = (left.exact, right) if not left.terms else (right.exact, left)
            return replace(scaled(other, factor), powers=_sum(left.powers, right.powers, 1))
        case _ if right.terms:
            return _not_linear(context, quantity, "divides by")
        case _ if right.exact == 0:
            context.report(
                code.VALUE_OUT_OF_RANGE,
                f"`{excerpt(quantity.span)}` divides by zero",
                quantity.right.span,
                help="divide by another number",
            )
            return NO_AMOUNT
        case _:
            return replace(scaled(left, 1 / right.exact), powers=_sum(left.powers, right.powers, -1))


def added(context: Context, quantity: ast.Arithmetic | ast.Compare, left: Amount, right: Amount) -> Amount:
    """Sum of two amounts; a number without a unit takes the SI unit of the other amount."""
    if left.exact is None or right.exact is None:
        return NO_AMOUNT
    powers = left.powers if right.powers == PLAIN and not right.terms else right.powers
    if left.powers != powers and not (left.powers == PLAIN and not left.terms):
        verb = "compares" if isinstance(quantity, ast.Compare) else "adds"
        _two_units(context, quantity.span, verb, (quantity.left, left.powers), (quantity.right, right.powers))
        return NO_AMOUNT
    weights: dict[ir.Feature, list[float]] = {}
    for weight, feature in left.terms + right.terms:
        weights.setdefault(feature, []).append(weight)
    terms = tuple((sum(parts), feature) for feature, parts in weights.items() if not _cancel(parts))
    return Amount(kept(left.exact + right.exact), powers, terms)


def _extreme(context: Context, quantity: ast.Extreme, amounts: list[Amount]) -> Amount:
    """Minimum or maximum of several numbers; a number without a unit takes the unit of the others."""
    values = [amount.exact for amount in amounts if amount.exact is not None]
    if len(values) < len(amounts):
        return NO_AMOUNT
    if any(amount.terms for amount in amounts):
        return _not_linear(context, quantity, "compares")
    powers, of_unit = PLAIN, quantity.parts[0]
    for part, amount in zip(quantity.parts, amounts, strict=True):
        if amount.powers == PLAIN or amount.powers == powers:
            continue
        if powers != PLAIN:
            _two_units(context, quantity.span, "compares", (of_unit, powers), (part, amount.powers))
            return NO_AMOUNT
        powers, of_unit = amount.powers, part
    return Amount(min(values) if quantity.word == "min" else max(values), powers)


def _cancel(weights: list[float]) -> bool:
    """Return whether the weights add up to zero, except for rounding."""
    return abs(sum(weights)) <= 1e-12 * sum(map(abs, weights))


def is_reported(amount: Amount) -> bool:
    return amount.exact is None


def _sum(left: Powers, right: Powers, sign: int) -> Powers:
    length, time, angle, steps = (a + sign * b for a, b in zip(left, right, strict=True))
    return length, time, angle, steps


def _in_range(context: Context, amount: Amount, quantity: ast.Quantity) -> Amount:
    sizes = [abs(amount.constant), *(abs(weight) for weight, _ in amount.terms)]
    if is_reported(amount) or max(sizes) <= context.limits.magnitude:
        return amount
    limit = shown(context.limits.magnitude)
    context.report(
        code.NUMBER_OUT_OF_RANGE,
        f"`{excerpt(quantity.span)}` is {shown(max(sizes))} in SI units; the limit is {limit}",
        quantity.span,
        help="raise the limit with `--limit magnitude=VALUE`",
    )
    return NO_AMOUNT


def _two_units(
    context: Context, span: Span, verb: str, one: tuple[ast.Quantity, Powers], other: tuple[ast.Quantity, Powers]
) -> None:
    context.report(
        code.WRONG_UNIT,
        f"`{excerpt(span)}` {verb} {measured(one[1])} and {measured(other[1])}",
        span,
        labels=(Label(one[0].span, measured(one[1])), Label(other[0].span, measured(other[1]))),
        help="use the same kind of unit on both sides",
    )


def _not_linear(context: Context, quantity: ast.Arithmetic | ast.Extreme, verb: str) -> Amount:
    context.report(
        code.WRONG_KIND,
        f"`{excerpt(quantity.span)}` {verb} quantities that change with time; a comparison is linear",
        quantity.span,
        help="multiply or divide by numbers only",
    )
    return NO_AMOUNT


# --------------------------------------------------------- a number for a place


def fitted(context: Context, amount: Amount, dimension: Dimension, quantity: ast.Quantity) -> float:
    """SI value of an amount with a required dimension; NaN if it has another one, which is reported."""
    if is_reported(amount) or amount.powers in (PLAIN, POWERS[dimension]):
        return amount.constant
    labels: tuple[Label, ...] = ()
    if isinstance(quantity, ast.Name):
        declared = context.names.declared[quantity.text]
        labels = (Label(declared.span, f"{measured(amount.powers)}, declared here"),)
    unit_span = quantity.unit_span if isinstance(quantity, ast.Number) else None
    context.report(
        code.WRONG_UNIT,
        f"expected {dimension.value}, found {measured(amount.powers)} `{excerpt(quantity.span)}`",
        unit_span or quantity.span,
        labels=labels,
        help=f"use the unit {SI[dimension].strip()}" if SI[dimension] else "write a number without a unit",
    )
    return REPORTED


def resolved_number(
    context: Context,
    quantity: ast.Quantity,
    dimension: Dimension,
    what: str,
    *,
    least: float = -math.inf,
    above: float = -math.inf,
) -> float:
    """SI value of a quantity, at least ``least`` and more than ``above``; NaN if it is invalid, which is reported.

    Args:
        what: text for the quantity in messages.
    """
    value = fitted(context, evaluate(context, quantity), dimension, quantity)
    if value < least or value <= above:
        bound = f"at least {shown(least)}" if value < least else f"more than {shown(above)}"
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"{what} is {shown(value)}{SI[dimension]}; it must be {bound}{SI[dimension]}",
            quantity.span,
            help="write a larger value",
        )
        return REPORTED
    return value


def whole(context: Context, quantity: ast.Quantity, what: str, *, least: int = 0) -> float:
    """Integer value of a quantity (as a float), at least ``least``; NaN if it is invalid, which is reported."""
    value = resolved_number(context, quantity, Dimension.NUMBER, what, least=least)
    if math.isnan(value) or value == math.floor(value):
        return value
    context.report(
        code.NOT_WHOLE,
        f"{what} is {shown(value)}; expected a whole number",
        quantity.span,
        help=f"write `{math.floor(value)}` or `{math.ceil(value)}`",
        fix=Fix(quantity.span, str(max(round(value), least))),
    )
    return REPORTED


def with_unit_of(low: ast.Quantity, high: ast.Quantity, dimension: Dimension) -> ast.Quantity:
    """Lower bound of a range such as ``50..120 cm``, with the unit after the range."""
    match low, high:
        case ast.Number(unit=None), ast.Number(unit=str() as unit) if UNITS.get(unit, (None,))[0] is dimension:
            return replace(low, unit=unit, unit_span=high.unit_span)
        case _:
            return low


def swapped(low: ast.Quantity, high: ast.Quantity, between: str, *, lends: bool = False) -> Fix:
    """Fix that exchanges two bounds.

    Args:
        between: text between the bounds.
        lends: True if a single unit after both bounds applies to both.
    """
    first, second = low.span.text, high.span.text
    match low, high:
        case ast.Number(unit=None), ast.Number(unit_span=Span() as unit) if lends:
            number = Span(unit.source, high.span.start, unit.start).text.rstrip()
            first, second = first + high.span.text[len(number) :], number
        case _:
            pass
    return Fix(low.span.to(high.span), f"{second}{between}{first}")


# ------------------------------------------------------------------ messages


def shown(value: float) -> str:
    """Text of a number for a message."""
    return format(value, ".10g")


def excerpt(span: Span, most: int = 40) -> str:
    """Text of a span on one line, shortened if it is long."""
    text = " ".join(span.text[: 4 * most].split())
    return text if len(text) <= most else f"{text[: most - 1]}…"


def measured(powers: Powers) -> str:
    """Name of the dimension with these exponents, for a message."""
    for dimension, known in POWERS.items():
        if known == powers:
            return dimension.value
    parts = zip(("m", "s", "rad", "steps"), powers, strict=True)
    return "in " + " ".join(unit if power == 1 else f"{unit}^{power}" for unit, power in parts if power)


def resolve_parameters(context: Context, overrides: dict[str, str]) -> None:
    """Set the values of all parameters, in order of dependency.

    Args:
        overrides: values from the command line, as texts by name.
    """
    values = {param.name.text: param.value for param in context.declared(ast.Param)}
    written = dict(values)
    for name, text in overrides.items():
        if name not in values:
            context.findings.append(_unknown_parameter(name, list(values)))
            continue
        value, findings = read_quantity(name, text, context.limits)
        context.findings.extend(_from_command_line(finding, name, text) for finding in findings)
        if not findings:
            values[name] = value
    for name in ordered(context, values):
        before = len(context.findings)
        context.params[name] = evaluate(context, values[name])
        if values[name] is not written[name]:
            _same_kind(context, name, overrides[name], written[name])
            context.findings[before:] = [
                _from_command_line(finding, name, overrides[name]) for finding in context.findings[before:]
            ]
    for name in values:
        context.params.setdefault(name, NO_AMOUNT)


VALUE = "value"
"""Name of a parameter while its command-line value is parsed, since a member of a family, `p[2]`, is no valid name
there.
"""


def read_quantity(name: str, text: str, limits: Limits) -> tuple[ast.Quantity, list[Diagnostic]]:
    """Quantity that a text such as ``30 s`` or ``(2 m)`` contains, and findings about errors."""
    source = Source(f"-D {name}", f"mission override\nparam {VALUE} = {text}\n")
    program, findings = parse(source, limits, _nothing_to_include)
    everywhere = Span(source, 0, len(source.text))
    nothing = ast.Number(everywhere, 0.0)
    if findings or program is None:
        return nothing, findings
    match program.declarations:
        case (ast.MissionName(), ast.Param(name=ast.Name(text=declared), value=value)) if declared == VALUE:
            return value, []
        case _:
            return nothing, [Diagnostic(code.SYNTAX, "expected a single quantity", None)]


def _nothing_to_include(written: str, span: Span, /, *, data: bool = False) -> Diagnostic:
    return Diagnostic(code.INCLUDE_NOT_ALLOWED, "unexpected `include`", None)


def _same_kind(context: Context, name: str, text: str, written: ast.Quantity) -> None:
    """Report a command-line value whose dimension differs from the value in the mission."""
    new = context.params[name].powers
    old = evaluate(context, written).powers
    if PLAIN not in (new, old) and new != old:
        context.findings.append(
            Diagnostic(
                code.WRONG_UNIT,
                f"`{text}` is {measured(new)}; `{name}` is {measured(old)}",
                None,
                help=f"write {measured(old)}",
            )
        )
        context.params[name] = NO_AMOUNT


# ------------------------------------------------------------------ messages


def _from_command_line(finding: Diagnostic, name: str, text: str) -> Diagnostic:
    """The finding with a command-line option in place of its source location, since its text is in no file."""
    return replace(
        finding,
        message=f"in `-D {name}={text}`: {finding.message}",
        primary=None,
        labels=(),
        help=finding.help,
        fix=None,
    )


def _unknown_parameter(name: str, names: list[str]) -> Diagnostic:
    listed = f"use one of the parameters {some_of(names)}" if names else "declare `param NAME = VALUE` in the mission"
    return Diagnostic(
        code.UNKNOWN_PARAMETER,
        f"unknown parameter `{name}`",
        None,
        help=suggestion(name, names, listed),
    )
