"""Printer of the cost graph: one term a line, as ``--emit cost-graph`` shows it.

The words are the kernel's (``missionc.kernel.show``), but where a formula says
what must hold, a term says what number it has.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, assert_never

from missionc.backends.clot.cost_graph.cost_graph import (
    CostGraph,
    EveryLinked,
    Greatest,
    GreatestOver,
    Least,
    LeastOver,
    Length,
    Margin,
    Member,
    Of,
    Ranked,
    Release,
    SomeLinked,
    Term,
    Until,
    below,
)
from missionc.backends.clot.weights import AIMS, TIDY, ProbeWeights, Spare, Weights
from missionc.ir import Mission
from missionc.kernel.show import Words, asked, metres, window

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def show_cost_graph(graph: CostGraph, mission: Mission) -> str:
    """Every term once, then what is wanted of them, and what shortfalls weigh."""
    words = Words(mission)
    lines: list[str] = []
    names: dict[Term, str] = {}
    for term in graph.order:
        text = _text(term, words, tuple(names[part] for part in below(term)))
        if _inline(term):
            names[term] = text
        else:
            names[term] = f"%{len(lines) + 1}"
            lines.append(f"{names[term]} = {text}")
    goals = graph.requirements + graph.preferences
    lines.extend(f"{asked(goal.weight)} {goal.name} = {names[goal.term]}" for goal in goals)
    return "\n".join(lines) + "\n" + show_weights()


def show_weights() -> str:
    """Every figure, with its unit and what it is for, one a line."""
    shown: list[tuple[str, DataclassInstance]] = [(each.title, each()) for each in (Weights, Spare, ProbeWeights)]
    shown += [(f"minimize {goal.value}", aim) for goal, aim in AIMS.items()]
    return "".join(_shown(title, figures) for title, figures in [*shown, ("minimize nothing", TIDY)])


def _shown(title: str, figures: DataclassInstance) -> str:
    lines = []
    for each in fields(figures):
        amount = f"{getattr(figures, each.name):g} {each.metadata['unit']}".rstrip()
        lines.append(f"{title}: {each.name} = {amount} {each.metadata['says']}\n")
    return "".join(lines)


def _inline(term: Term) -> bool:
    match term:
        case Margin() | Member():
            return True
        case Least(parts) | Greatest(parts):
            return not parts
        case _:
            return False


def _text(term: Term, words: Words, parts: tuple[str, ...]) -> str:
    match term:
        case Margin(predicate, holds):
            return f"{_sign(holds)}margin({words.predicate(predicate)})"
        case Member(agents, among):
            return f"{_sign(among)}is({', '.join(words.agent(index) for index in sorted(agents))})"
        case Least():
            return f"least({', '.join(parts)})" if parts else "unlimited"
        case Greatest():
            return f"greatest({', '.join(parts)})" if parts else "-unlimited"
        case Ranked(count):
            return f"rank {count} ({', '.join(parts)})"
        case LeastOver(_, low, high):
            return f"least over {window(low, high)} {parts[0]}"
        case GreatestOver(_, low, high):
            return f"greatest over {window(low, high)} {parts[0]}"
        case Until(_, _, low, high):
            return f"{parts[0]} until {window(low, high)} {parts[1]}"
        case Release(_, _, low, high):
            return f"{parts[0]} release {window(low, high)} {parts[1]}"
        case Of(agent):
            return f"at {words.agent(agent)} {parts[0]}"
        case SomeLinked(graph):
            return f"some linked on {words.graph(graph)} {parts[0]}"
        case EveryLinked(graph):
            return f"every linked on {words.graph(graph)} {parts[0]}"
        case Length(graph, _, _, low, high, holds):
            bounds = f"route {metres(low, high)} on {words.graph(graph)}"
            if holds:
                return f"some {bounds} over {parts[0]} to {parts[1]}"
            return f"every {bounds} over some {parts[0]} or to {parts[1]}"
        case _:
            assert_never(term)


def _sign(holds: bool) -> str:
    return "" if holds else "-"
