"""Traversal of resolved formulas without recursion, for shared subformulas and ``let`` chains of any depth."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from functools import wraps
from typing import TypeGuard, TypeVar, assert_never
from weakref import WeakKeyDictionary

from missionc import ir
from missionc.base.source import Span
from missionc.ir.kernel.nodes import Is, Node
from missionc.ir.kernel.walk import looks_back, postorder
from missionc.ir.language.operator import TooLarge, Use
from missionc.ir.language.operators import by_name

T = TypeVar("T")
V = TypeVar("V")


def once(function: Callable[[T], V]) -> Callable[[T], V]:
    """Decorator that caches a function of one formula or mission; an entry is dropped together with its argument.

    The result must not refer to the argument.
    """
    known: WeakKeyDictionary[T, V] = WeakKeyDictionary()

    @wraps(function)
    def of(what: T) -> V:
        try:
            return known[what]
        except KeyError:
            value = known[what] = function(what)
            return value

    return of


def goals(mission: ir.Mission) -> tuple[ir.Requirement | ir.Preference, ...]:
    """Requirements of the mission, followed by its preferences."""
    return (*mission.requirements, *mission.preferences)


def operands(formula: ir.Formula) -> tuple[ir.Formula, ...]:
    """Direct subformulas of a formula."""
    match formula:
        case ir.Truth() | ir.Holds() | ir.Belongs():
            return ()
        case ir.Apply():
            return formula.operands
        case ir.AtLeastOf() | ir.OfAgent():
            return (formula.body,)
        case ir.Without():
            return formula.cases
        case _:
            assert_never(formula)


def as_written(formula: ir.Formula) -> tuple[ir.Formula, ...]:
    """Direct subformulas as the text has them: for ``without`` (lost agents), the body once instead of one case per
    loss."""
    return (formula.body,) if isinstance(formula, ir.Without) else operands(formula)


@once
def formulas(mission: ir.Mission) -> tuple[ir.Formula, ...]:
    """All subformulas of the mission's requirements and preferences, operands first."""
    return tuple(formulas_bottom_up(goal.formula for goal in goals(mission)))


def formulas_bottom_up(
    roots: Iterable[ir.Formula], below: Callable[[ir.Formula], tuple[ir.Formula, ...]] = operands
) -> list[ir.Formula]:
    """Root formulas and all formulas below them, once each, operands first."""
    order: dict[ir.Formula, None] = {}
    stack = list(roots)[::-1]
    while stack:
        formula = stack[-1]
        first = [] if formula in order else [operand for operand in below(formula) if operand not in order]
        if first:
            stack.extend(reversed(first))
        else:
            order.setdefault(stack.pop())
    return list(order)


def bits_of(agents: tuple[int, ...]) -> int:
    """Agent set as a bit mask: bit i is set for agent i."""
    if agents and agents == tuple(range(agents[0], agents[0] + len(agents))):
        return ((1 << len(agents)) - 1) << agents[0]
    bits = bytearray(max(agents, default=0) // 8 + 1)
    for agent in agents:
        bits[agent // 8] |= 1 << agent % 8
    return int.from_bytes(bits, "little")


def asked_agents(mission: ir.Mission) -> Iterator[tuple[ir.Formula, tuple[int, ...]]]:
    """Yield every subformula of the mission's requirements and preferences with the agents for which it is evaluated.

    Quantifiers and graphs determine these agents. A formula that is used in several places is yielded once with each
    set of agents.
    """
    seen: set[tuple[ir.Formula, tuple[int, ...]]] = set()
    waiting: list[tuple[ir.Formula, tuple[int, ...]]] = [(goal.formula, ()) for goal in goals(mission)]
    while waiting:
        formula, agents = waiting.pop()
        if (formula, agents) in seen:
            continue
        seen.add((formula, agents))
        yield formula, agents
        match formula:
            case ir.AtLeastOf(agents=named, body=body):
                waiting.append((body, named.agents))
            case ir.OfAgent(agent=agent, body=body):
                waiting.append((body, (agent,)))
            case ir.Apply(bounds=ir.Length(graph=graph)):
                everyone = tuple(sorted({*agents, *graph.agents}))
                waiting.extend((operand, everyone) for operand in operands(formula))
            case _:
                waiting.extend((operand, agents) for operand in operands(formula))


@once
def meaning(formula: ir.Apply) -> tuple[Node, tuple[Is, ...]]:
    """Kernel form of a temporal or Boolean operator over placeholders, with the placeholder of each operand.

    Passes therefore depend on the few kernel constructors and on no operator by name. Spatial operators are excluded,
    since their kernel form may grow with the team.
    """
    assert not formula.operator.spatial
    places = tuple(Is(frozenset()) for _ in formula.operands)
    node = by_name[formula.operator.name].expand(Use(places, formula.bounds, formula.span))
    assert not isinstance(node, TooLarge)
    return node, places


def reaches_back(formula: ir.Formula) -> TypeGuard[ir.Apply]:
    """Return true if a formula is the application of a past operator."""
    return _in_time(formula) and looks_back(meaning(formula)[0])


def asks_the_past(formula: ir.Formula) -> TypeGuard[ir.Apply]:
    """Return true if the kernel form of an operator reads earlier steps."""
    return _in_time(formula) and any(map(looks_back, postorder((meaning(formula)[0],))))


def _in_time(formula: ir.Formula) -> TypeGuard[ir.Apply]:
    """Return true if a formula may read other steps: a non-spatial operator with at most two operands."""
    return isinstance(formula, ir.Apply) and not formula.operator.spatial and len(formula.operands) <= 2


def operator_words(formula: ir.Apply) -> Span:
    """Source text of the operator with its bounds (``always[0, 16 s]``); for an operator without bounds, of the whole
    formula."""
    whole = formula.span
    if formula.bounds is None:
        return whole
    bounds = formula.bounds.span
    if bounds.source is not whole.source or not whole.start <= bounds.start <= bounds.end <= whole.end:
        return whole
    word = re.search(r"\w+\s*\[?\s*$", whole.source.text[whole.start : bounds.start])
    end = bounds.end
    closing = re.match(r"\s*\]", whole.source.text[end : whole.end])
    if closing and not whole.source.text[bounds.start : end].endswith("]"):
        end += closing.end()
    return whole.part(whole.start + word.start(), end) if word else whole
