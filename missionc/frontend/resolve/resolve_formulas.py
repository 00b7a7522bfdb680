"""Resolution of formulas, with their type check: names, bounds in steps and hops, and shared ``let`` objects.

    says MC005 MC008 MC015 MC101 MC104 MC109 MC201 MC203 MC204 MC207 MC208 MC209 MC210 MC220

A formula is about one agent or about the team. This is first determined from its operands up (``joined``). A context
that needs one of the two then searches down for the operands of the other kind (``check``), so that a message names
them and not the complete formula.

An operator before its operand ends before ``reach``, ``until`` and the like on its right.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import assert_never

from missionc import ir
from missionc.base.diagnostics import code
from missionc.base.diagnostics.defect import extension_error
from missionc.base.diagnostics.model import Fix, Label
from missionc.base.extensions import ExtensionError, Unfit, guard
from missionc.base.extensions import Kind as Registered
from missionc.base.source import Span
from missionc.base.units import Dimension
from missionc.frontend.resolve.called_predicates import CALLED
from missionc.frontend.resolve.context import (
    AGENTS,
    REPORTED,
    STATE_WORDS,
    UNRESOLVED,
    Context,
    Kind,
    Typed,
    Unresolved,
    joined,
    ordered,
)
from missionc.frontend.resolve.formula_findings import asked_of_the_lost, no_such_call, not_a_formula, not_on_the_graph
from missionc.frontend.resolve.lost_agents import named_members, without_any
from missionc.frontend.resolve.resolve_agents import resolve_set
from missionc.frontend.resolve.resolve_comparisons import (
    compared_agent,
    no_graph,
    resolve_comparison,
    resolve_facing,
    resolve_length,
)
from missionc.frontend.resolve.resolve_quantities import excerpt, resolved_number, shown, whole
from missionc.frontend.resolve.resolve_shapes import NOWHERE
from missionc.frontend.resolve.resolve_time import resolve_period, resolve_window
from missionc.frontend.resolve.spell_out import no_family
from missionc.frontend.syntax import ast
from missionc.ir import About
from missionc.ir.language.operator import Bounds, Fixity, Operator
from missionc.ir.language.operators import by_name
from missionc.ir.language.predicates import Predicate


def check(context: Context, formula: Typed, needed: About, asker: str) -> None:
    """Report every operand whose subject, one agent or the team, is not ``needed``.

    Args:
        asker: text of the context that needs it, such as ``every drone:``.
    """
    others = list(_about(formula, needed))
    for operand in _not_about(formula, needed):
        if needed is About.TEAM:
            _quantifier_missing(context, operand, others, whole=operand is formula)
        else:
            _quantifier_too_many(context, operand, asker, beside=formula.mixed)


def check_definition(context: Context, formula: Typed) -> Typed:
    """Report a ``let`` that is about both one agent and the team; it then fits everywhere."""
    if not formula.mixed:
        return formula
    check(context, formula, About.TEAM, "")
    return Typed(formula.formula, About.EITHER, formula.span, size=formula.size, depth=formula.depth)


def _not_about(formula: Typed, needed: About) -> Iterator[Typed]:
    """Yield the largest operands with the other subject."""
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
        f"`{text}` needs an agent or a quantifier",
        operand.span,
        labels=tuple(Label(other.span, "this formula is about the team") for other in others[:1]),
        help=f"write `{words}`" if whole else f"write `({words})`",
        fix=Fix(operand.span, words if whole else f"({words})") if complete and teams else None,
    )


def _nothing_asked(context: Context, operand: Typed, others: list[Typed]) -> None:
    """Report a membership test without an agent, such as ``truck`` in ``truck and drone[0]: base``."""
    text = excerpt(operand.span)
    single = isinstance(operand.formula, ir.Belongs) and len(operand.formula.agents.agents) == 1
    context.report(
        code.QUANTIFIER_MISSING,
        f"`{text}` alone is a membership test without an agent",
        operand.span,
        labels=tuple(Label(other.span, "this formula is about the team") for other in others[:1]),
        help=f"add a formula, for example `({text if single else f'every {text}'}: f)`",
    )


def _quantifier_too_many(context: Context, operand: Typed, asker: str, beside: bool) -> None:
    if beside and asker.endswith(":") and isinstance(operand.formula, ir.AtLeastOf | ir.OfAgent):
        way_out = f"close `{asker}` before this formula with parentheses: `({asker} …)`"
    elif isinstance(operand.formula, ir.AtLeastOf | ir.OfAgent) and operand.span == operand.formula.span:
        way_out = "delete its quantifier"
    else:
        way_out = f"move this formula out of `{asker}`"
    context.report(
        code.QUANTIFIER_TOO_MANY,
        f"`{excerpt(operand.span)}` is about the team; `{asker}` needs a formula about one agent",
        operand.span,
        help=way_out,
    )


def check_prefix_scope(context: Context, formula: ast.Apply) -> None:
    """Report operators without parentheses that apply to the left side only and may be meant for the complete formula.

    ``not f reach[…] g`` is allowed: read aloud, ``not f`` is one condition.
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
    """Prefix operator without a parenthesis whose operand ends at this infix operator; None if there is none."""
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
        f"`{excerpt(words)}` applies to `{asked}` alone: it ends before `{formula.operator}`",
        words,
        labels=(Label(formula.operator_span, f"the left operand is `{excerpt(left, 60)}`"),),
        help=f"write `{excerpt(words)} ({asked} {right})` to apply it to the whole, or"
        f" `({excerpt(prefix.span, 60)}) {right}` to keep this meaning",
        fix=Fix(whole, f"({whole.text})"),
    )


