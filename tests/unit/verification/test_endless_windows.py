"""Windows to the mission's end below one another, put otherwise: which formulas, and that they come to the same."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from missionc.base.source import Source, Span
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    Is,
    Node,
    Not,
    Release,
    Until,
    UntilNode,
    WindowNode,
)
from missionc.ir.kernel.walk import children, postorder
from missionc.ir.predicates import Compare, Coordinate
from missionc.verification.monitoring.live.judge import looking_back
from missionc.verification.monitoring.monitor import robustness
from tests.support.random_runs import mission_of

LAST = 4


def least(axis: int, value: float = 0.0) -> Atom:
    return Atom(Compare(((1.0, Coordinate(axis)),), -value, False))


A, B, C = least(0), least(1), Atom(Compare(((1.0, Coordinate(0)), (-1.0, Coordinate(1))), 0.0, False))
NAMES = {id(A): "a", id(B): "b", id(C): "c"}


def words(node: Node) -> str:
    """The formula in short."""
    parts = ", ".join(map(words, children(node)))
    match node:
        case Atom():
            return NAMES[id(node)]
        case At(agent):
            return f"@{agent}({parts})"
        case WindowNode() | UntilNode():
            return f"{type(node).__name__.lower()}[{node.low}, {node.high}]({parts})"
        case AtLeast(count):
            return f"{count} of ({parts})"
        case _:
            return f"{type(node).__name__.lower()}({parts})"


SOURCE = Source("test.mission", "own inner")
SOME, EVERY = Eventually(B, 0, None), Always(B, 0, None)


@pytest.mark.parametrize(
    ("formula", "found"),
    [
        (Always(SOME, 0, None), "always[4, 4](release[-4, 0](b, any(b)))"),
        (Always(SOME, 0, 4), "always[4, 4](release[-4, 0](b, any(b)))"),
        (Always(Any((A, SOME)), 0, None), "always[4, 4](release[-4, 0](b, any(a, b)))"),
        (Always(Any((SOME, A, C)), 0, None), "always[4, 4](release[-4, 0](b, any(a, c, b)))"),
        (Eventually(EVERY, 0, None), "always[4, 4](until[-4, 0](b, all(b)))"),
        (Eventually(All((A, EVERY)), 0, None), "always[4, 4](until[-4, 0](b, all(a, b)))"),
        (
            Always(Any((A, Until(C, B, 0, None))), 0, None),
            "all(always[0, 3](any(c, release[-4, 0](b, any(a, b)))), always[4, 4](release[-4, 0](b, any(a, b))))",
        ),
        (
            Eventually(All((A, Release(C, B, 0, None))), 0, None),
            "any(eventually[0, 3](all(c, until[-4, 0](b, all(a, b)))), always[4, 4](until[-4, 0](b, all(a, b))))",
        ),
        (Always(At(1, SOME), 0, None), "@1(always[4, 4](release[-4, 0](b, any(b))))"),
        (Always(At(1, At(0, SOME)), 0, None), "@1(@0(always[4, 4](release[-4, 0](b, any(b)))))"),
        (
            Always(All((At(0, SOME), At(1, A), C)), 0, None),
            "all(@0(always[4, 4](release[-4, 0](b, any(b)))), @1(always[0, None](a)), always[0, None](c))",
        ),
        (
            Eventually(Any((At(0, EVERY), At(1, EVERY))), 0, 4),
            "any(@0(always[4, 4](until[-4, 0](b, all(b)))), @1(always[4, 4](until[-4, 0](b, all(b)))))",
        ),
        (All((A, Always(SOME, 0, None))), "all(a, always[4, 4](release[-4, 0](b, any(b))))"),
        (At(1, Always(SOME, 0, None)), "@1(always[4, 4](release[-4, 0](b, any(b))))"),
        (AtLeast(1, (A, Always(SOME, 0, None))), "1 of (a, always[4, 4](release[-4, 0](b, any(b))))"),
    ],
)
def test_a_window_over_the_whole_mission_looks_back_from_its_end(formula: Node, found: str) -> None:
    assert words(looking_back(formula, LAST)) == found


@pytest.mark.parametrize(
    "formula",
    [
        A,
        Always(A, 0, None),
        Always(Eventually(B, 0, 2), 0, None),
        Always(Eventually(B, 1, None), 0, None),
        Always(Eventually(B, -4, 0), 0, None),
        Always(SOME, 1, None),
        Always(SOME, 0, 3),
        # Of the same kind, or two of them.
        Always(EVERY, 0, None),
        Eventually(SOME, 0, None),
        Always(Any((SOME, Eventually(A, 0, None))), 0, None),
        Always(All((A, SOME)), 0, None),
        Always(Any((A, At(1, B))), 0, None),
        Until(A, SOME, 0, None),
        All((A, B)),
    ],
    ids=words,
)
def test_other_formulas_stay_what_they_are(formula: Node) -> None:
    assert looking_back(formula, LAST) is formula


def test_in_a_mission_of_one_step_nothing_is_put_otherwise() -> None:
    formula = Always(SOME, 0, None)
    assert looking_back(formula, 0) is formula


@pytest.mark.parametrize("body", [SOME, Any((A, SOME)), Any((A, Until(C, B, 0, None))), At(1, SOME)], ids=words)
def test_what_is_put_otherwise_goes_by_the_same_words(body: Node) -> None:
    own, inner = Span(SOURCE, 0, 3), Span(SOURCE, 4, 7)
    formula = Always(replace(body, span=inner), 0, None, own)
    found = looking_back(formula, LAST)
    assert found is not formula
    before = {id(node) for node in postorder((formula,))}
    new = [node for node in postorder((found,)) if id(node) not in before]
    assert all(node.span == (inner if isinstance(node, At) else own) for node in new)


def test_a_formula_that_several_are_asked_is_one() -> None:
    both = looking_back(Always(All((At(0, SOME), At(1, SOME))), 0, None), LAST)
    assert isinstance(both, All)
    first, second = both.parts
    assert isinstance(first, At)
    assert isinstance(second, At)
    assert first.body is second.body


def test_it_is_of_the_same_robustness_at_the_first_step(subtests: pytest.Subtests) -> None:
    for seed, formula in product(
        range(6),
        [
            Always(Any((A, SOME)), 0, None),
            Eventually(All((A, EVERY)), 0, None),
            Always(Any((A, Until(C, B, 0, None))), 0, None),
            Eventually(All((A, Release(C, B, 0, None))), 0, None),
            Always(All((At(0, SOME), At(1, Any((A, SOME))), Not(C))), 0, None),
            Eventually(Any((At(0, EVERY), Is(frozenset((1,))))), 0, None),
        ],
    ):
        with subtests.test(type(formula).__name__ if hasattr(formula, "every") else "", seed=seed):
            position = np.random.default_rng(seed).uniform(-3, 3, (2, LAST + 1, 2))
            trace = Trace(Seconds(1.0), position, np.zeros_like(position), np.zeros((2, LAST + 1)))
            mission = mission_of(2, LAST)
            values = [robustness(each, mission, trace)[0, 0] for each in (formula, looking_back(formula, LAST))]
            assert values[0] == values[1]
