"""The scope of operators before their operand: one left of ``reach``, ``until`` or their like ends before it.

says MC015
"""

from __future__ import annotations

from missionc.base.source import Span
from missionc.diagnostics import code
from missionc.diagnostics.model import Fix, Label
from missionc.language.operator import Bounds, Fixity
from missionc.language.operators import by_name
from missionc.resolve.context import Context
from missionc.resolve.resolve_quantities import excerpt
from missionc.syntax import ast


def check_prefix_scope(context: Context, formula: ast.Apply) -> None:
    """Reports operators without parentheses that may be meant of the whole formula, and are asked of its left side.

    ``not f reach[…] g`` is left alone: read aloud, ``not f`` is one condition.
    """
    operator = by_name.get(formula.operator)
    if operator is None or operator.fixity is not Fixity.INFIX or operator.bounds is Bounds.NONE:
        return
    first = _bare_prefix(formula)
    if first is None:
        return
    last = first
    body = first.operands[0]
    while isinstance(body, ast.Apply) and _is_prefix(body) and body.span.end == first.span.end:
        if not _denies(body):
            last = body
        body = body.operands[0]
    if not _denies(last):
        _ends_early(context, formula, first, last.operands[0])


def _bare_prefix(formula: ast.Apply) -> ast.Apply | None:
    """The operator before its operand that ends, without a parenthesis, where this infix operator begins."""
    part, end = formula.operands[0], formula.operands[0].span.end
    if part.span.start != formula.span.start:
        return None
    while isinstance(part, ast.Apply) and part.span.end == end:
        if _is_prefix(part):
            return part
        part = part.operands[-1]
    return None


def _is_prefix(formula: ast.Apply) -> bool:
    operator = by_name.get(formula.operator)
    return operator is not None and operator.fixity is Fixity.PREFIX and formula.number is None


def _denies(formula: ast.Apply) -> bool:
    return formula.operator == "not"


# ------------------------------------------------------------------ messages


def _ends_early(context: Context, formula: ast.Apply, prefix: ast.Apply, body: ast.Formula) -> None:
    source, begin = formula.span.source, prefix.span.start
    words = body.span.part(begin, begin + len(source.text[begin : body.span.start].rstrip().rstrip("(").rstrip()))
    after = source.text[words.end : prefix.span.end]
    whole = formula.span.part(prefix.span.end - len(after.lstrip()), formula.span.end)
    left = formula.span.part(formula.span.start, prefix.span.end)
    asked = excerpt(Span(source, whole.start, prefix.span.end))
    right = f"{formula.operator}[…] {_right(formula)}"
    context.report(
        code.ENDS_EARLY,
        f"`{excerpt(words)}` is asked of `{asked}` alone: it ends before `{formula.operator}`",
        words,
        labels=(Label(formula.operator_span, f"its left side is `{excerpt(left, 60)}`"),),
        help=f"write `{excerpt(words)} ({asked} {right})` to ask it of the whole, or"
        f" `({excerpt(prefix.span, 60)}) {right}` for what it says now",
        fix=Fix(whole, f"({whole.text})"),
    )


def _right(formula: ast.Apply) -> str:
    """The right side as it is written, its parentheses included."""
    begin = formula.span.start if formula.bounds is None else formula.bounds.span.end
    return excerpt(Span(formula.span.source, begin, formula.span.end)).lstrip("] ")
