"""Resolution of resources and flags: whose they are, by how much a step changes them, and where.

says MC013 MC014 MC201 MC206 MC210
"""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.units import UNITS, Dimension
from missionc.diagnostics import code
from missionc.resolve.context import REPORTED, Context
from missionc.resolve.names import Kind, Unresolved
from missionc.resolve.resolve_agents import resolve_set
from missionc.resolve.resolve_quantities import excerpt, number, shown
from missionc.resolve.resolve_settings import missing, said_twice, unknown_word
from missionc.resolve.resolve_shapes import NOWHERE
from missionc.syntax import ast

RATES = ("start", "capacity", "drain", "refill")
MARKS = ("set", "cleared")


def resolve_resource(context: Context, resource: ast.Resource) -> ir.Resource:
    name = resource.name.text
    given: dict[tuple[str, Dimension], ast.Rate] = {}
    values: dict[tuple[str, Dimension], float] = {}
    refills: list[ir.Refill] = []
    for rate in resource.rates:
        if rate.name.text not in RATES:
            unknown_word(context, rate.name, RATES, "`resource`", "setting")
            continue
        unit = _unit(context, rate)
        value = number(context, rate.value, Dimension.NUMBER, f"`{rate.name.text}` of `{name}`", least=0)
        if rate.name.text == "refill":
            region = None if rate.within is None else _region(context, rate.within)
            if unit is not None and region is not None:
                refills.append(ir.Refill(region, _per(rate, value)))
            continue
        key = rate.name.text, unit or Dimension.NUMBER
        if key in given:
            sum_of_both = "write their sum, or leave one of them out" if rate.name.text == "drain" else None
            said_twice(context, f"`{excerpt(given[key].span)}`", rate.span, given[key].span, help=sum_of_both)
        given.setdefault(key, rate)
        values.setdefault(key, _per(rate, value))
    start = values.get(("start", Dimension.NUMBER), REPORTED)
    if not any(rate.name.text == "start" for rate in resource.rates):
        missing(context, f"the start of `{name}`", resource.name.span, "add `start 100`")
    capacity = values.get(("capacity", Dimension.NUMBER), start)
    if start > capacity:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"`{name}` starts at {shown(start)}; its capacity is {shown(capacity)}",
            given["start", Dimension.NUMBER].span,
            help=f"start at {shown(capacity)} or less, or make the capacity larger",
        )
    return ir.Resource(
        name,
        resolve_set(context, resource.agents).agents,
        start,
        capacity,
        values.get(("drain", Dimension.TIME), 0.0),
        values.get(("drain", Dimension.LENGTH), 0.0),
        tuple(refills),
        resource.name.span,
    )


def resolve_flag(context: Context, flag: ast.Flag) -> ir.Flag:
    name = flag.name.text
    marks: dict[str, ast.Mark] = {}
    for mark in flag.marks:
        word = mark.name.text
        if word not in MARKS:
            unknown_word(context, mark.name, MARKS, "`flag`", "setting")
        elif word in marks:
            one, other = marks[word].within.text, mark.within.text
            either = f"for both regions declare `region either = {one} + {other}`, and write `{word} in either`"
            union = None if one == other else either
            said_twice(context, f"`{word}`", mark.span, marks[word].span, help=union)
        else:
            marks[word] = mark
    if "set" not in marks and all(mark.name.text in MARKS for mark in flag.marks):
        missing(context, f"where `{name}` is set", flag.name.span, "add `set in REGION`")
    regions = {word: _region(context, mark.within) for word, mark in marks.items()}
    nowhere = ir.Region(name, NOWHERE, flag.span)
    agents = resolve_set(context, flag.agents).agents
    return ir.Flag(name, agents, regions.get("set", nowhere), regions.get("cleared"), flag.name.span)


def _region(context: Context, name: ast.Name) -> ir.Region:
    found = context.find(name, Kind.REGION)
    nowhere = ir.Region(name.text, NOWHERE, name.span)
    return nowhere if isinstance(found, Unresolved) else context.regions.get(name.text, nowhere)


def _unit(context: Context, rate: ast.Rate) -> Dimension | None:
    """What a rate is per; None where it is per nothing, and where it is not written as its word asks: that is said."""
    unit = None if rate.unit is None else UNITS.get(rate.unit.text, (None,))[0]
    match rate.name.text, rate.unit is not None, rate.within is not None:
        case (("start" | "capacity"), False, False):
            return None
        case "drain", True, False if unit in (Dimension.TIME, Dimension.LENGTH):
            return unit
        case "refill", True, True if unit is Dimension.TIME:
            return unit
        case ("drain", True, False) | ("refill", True, True):
            assert rate.unit is not None
            wanted = "a time or a length, such as `s` or `m`" if rate.name.text == "drain" else "a time, such as `s`"
            context.report(
                code.WRONG_UNIT,
                f"`{rate.name.text}` is per {wanted}; `{rate.unit.text}` is none",
                rate.unit.span,
                help=f"write `{_form(rate)}`",
            )
        case _:
            context.report(
                code.UNKNOWN_SETTING,
                f"`{rate.name.text}` is not given like this",
                rate.span,
                help=f"write `{_form(rate)}`",
            )
    return None


def _per(rate: ast.Rate, value: float) -> float:
    """A rate in SI units."""
    factor = 1.0 if rate.unit is None else UNITS.get(rate.unit.text, (None, math.nan))[1]
    return value / factor


def _form(rate: ast.Rate) -> str:
    written = excerpt(rate.value.span)
    match rate.name.text:
        case "drain":
            return f"drain {written} per s` or `drain {written} per m"
        case "refill":
            return f"refill {written} per s in REGION"
        case word:
            return f"{word} {written}"