def _right(formula: ast.Apply) -> str:
    """Source text of an infix operator's right side, with its parentheses."""
    begin = formula.span.start if formula.bounds is None else formula.bounds.span.end
    return excerpt(Span(formula.span.source, begin, formula.span.end)).lstrip("] ")


AS_FORMULA = {
    Kind.PARAM: "compare the parameter, for example `x <= {name}`",
    Kind.OBSTACLE: "declare a region with the same shape",
    Kind.BEACON: "compare its distance: `distance({name}) <= 2 m`",
    Kind.RESOURCE: "compare the resource, for example `{name} >= 15`",
    Kind.GRAPH: "write `connected({name})`",
}
"""Suggested formula for a name that is not a formula, by its kind."""

FORMULAS = (Kind.REGION, *AGENTS, Kind.FORMATION, Kind.FLAG, Kind.LET)


def resolve_lets(context: Context) -> None:
    """Resolve every named formula, in order of dependency."""
    lets = {let.name.text: let for let in context.declared(ast.Let)}
    for name in ordered(context, {name: let.body for name, let in lets.items()}):
        context.lets[name] = check_definition(context, resolve_formula(context, lets[name].body))


def resolve_goal(context: Context, formula: ast.Formula) -> ir.Formula:
    """Formula of a requirement or preference, which must be about the team."""
    resolved = resolve_formula(context, formula)
    check(context, resolved, About.TEAM, "require")
    return resolved.formula


def resolve_formula(context: Context, formula: ast.Formula) -> Typed:
    match formula:
        case ast.Truth(span=span, value=value):
            return Typed(ir.Truth(value, span), About.EITHER, span)
        case ast.Name():
            return _name(context, formula)
        case ast.Member(span=span):
            return Typed(ir.Belongs(resolve_set(context, formula), span), About.AGENT, span)
        case ast.Call():
            return _call(context, formula)
        case ast.Compare():
            return resolve_comparison(context, formula)
        case ast.Facing():
            return resolve_facing(context, formula)
        case ast.Apply():
            return _within_limits(context, _apply(context, formula))
        case ast.Quantified():
            return _within_limits(context, _quantified(context, formula))
        case ast.OneAgent():
            return _within_limits(context, _one_agent(context, formula))
        case ast.ForEach():
            raise AssertionError(formula)  # expanded before
        case _:
            assert_never(formula)


def stand_in(span: Span) -> Typed:
    """Replacement for a formula that is invalid and has been reported; it fits everywhere."""
    return Typed(ir.Truth(True, span), About.EITHER, span)


# ---------------------------------------------------------------- predicates


