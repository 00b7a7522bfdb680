"""Diagnostics about names in formulas: no formula, brackets not allowed, not on a graph, possibly lost.

says MC101 MC104 MC220
"""

from __future__ import annotations

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Fix, Label
from missionc.base.extensions import INSTALL
from missionc.base.trace import counted
from missionc.frontend.resolve.called_predicates import CALLED
from missionc.frontend.resolve.context import Context, some_of
from missionc.frontend.resolve.resolve_quantities import excerpt, shown
from missionc.frontend.syntax import ast


def not_a_formula(context: Context, name: ast.Name, kind: str, way_out: str, fix: Fix | None, *labels: Label) -> None:
    context.report(
        code.WRONG_KIND,
        f"expected a formula, found {kind} `{name.text}`",
        name.span,
        labels=labels,
        help=way_out,
        fix=fix,
    )


def no_such_call(context: Context, call: ast.Call) -> None:
    word = call.name.text
    if word in CALLED:
        takes = " and ".join(
            each if each.startswith("a") else f"one {each}"
            for each in CALLED[word].parameters
            if not each.endswith("?")
        )
        more = " and ".join(each[:-1] for each in CALLED[word].parameters if each.endswith("?"))
        takes += f" and optionally {more}" if more else ""
        context.report(
            code.WRONG_KIND,
            f"`{word}` takes {takes}; found {counted(len(call.arguments), 'argument')}",
            call.span,
            help=f"write, for example, `{CALLED[word].example}`",
        )
        return
    message, known = f"unknown predicate `{word}`", list(CALLED)
    otherwise = f"use one of the predicates {some_of(known)}{INSTALL}"
    context.report_unknown(code.UNKNOWN_NAME, message, call.name.span, word, known, otherwise)


def not_on_the_graph(context: Context, over: ast.Name | ast.Member, graph: ir.Graph, strangers: list[int]) -> None:
    name = context.agents[strangers[0]].name
    others = f" and {shown(len(strangers) - 1)} more" if len(strangers) > 1 else ""
    context.report(
        code.WRONG_KIND,
        f"`{name}`{others} of `{excerpt(over.span)}` is not on the graph `{graph.name}`",
        over.span,
        labels=(Label(graph.span, "declared here"),),
        help=f"name agents of the graph `{graph.name}`",
    )


def asked_of_the_lost(context: Context, part: ir.Formula, around: ast.Quantified) -> None:
    """Report a formula about an agent that may be lost, as in ``without any 1 drone: drone[0]: base``."""
    words = excerpt(around.span).split(":", 1)[0]
    help = f"move this formula outside of `{words}:`"
    if isinstance(part, ir.OfAgent):
        name = context.agents[part.agent].name
        help = f"write `every {name}: …`, which is true if `{name}` is lost"
    context.report(
        code.ASKED_OF_THE_LOST,
        f"`{excerpt(part.span)}` names an agent that may be lost",
        part.span,
        labels=(
            Label(
                around.agents.span, "one of these agents is lost" if _one(around) else "some of these agents are lost"
            ),
        ),
        help=help,
    )


def _one(around: ast.Quantified) -> bool:
    return isinstance(around.number, ast.Number) and around.number.value == 1
