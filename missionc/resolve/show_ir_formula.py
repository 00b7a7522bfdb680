"""Printer of formulas as meant, in word form: windows in steps, agents by name, a ``let`` by its name."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import assert_never

from missionc import ir
from missionc.syntax.ast import Metric


def show_formula(formula: ir.Formula, lets: dict[int, str], mission: ir.Mission) -> str:
    """The formula in words, with brackets around every operand that is not a single word or call.

    ``lets`` gives the name of a formula by its identity; such a one is not written out.
    """
    if id(formula) in lets:
        return lets[id(formula)]
    match formula:
        case ir.Truth(value, _):
            return "true" if value else "false"
        case ir.Holds(predicate, _):
            return show_predicate(predicate, mission)
        case ir.Belongs(agents, _):
            return agents.name
        case ir.AtLeastOf(kind, count, agents, body, _):
            words = kind if kind != "at least" else f"at least {count}"
            return f"{words} {agents.name}: {show_formula(body, lets, mission)}"
        case ir.OfAgent(agent, body, _):
            return f"{mission.agents[agent].name}: {show_formula(body, lets, mission)}"
        case ir.Apply():
            return _apply(formula, [_operand(operand, lets, mission) for operand in formula.operands])
        case _:
            assert_never(formula)


def _operand(formula: ir.Formula, lets: dict[int, str], mission: ir.Mission) -> str:
    text = show_formula(formula, lets, mission)
    bare = id(formula) in lets or isinstance(formula, ir.Truth | ir.Holds | ir.Belongs)
    return text if bare else f"({text})"


def _apply(formula: ir.Apply, operands: list[str]) -> str:
    word = f"{formula.operator.name}{_bounds(formula.bounds)}"
    if formula.operator.arity == 2:
        return f" {word} ".join(operands)
    compared = f" {formula.comparison} {formula.number}" if formula.comparison else ""
    return f"{word} {operands[0]}{compared}"


def _bounds(bounds: ir.Window | ir.Length | None) -> str:
    match bounds:
        case None:
            return ""
        case ir.Window(low, high, _):
            return f"[{low} steps, {'end' if high is None else f'{high} steps'}]"
        case ir.Length(graph, metric, low, high, _):
            unit = " m" if metric is Metric.METRES else ""
            upper = "" if high == math.inf else f"{number(high)}{unit}"
            return f"[{metric.value} {number(low)}{unit}..{upper} on {graph.name}]"
        case _:
            assert_never(bounds)


def show_predicate(predicate: ir.Predicate, mission: ir.Mission) -> str:
    match predicate:
        case ir.Inside(region, body):
            return f"inside({region.name})" if body else region.name
        case ir.Touches(region):
            return f"touches({region.name})"
        case ir.Compare(terms, constant, strict):
            return f"{_sum(terms, constant, mission)} {'>' if strict else '>='} 0"
        case ir.Connected(graph, agents):
            if agents == graph.agents:
                return f"connected({graph.name})"
            return f"connected({graph.name}, {', '.join(mission.agents[agent].name for agent in agents)})"
        case ir.InFormation(formation):
            return formation.name
        case _:
            assert_never(predicate)


def _sum(terms: Iterable[tuple[float, ir.Feature]], constant: float, mission: ir.Mission) -> str:
    parts = [(weight, show_feature(feature, mission)) for weight, feature in terms]
    signed = [(weight, words if abs(weight) == 1 else f"{number(abs(weight))}*{words}") for weight, words in parts]
    if constant:
        signed.append((constant, number(abs(constant))))
    first, rest = signed[0], signed[1:]
    text = f"-{first[1]}" if first[0] < 0 else first[1]
    return text + "".join(f" {'-' if weight < 0 else '+'} {words}" for weight, words in rest)


def show_feature(feature: ir.Feature, mission: ir.Mission) -> str:
    match feature:
        case ir.Coordinate(axis):
            return "xyz"[axis]
        case ir.Speed():
            return "speed"
        case ir.Altitude():
            return "altitude"
        case ir.DistanceTo(int(agent)):
            return f"distance({mission.agents[agent].name})"
        case ir.DistanceTo(ir.Region(name=name) | ir.Beacon(name=name)):
            return f"distance({name})"
        case ir.DistanceBetween(first, second):
            return f"distance({mission.agents[first].name}, {mission.agents[second].name})"
        case _:
            raise AssertionError(feature)


def number(value: float) -> str:
    """A number to twelve digits, without what rounding leaves behind: ``4.7``, ``20``."""
    return format(round(value, 12) + 0.0, ".12g")


def vector(values: Iterable[float]) -> str:
    return f"({', '.join(map(number, values))})"