def _name(context: Context, name: ast.Name) -> Typed:
    text, span = name.text, name.span
    declared = context.names.declared.get(text)
    if text in STATE_WORDS:
        not_a_formula(context, name, "a state", f"compare the state, for example `{text} <= 1`", None)
        return stand_in(span)
    if declared is not None and declared.kind in AS_FORMULA:
        way_out = AS_FORMULA[declared.kind].format(name=text)
        fix = Fix(span, f"connected({text})") if declared.kind is Kind.GRAPH else None
        not_a_formula(context, name, declared.kind.value, way_out, fix, Label(declared.span, "declared here"))
        return stand_in(span)
    called = None if declared else called_predicate(context, name)
    if declared is None and called is not None:
        context.report(
            code.UNKNOWN_NAME,
            f"`{text}` needs {called.parameters[0]} in parentheses",
            span,
            help=f"write, for example, `{called.example}`",
        )
        return stand_in(span)
    declaration = context.find(name, *FORMULAS, needed="a formula")
    if isinstance(declaration, Unresolved):
        return stand_in(span)
    if declaration.kind is Kind.LET:
        let = context.lets.get(text, stand_in(span))
        return Typed(let.formula, let.about, span, size=let.size, depth=let.depth)
    if declaration.kind is Kind.REGION:
        region = context.regions.get(text, ir.Region(text, NOWHERE, span))
        return Typed(ir.Holds(ir.Inside(region, body=False), span), About.AGENT, span)
    if declaration.kind is Kind.FORMATION:
        return Typed(ir.Holds(ir.InFormation(context.formations[text]), span), About.TEAM, span)
    if declaration.kind is Kind.FLAG:
        return Typed(ir.Holds(ir.Flagged(context.flags[text]), span), About.AGENT, span)
    return Typed(ir.Belongs(resolve_set(context, name), span), About.AGENT, span)


def _call(context: Context, call: ast.Call) -> Typed:
    called = called_predicate(context, call.name)
    if called is None or called.meant is None:
        if called is not None or call.name.text not in CALLED:
            no_such_call(context, call)
        return stand_in(call.span)
    match called.parameters, call.arguments:
        case kinds, arguments if len(kinds) == len(arguments) and ARGUMENTS.keys() >= set(kinds):
            values = [ARGUMENTS[kind](context, each) for kind, each in zip(kinds, arguments, strict=True)]
            if not all(map(_is_known, values)):
                return stand_in(call.span)
            try:
                with guard(Registered.PREDICATE, called.name, Unfit):
                    predicate = called.meant(*values)
            except Unfit as error:
                context.report(code.VALUE_OUT_OF_RANGE, f"`{excerpt(call.span)}`: {error}", call.span)
                return stand_in(call.span)
            except ExtensionError as error:
                context.findings.append(extension_error(error, call.span))
                return stand_in(call.span)
        case ("graph", "agents?", "a number?"), (graph, *rest):
            number = rest.pop() if rest and _is_number(context, rest[-1]) else None
            over = tuple(each for each in rest if isinstance(each, ast.Name | ast.Member))
            if len(rest) > 1 or len(over) < len(rest):
                no_such_call(context, call)
                return stand_in(call.span)
            on, some = _graph_and_agents(context, graph, over)
            agents = on.agents if some is None else some
            order = 1 if number is None else _order(context, number, on, len(agents))
            holds = ir.Holds(called.meant(on, agents, order), call.span)
            size = 1.0 if order == 1 else math.comb(len(agents), order - 1) * len(agents)
            return _within_limits(context, Typed(holds, called.about, call.span, size=size))
        case _:
            no_such_call(context, call)
            return stand_in(call.span)
    return Typed(ir.Holds(predicate, call.span), called.about, call.span)


def called_predicate(context: Context, name: ast.Name) -> Predicate | None:
    """Predicate written with this name and brackets; None if there is none or its extension fails (reported)."""
    try:
        return CALLED.get(name.text)
    except ExtensionError as error:
        context.findings.append(extension_error(error, name.span))
        return None


def _is_number(context: Context, argument: ast.Quantity | ast.Member) -> bool:
    """Return whether an argument is a number: written, computed, or the name of a parameter."""
    if isinstance(argument, ast.Name):
        declared = context.names.declared.get(argument.text)
        return declared is not None and declared.kind is Kind.PARAM
    return not isinstance(argument, ast.Member)


def _order(context: Context, number: ast.Quantity | ast.Member, graph: ir.Graph, agents: int) -> int:
    """Number of agents whose loss may disconnect a graph; an invalid number is reported and replaced by 1."""
    assert not isinstance(number, ast.Member)
    value = whole(context, number, f"the connectivity order of `{graph.name}`", least=1)
    if agents == 0 or math.isnan(value):
        return 1
    if value >= agents and value > 1:
        context.report(
            code.VALUE_OUT_OF_RANGE,
            f"the connectivity order {shown(value)} is too high for {agents} agents",
            number.span,
            labels=(Label(graph.span, "declared here"),),
            help=f"write a number from 1 to {max(1, agents - 1)}",
        )
        return 1
    return int(value)


def _region(context: Context, argument: ast.Quantity | ast.Member) -> ir.Region:
    nowhere = ir.Region(excerpt(argument.span), NOWHERE, argument.span)
    name = _whole_name(context, argument, Kind.REGION)
    return nowhere if isinstance(name, Unresolved) else context.regions.get(name, nowhere)


