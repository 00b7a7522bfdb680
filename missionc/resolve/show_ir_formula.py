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
            return predicate.show(Words(mission))
        case ir.Belongs(agents, _):
            return agents.name
        case ir.AtLeastOf(kind, count, agents, body, _):
            words = kind if kind != "at least" else f"at least {count}"
            return f"{words} {agents.name}: {show_formula(body, lets, mission)}"
        case ir.OfAgent(agent, body, _):
            return f"{mission.agents[agent].name}: {show_formula(body, lets, mission)}"
        case ir.Without(count, agents, body):
            return f"without any {count} {agents.name}: {show_formula(body, lets, mission)}"
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
    if isinstance(formula.bounds, ir.Period):
        return f"{word}: {operands[0]}"
    if formula.operator.arity == 2:
        return f" {word} ".join(operands)
    compared = f" {formula.comparison} {formula.number}" if formula.comparison else ""
    return f"{word} {operands[0]}{compared}"


def _bounds(bounds: ir.Window | ir.Length | ir.Period | None) -> str:
    match bounds:
        case None:
            return ""
        case ir.Window(low, high, _):
            return f"[{low} steps, {'end' if high is None else f'{high} steps'}]"
        case ir.Period(steps):
            return f" {steps} steps"
        case ir.Length(graph, metric, low, high):
            unit = " m" if metric is Metric.METRES else ""
            upper = "" if high == math.inf else f"{number(high)}{unit}"
            return f"[{bounds.word} {number(low)}{unit}..{upper} on {graph.name}]"
        case _:
            assert_never(bounds)


class Words:
    """How predicates are written in word form."""

    def __init__(self, mission: ir.Mission) -> None:
        self.mission = mission

    def agent(self, index: int) -> str:
        return self.mission.agents[index].name

    def graph(self, graph: ir.Graph, agents: tuple[int, ...]) -> str:
        return graph.name if agents == graph.agents else ", ".join((graph.name, *map(self.agent, agents)))

    def angle(self, value: float) -> str:
        return f"{number(math.degrees(value))} deg"

    def inequality(self, terms: tuple[tuple[float, str], ...], constant: float, sign: str) -> str:
        signed = [(weight, word if abs(weight) == 1 else f"{number(abs(weight))}*{word}") for weight, word in terms]
        if constant:
            signed.append((constant, number(abs(constant))))
        first, rest = signed[0], signed[1:]
        text = f"-{first[1]}" if first[0] < 0 else first[1]
        return text + "".join(f" {'-' if weight < 0 else '+'} {word}" for weight, word in rest) + f" {sign} 0"


def number(value: float) -> str:
    """A number to twelve digits, without what rounding leaves behind: ``4.7``, ``20``."""
    return format(round(value, 12) + 0.0, ".12g")


def vector(values: Iterable[float]) -> str:
    return f"({', '.join(map(number, values))})"
