"""Type checking of formulas: about one agent or about the team, and the messages where the two are mixed up.

Each formula is first judged from its operands up (``joined``); a place that
needs one of the two then looks down for the operands that are about the other
(``check``), so that a message names them and not the whole formula.

    says MC203 MC204
"""

from __future__ import annotations

from collections.abc import Iterator

from missionc import ir
from missionc.diagnostics import code
from missionc.diagnostics.model import Fix, Label
from missionc.ir import About
from missionc.resolve.context import Context
from missionc.resolve.resolve_quantities import excerpt
from missionc.resolve.typed import Typed


def check(context: Context, formula: Typed, needed: About, asker: str) -> None:
    """Reports every operand that is not about ``needed``; ``asker`` says what needs it (``every drone:``)."""
    others = list(_about(formula, needed))
    for operand in _not_about(formula, needed):
        if needed is About.TEAM:
            _quantifier_missing(context, operand, others, whole=operand is formula)
        else:
            _quantifier_too_many(context, operand, asker, beside=formula.mixed)


def check_definition(context: Context, formula: Typed) -> Typed:
    """A ``let`` may be about either, but not about both; a mixed one is reported here and fits everywhere."""
    if not formula.mixed:
        return formula
    check(context, formula, About.TEAM, "")
    return Typed(formula.formula, About.EITHER, formula.span, size=formula.size, depth=formula.depth)


def _not_about(formula: Typed, needed: About) -> Iterator[Typed]:
    """The largest operands that are about the other of the two."""
    if formula.mixed:
        for operand in formula.operands:
            yield from _not_about(operand, needed)
    elif formula.about not in (needed, About.EITHER):
        yield formula


def _about(formula: Typed, needed: About) -> Iterator[Typed]:
    if formula.mixed:
        for operand in formula.operands:
            yield from _about(operand, needed)
    elif formula.about is needed:
        yield formula


# ------------------------------------------------------------------ messages


def _quantifier_missing(context: Context, operand: Typed, others: list[Typed], whole: bool) -> None:
    text = excerpt(operand.span)
    teams = list(context.sets)
    who = teams[0] if teams else "TEAM"
    words = f"every {who}: {text}"
    complete = text == operand.span.text
    if isinstance(operand.formula, ir.Belongs):
        _nothing_asked(context, operand, others)
        return
    context.report(
        code.QUANTIFIER_MISSING,
        f"`{text}` is about one agent; it does not say which",
        operand.span,
        labels=tuple(Label(other.span, "this is about the team") for other in others[:1]),
        help=f"write `{words}`, or `some {who}: …`" if whole else f"write `({words})`, or `(some {who}: …)`",
        fix=Fix(operand.span, words if whole else f"({words})") if complete and teams else None,
    )


def _nothing_asked(context: Context, operand: Typed, others: list[Typed]) -> None:
    """``truck and drone[0]: base``"""
    text = excerpt(operand.span)
    single = isinstance(operand.formula, ir.Belongs) and len(operand.formula.agents.agents) == 1
    context.report(
        code.QUANTIFIER_MISSING,
        f"`{text}` by itself asks whether an agent belongs to it; this does not say which agent",
        operand.span,
        labels=tuple(Label(other.span, "this is about the team") for other in others[:1]),
        help=f"ask something of it, as in `({text if single else f'every {text}'}: f)`",
    )


def _quantifier_too_many(context: Context, operand: Typed, asker: str, beside: bool) -> None:
    if beside and asker.endswith(":") and isinstance(operand.formula, ir.AtLeastOf | ir.OfAgent):
        way_out = f"end what `{asker}` asks before it, with brackets: `({asker} …)`; or leave its quantifier out"
    elif isinstance(operand.formula, ir.AtLeastOf | ir.OfAgent) and operand.span == operand.formula.span:
        way_out = "leave its quantifier out"
    else:
        way_out = f"take it out of `{asker}`"
    context.report(
        code.QUANTIFIER_TOO_MANY,
        f"`{excerpt(operand.span)}` is about the team; `{asker}` asks about one agent",
        operand.span,
        help=way_out,
    )