def _beacon(context: Context, argument: ast.Quantity | ast.Member) -> ir.Beacon | Unresolved:
    name = _whole_name(context, argument, Kind.BEACON)
    return name if isinstance(name, Unresolved) else context.beacons.get(name, UNRESOLVED)


def _number_of(dimension: Dimension) -> Callable[[Context, ast.Quantity | ast.Member], float]:
    def value(context: Context, argument: ast.Quantity | ast.Member) -> float:
        if isinstance(argument, ast.Member):
            _whole_name(context, argument, Kind.PARAM)
            return REPORTED
        return resolved_number(context, argument, dimension, f"`{excerpt(argument.span)}`")

    return value


def _is_known(value: object) -> bool:
    """Return whether an argument is valid; False if it was reported."""
    return not (isinstance(value, Unresolved) or (isinstance(value, float) and math.isnan(value)))


ARGUMENTS: dict[str, Callable[[Context, ast.Quantity | ast.Member], object]] = {
    "region": _region,
    "beacon": _beacon,
    **{each.value: _number_of(each) for each in Dimension},
}
"""Function that resolves an argument of a predicate, for each kind of argument."""


def _graph_and_agents(
    context: Context, argument: ast.Quantity | ast.Member, over: tuple[ast.Name | ast.Member, ...]
) -> tuple[ir.Graph, tuple[int, ...] | None]:
    name = _whole_name(context, argument, Kind.GRAPH)
    nothing = no_graph(argument.span)
    graph = nothing if isinstance(name, Unresolved) else context.graphs.get(name, nothing)
    if not over:
        return graph, None
    agents = resolve_set(context, over[0]).agents
    strangers = sorted(set(agents) - set(graph.agents))
    if strangers and graph.agents:
        not_on_the_graph(context, over[0], graph, strangers)
    return graph, agents


def _whole_name(context: Context, argument: ast.Quantity | ast.Member, kind: Kind) -> str | Unresolved:
    """Name of a declaration of one kind, or ``UNRESOLVED``; members of a team and numbers are reported."""
    if isinstance(argument, ast.Name):
        declared = context.find(argument, kind)
        return declared if isinstance(declared, Unresolved) else argument.text
    owner = context.names.declared.get(argument.team.text) if isinstance(argument, ast.Member) else None
    if owner is not None and owner.kind is not Kind.TEAM:
        no_family(context, owner.declaration.name, owner.kind, argument.span)
        return UNRESOLVED
    context.report(
        code.WRONG_KIND,
        f"expected {kind.value}, found {'a member of a team' if isinstance(argument, ast.Member) else 'a number'}"
        f" `{excerpt(argument.span)}`",
        argument.span,
        help=f"name {kind.value}",
    )
    return UNRESOLVED


# ----------------------------------------------------------------- operators


def _apply(context: Context, formula: ast.Apply) -> Typed:
    typed: list[Typed] = []
    for written in formula.operands:  # a comprehension would add a stack frame at each level
        typed.append(resolve_formula(context, written))  # noqa: PERF401
    operands = tuple(typed)
    operator = by_name.get(formula.operator)
    if operator is None:
        context.report(code.UNKNOWN_OPERATOR, f"unknown operator `{formula.operator}`", formula.operator_span)
        return stand_in(formula.span)
    resolved = ir.Apply(
        operator,
        tuple(operand.formula for operand in operands),
        _bounds(context, formula, operator),
        formula.span,
        formula.comparison or "",
        _count(context, formula),
    )
    check_prefix_scope(context, formula)
    size, depth = _grown(operands)
    if operator.spatial:
        for operand in operands:
            check(context, operand, About.AGENT, operator.name)
        return Typed(resolved, About.AGENT, formula.span, size=size, depth=depth)
    about, mixed = joined(operands)
    return Typed(resolved, about, formula.span, operands, mixed, size, depth)


def _bounds(context: Context, formula: ast.Apply, operator: Operator) -> ir.Window | ir.Length | ir.Period | None:
    match operator.bounds, formula.bounds:
        case Bounds.NONE, None:
            return None
        case Bounds.TIME, ast.Window() as window:
            return resolve_window(context, window)
        case Bounds.PAST, ast.Window() as window if window.high is not None:
            return resolve_window(context, window)
        case Bounds.LENGTH, ast.Length() as length:
            return resolve_length(context, length)
        case Bounds.PERIOD, ast.Period() as period:
            return resolve_period(context, period)
        case _:
            context.report(
                code.WRONG_UNIT,
                f"`{operator.name}` takes {operator.bounds.value}",
                formula.operator_span if formula.bounds is None else formula.bounds.span,
                help=f"write, for example, `{operator.example}`",
            )
            return None


