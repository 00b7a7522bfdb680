"""Check that agents whose heading is compared have a heading.

    in   Mission
    out  nothing but findings
    says MC222

The heading is a state of dynamics that move in the direction in which they face. Other dynamics do not define it.
"""

from __future__ import annotations

from collections.abc import Iterator

from missionc.base.diagnostics.code import NO_HEADING
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.source import Span
from missionc.ir import Agent, Holds, Mission
from missionc.ir.dynamics import DYNAMICS
from missionc.ir.language.walk_formulas import asked_agents
from missionc.ir.wording import all_listed, listed


def check_headings(mission: Mission) -> list[Diagnostic]:
    """Findings about heading predicates that are evaluated for agents without a heading, one for each predicate."""
    return list(_without_heading(mission))


def _without_heading(mission: Mission) -> Iterator[Diagnostic]:
    said: set[Span] = set()
    for formula, agents in asked_agents(mission):
        if isinstance(formula, Holds) and formula.predicate.reads_heading and formula.span not in said:
            lacking = [mission.agents[each] for each in agents if not mission.agents[each].dynamics.faces_ahead]
            if lacking:
                said.add(formula.span)
                yield _no_heading(formula.span, lacking)


def _no_heading(span: Span, lacking: list[Agent]) -> Diagnostic:
    names = listed([f"`{agent.name}`" for agent in lacking])
    word, able = lacking[0].dynamics.word, all_listed([f"`{kind.word}`" for kind in DYNAMICS if kind.faces_ahead])
    return Diagnostic(
        NO_HEADING,
        f"{names} {'have' if len(lacking) > 1 else 'has'} no heading",
        Label(span, "the formula uses a heading"),
        labels=(Label(lacking[0].span, f"`{word}` dynamics have no heading"),),
        help=f"use dynamics with a heading: {able}",
    )
