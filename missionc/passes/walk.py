"""Walking formulas without recursion: they are graphs, shared and as deep as the mission's chains of ``let``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import assert_never

from missionc.ir import Apply, AtLeastOf, Belongs, Formula, Holds, Mission, OfAgent, Preference, Requirement, Truth
from missionc.kernel.nodes import Is, Node
from missionc.language.operator import TooLarge, Use
from missionc.source import Span


def goals(mission: Mission) -> tuple[Requirement | Preference, ...]:
    """Everything the mission asks for: its requirements, then its preferences."""
    return (*mission.requirements, *mission.preferences)


def operands(formula: Formula) -> tuple[Formula, ...]:
    """The formulas directly below."""
    match formula:
        case Truth() | Holds() | Belongs():
            return ()
        case Apply():
            return formula.operands
        case AtLeastOf() | OfAgent():
            return (formula.body,)
        case _:
            assert_never(formula)


def bottom_up(roots: Iterable[Formula]) -> list[Formula]:
    """Every formula below the roots and the roots themselves, once each, operands before the formulas that use them."""
    found: list[Formula] = []
    seen: set[Formula] = set()
    stack = [(root, False) for root in roots][::-1]
    while stack:
        formula, done = stack.pop()
        if done:
            found.append(formula)
        elif formula not in seen:
            seen.add(formula)
            stack.append((formula, True))
            stack.extend((operand, False) for operand in reversed(operands(formula)))
    return found


def bits_of(agents: tuple[int, ...]) -> int:
    """A set of agents as the bits of a number."""
    if agents and agents == tuple(range(agents[0], agents[0] + len(agents))):
        return ((1 << len(agents)) - 1) << agents[0]
    bits = bytearray(max(agents, default=0) // 8 + 1)
    for agent in agents:
        bits[agent // 8] |= 1 << agent % 8
    return int.from_bytes(bits, "little")


@lru_cache(maxsize=4096)
def meaning(formula: Apply) -> tuple[Node, tuple[Is, ...]]:
    """What a temporal or Boolean operator says, in kernel form, over a placeholder for each of its operands.

    So a pass knows the kernel's few constructors and no operator by name. Not
    for spatial operators: their kernel form may grow with the team.
    """
    assert not formula.operator.spatial
    places = tuple(Is(frozenset()) for _ in formula.operands)
    node = formula.operator.expand(Use(places, formula.bounds, formula.span))
    assert not isinstance(node, TooLarge)
    return node, places


def operator_words(formula: Apply) -> Span:
    """The operator with its bounds, as written (``always[0, 16 s]``); without bounds, the whole formula."""
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
    return Span(whole.source, whole.start + word.start(), end) if word else whole
