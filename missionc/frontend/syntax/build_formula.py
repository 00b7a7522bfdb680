"""Tree construction from the grammar rules of formulas, quantities, points, and names with indices.

The grammar cannot distinguish a number from a formula: ``(x`` may continue as ``(x and y)`` or as ``(x + 1) <= 2``. The
functions therefore check again. ``build`` has the other rules.
"""

from __future__ import annotations

from dataclasses import replace

from missionc.base.diagnostics.code import SYNTAX, UNKNOWN_NAME
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.source import Span
from missionc.base.units import Metric
from missionc.frontend.syntax import ast
from missionc.frontend.syntax.tokens import Token, quoted


def number(span: Span, value: Token, unit: Token | None) -> ast.Number:
    if unit is None:
        return ast.Number(span, float(value.text))
    return ast.Number(span, float(value.text), unit.text, unit.span)


def negative(span: Span, sign: Token, body: ast.Quantity) -> ast.Negative:
    return ast.Negative(span, body)


def arithmetic(span: Span, left: ast.Quantity, sign: Token, right: ast.Quantity) -> ast.Arithmetic:
    return ast.Arithmetic(span, sign.text, left, right)


def extreme(span: Span, word: Token, *parts: ast.Quantity) -> ast.Extreme:
    return ast.Extreme(span, word.text, parts)


def member(span: Span, team: ast.Name, low: ast.Quantity, high: ast.Quantity | None) -> ast.Member:
    return ast.Member(span, team, low, high)


def family(span: Span, name: ast.Name, *indices: ast.Index) -> ast.FamilyName:
    return ast.FamilyName(name.span, name.text, indices, span)


def indexed(span: Span, name: ast.Name, *indices: ast.Quantity) -> ast.Indexed:
    return ast.Indexed(name.span, name.text, indices, span)


def of_team_or_family(span: Span, name: ast.Indexed) -> ast.Member | ast.Indexed:
    """Node of ``drone[2]`` or ``rack[2, 3]``; only the second is certainly a member of a family."""
    if len(name.indices) > 1:
        return name
    return ast.Member(span, ast.Name(name.span, name.text), name.indices[0])


class MisreadError(Exception):
    """Error: each token is allowed, but together they have no meaning."""

    def __init__(self, finding: Diagnostic) -> None:
        super().__init__(finding.message)
        self.finding = finding


def infix(span: Span, left: ast.Formula, operator: Token, right: ast.Formula) -> ast.Apply:
    return ast.Apply(span, operator.word, operator.span, (as_formula(left), as_formula(right)))


def chain(span: Span, *parts: ast.Formula | Token) -> ast.Apply:
    """Node of ``a and b and c``: one operator with many operands."""
    operator = parts[1]
    assert isinstance(operator, Token)
    operands = tuple(as_formula(part) for part in parts if not isinstance(part, Token))
    return ast.Apply(span, operator.word, operator.span, operands)


def bounded_infix(
    span: Span, left: ast.Formula, operator: Token, bounds: ast.Window | ast.Length, right: ast.Formula
) -> ast.Apply:
    return replace(infix(span, left, operator, right), bounds=bounds)


def prefix(span: Span, operator: Token, body: ast.Formula) -> ast.Apply:
    return ast.Apply(span, operator.word, operator.span, (as_formula(body),))


def bounded_prefix(span: Span, operator: Token, bounds: ast.Window | ast.Length, body: ast.Formula) -> ast.Apply:
    return ast.Apply(span, operator.word, operator.span, (as_formula(body),), bounds)


def count(
    span: Span, operator: Token, length: ast.Length, body: ast.Formula, relation: Token, value: ast.Quantity
) -> ast.Apply:
    return ast.Apply(span, operator.word, operator.span, (as_formula(body),), length, relation.text, value)


def quantified(span: Span, kind: Token, agents: ast.Name | ast.Member, body: ast.Formula) -> ast.Quantified:
    return ast.Quantified(span, kind.word, None, agents, as_formula(body))


def recurrent(span: Span, kind: Token, every: ast.Period, body: ast.Formula) -> ast.Apply:
    """Node of a recurrence, ``every 40 s: f``."""
    return ast.Apply(span, kind.word, kind.span, (as_formula(body),), every)


def at_least(span: Span, least: ast.Quantity, agents: ast.Name | ast.Member, body: ast.Formula) -> ast.Quantified:
    return ast.Quantified(span, "at least", least, agents, as_formula(body))


def without(span: Span, number: ast.Quantity, agents: ast.Name | ast.Member, body: ast.Formula) -> ast.Quantified:
    return ast.Quantified(span, "without any", number, agents, as_formula(body))


def one_agent(span: Span, name: ast.Name | ast.Member, body: ast.Formula) -> ast.OneAgent:
    return ast.OneAgent(span, name, as_formula(body))