def _count(context: Context, formula: ast.Apply) -> int:
    if formula.number is None:
        return 0
    value = whole(context, formula.number, "the number of agents")
    return 0 if math.isnan(value) else int(value)


def _grown(operands: tuple[Typed, ...]) -> tuple[float, int]:
    return 1 + sum(operand.size for operand in operands), 1 + max(operand.depth for operand in operands)


def _within_limits(context: Context, formula: Typed) -> Typed:
    """The formula itself; if it is too large or too deep after expansion of ``let``, report it once."""
    limits = context.limits
    if formula.size > limits.formula_nodes:
        context.report(
            code.TOO_LARGE_TO_EXPAND,
            f"the formula has {shown(formula.size)} parts with every `let` expanded;"
            f" the limit is {limits.formula_nodes}",
            formula.span,
            help="raise the limit with `--limit formula_nodes=VALUE`",
        )
        return replace(formula, size=math.nan)
    if formula.depth > limits.nesting and not math.isnan(formula.size):
        context.report(
            code.NESTED_TOO_DEEP,
            f"the formula is nested {formula.depth} deep with every `let` expanded; the limit is {limits.nesting}",
            formula.span,
            help="write a chain such as `a and b and c`, which is one operator",
        )
        return replace(formula, size=math.nan)
    return formula


# --------------------------------------------------------------- quantifiers


def _quantified(context: Context, formula: ast.Quantified) -> Typed:
    if formula.kind == "every" and isinstance(formula.agents, ast.Name) and _is_number(context, formula.agents):
        return _recurrent(context, formula, formula.agents)
    agents = resolve_set(context, formula.agents)
    body = resolve_formula(context, formula.body)
    of_team = formula.kind == "without any"
    check(context, body, About.TEAM if of_team else About.AGENT, f"{formula.kind} {agents.name}:")
    count = len(agents.agents)
    number = {"every": count, "some": 1}.get(formula.kind, 0)
    if formula.number is not None:
        value = whole(context, formula.number, "the number of agents", least=1)
        number = 0 if math.isnan(value) else int(value)
        if number > count > 0:
            context.report(
                code.VALUE_OUT_OF_RANGE,
                f"`{agents.name}` has {count} {'agent' if count == 1 else 'agents'}; the formula requires {number}",
                formula.number.span,
                labels=(Label(agents.span),),
                help=f"write a number from 1 to {count}",
            )
    if of_team:
        return _without(context, formula, number, agents, body)
    resolved = ir.AtLeastOf(formula.kind, number, agents, body.formula, formula.span)
    return Typed(resolved, About.TEAM, formula.span, size=1 + body.size, depth=1 + body.depth)


def _recurrent(context: Context, formula: ast.Quantified, length: ast.Name) -> Typed:
    """Resolved recurrence ``every patrol: f``, where ``patrol`` is a parameter with the period."""
    word = formula.span.part(formula.span.start, formula.span.start + len(formula.kind))
    period = ast.Period(length.span, length)
    return _apply(context, ast.Apply(formula.span, formula.kind, word, (formula.body,), period))


def _without(context: Context, formula: ast.Quantified, number: int, agents: ir.AgentSet, body: Typed) -> Typed:
    """Resolved formula for any loss of ``number`` agents; expanded only if all cases are within the limit."""
    size = 1 + math.comb(len(agents.agents), number) * (body.size + named_members(body.formula))
    nothing = Typed(ir.Truth(True, formula.span), About.TEAM, formula.span, size=size, depth=1 + body.depth)
    if not size <= context.limits.formula_nodes:
        return nothing
    resolved, named = without_any(number, agents, body.formula, formula.span)
    for part in named:
        asked_of_the_lost(context, part, formula)
    return replace(nothing, formula=resolved)


def _one_agent(context: Context, formula: ast.OneAgent) -> Typed:
    agent = compared_agent(context, formula.agent, "one agent (or `every`, `some`)")
    body = resolve_formula(context, formula.body)
    if isinstance(agent, Unresolved):
        return stand_in(formula.span)
    check(context, body, About.AGENT, f"{excerpt(formula.agent.span)}:")
    resolved = ir.OfAgent(agent, body.formula, formula.span)
    return Typed(resolved, About.TEAM, formula.span, size=1 + body.size, depth=1 + body.depth)