def term(span: Span, left: ast.Formula, sign: Token, right: ast.Formula) -> ast.Arithmetic:
    return ast.Arithmetic(span, sign.text, as_quantity(left), as_quantity(right))


def minus(span: Span, sign: Token, body: ast.Formula) -> ast.Negative:
    return ast.Negative(span, as_quantity(body))


def comparison(span: Span, left: ast.Formula, relation: Token, right: ast.Formula) -> ast.Compare:
    return ast.Compare(span, relation.text, as_quantity(left), as_quantity(right))


def for_every(span: Span, word: Token, *parts: ast.Index | ast.Formula) -> ast.ForEach:
    return _for_each(span, "every", word, parts)


def for_some(span: Span, word: Token, some: Token, *parts: ast.Index | ast.Formula) -> ast.ForEach:
    return _for_each(span, "some", word, parts)


def _for_each(span: Span, kind: str, word: Token, parts: tuple[ast.Index | ast.Formula, ...]) -> ast.ForEach:
    indices = tuple(part for part in parts if isinstance(part, ast.Index))
    body = parts[-1]
    assert not isinstance(body, ast.Index)
    return ast.ForEach(span, kind, word.span, indices, as_formula(body))


def call(span: Span, name: ast.Name, *arguments: ast.Formula | ast.Quantity) -> ast.Call:
    return ast.Call(span, name, tuple(map(_argument, arguments)))


def extreme_of_terms(span: Span, word: Token, *parts: ast.Formula | ast.Quantity) -> ast.Extreme:
    return ast.Extreme(span, word.text, tuple(map(as_quantity, parts)))


def true(span: Span) -> ast.Truth:
    return ast.Truth(span, True)


def false(span: Span) -> ast.Truth:
    return ast.Truth(span, False)


def window(span: Span, low: ast.Quantity, high: ast.Quantity | None = None) -> ast.Window:
    return ast.Window(span, low, high)


def length_between(
    span: Span, unit: Token | ast.Name, low: ast.Quantity | None, high: ast.Quantity | None, graph: ast.Name | None
) -> ast.Length:
    if isinstance(unit, ast.Name):
        return ast.Length(span, Metric.WEIGHT, low, high, graph, unit)
    return ast.Length(span, Metric(unit.word), low, high, graph)


def length_up_to(span: Span, unit: Token | ast.Name, high: ast.Quantity, graph: ast.Name | None) -> ast.Length:
    return length_between(span, unit, None, high, graph)


def length_from(span: Span, unit: Token | ast.Name, low: ast.Quantity, graph: ast.Name | None) -> ast.Length:
    return length_between(span, unit, low, None, graph)


# ------------------------------------------------------------------ messages


def as_formula(node: ast.Formula | ast.Quantity) -> ast.Formula:
    match node:
        case ast.Number() | ast.Negative() | ast.Arithmetic() | ast.Extreme() | ast.Distance():
            text = quoted(node.span.text)
            finding = Diagnostic(
                SYNTAX,
                f"expected a formula, found the number {text}",
                Label(node.span),
                help=f"compare the number, for example `{node.span.text} <= 2`"
                if len(text) <= 30
                else "compare the value with another number",
            )
            raise MisreadError(finding)
        case _:
            return node


def _argument(node: ast.Formula | ast.Quantity) -> ast.Quantity | ast.Member:
    match node:
        case ast.Name() | ast.Member() | ast.Number() | ast.Negative() | ast.Arithmetic() | ast.Extreme():
            return node
        case _:
            message = f"expected a name or a number in the parentheses, found {quoted(node.span.text)}"
            advice = "write the name of a region, a graph or a team"
            raise MisreadError(Diagnostic(SYNTAX, message, Label(node.span), help=advice))


def _no_measure(call: ast.Call) -> Diagnostic:
    message = f"unknown quantity {quoted(call.name.text)}"
    advice = "use `distance(…)`, `x`, `y`, `z`, `speed` or `altitude`"
    return Diagnostic(UNKNOWN_NAME, message, Label(call.name.span), help=advice)


def as_quantity(node: ast.Formula | ast.Quantity) -> ast.Quantity:
    match node:
        case ast.Name() | ast.Number() | ast.Negative() | ast.Arithmetic() | ast.Extreme() | ast.Distance():
            return node
        case ast.Member(span, team, low, None) if not isinstance(team, ast.Indexed):
            return ast.Indexed(team.span, team.text, (low,), span)
        case _:
            if isinstance(node, ast.Call) and node.name.text not in ("inside", "touches", "connected"):
                raise MisreadError(_no_measure(node))
            finding = Diagnostic(
                SYNTAX,
                f"expected a number, found the formula {quoted(node.span.text)}",
                Label(node.span),
                help="compare numbers only, for example `x + 2 <= 3`",
            )
            raise MisreadError(finding)
