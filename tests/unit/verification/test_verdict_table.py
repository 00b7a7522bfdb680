"""Rows of the verdict table: what formulas come to as time goes on, on the x axis from step to step."""

from __future__ import annotations

import math

import numpy as np
import pytest

from missionc.ir.kernel.nodes import All, Always, Any, At, AtLeast, Atom, Eventually, Node, Not, Release, Until
from missionc.ir.predicates import Compare, Coordinate
from missionc.verification.monitoring.verdict_table import Row, asked_where, chain, table
from tests.support.random_runs import mission_of, trace_of

INF = math.inf
FIRST, SECOND = [-1.0, -2.0, 1.0, 3.0, 2.0], [4.0, 0.5, -3.0, 5.0, 6.0]
TRACE = trace_of([[(x, 0.0) for x in row] for row in (FIRST, SECOND)])
MISSION = mission_of(2, 4)


def least(value: float) -> Atom:
    """By how much x is more than a value."""
    return Atom(Compare(((1.0, Coordinate(0)),), -value, False))


A, B = least(0.0), least(1.5)


def row(node: Node, goal: Node | None = None, opposites: dict[Node, Node] | None = None) -> Row:
    return table([node], [goal or node], MISSION, TRACE, opposites or {})[node]


@pytest.mark.parametrize(
    ("formula", "low", "high"),
    [
        (Eventually(A, 1, 3), [-INF, -2, 1, 3, 3], [INF, INF, INF, 3, 3]),
        (Eventually(A, 0, None), [-1, -1, 1, 3, 3], [INF, INF, INF, INF, 3]),
        (Eventually(A, 2, 2), [-INF, -INF, 1, 1, 1], [INF, INF, 1, 1, 1]),
        (Always(A, 1, 3), [-INF, -INF, -INF, -2, -2], [INF, -2, -2, -2, -2]),
        (Always(B, 2, None), [-INF, -INF, -INF, -INF, -0.5], [INF, INF, -0.5, -0.5, -0.5]),
        # Held as long as x is less than 0.75, which is by 1.75, 2.75, -0.25, -2.25 and -1.25.
        (Until(Not(least(0.75)), B, 0, 3), [-2.5, -2.5, -0.5, -0.25, -0.25], [1.75, 1.75, -0.25, -0.25, -0.25]),
        (Until(Not(least(0.75)), B, 2, None), [-INF, -INF, -0.5, -0.25, -0.25], [1.75, 1.75, -0.25, -0.25, -0.25]),
        (Until(least(-4.0), B, 1, 3), [-INF, -3.5, -0.5, 1.5, 1.5], [3, 2, 2, 1.5, 1.5]),
        (Release(A, least(-4.0), 0, 2), [-1, -1, 2, 2, 2], [3, 2, 2, 2, 2]),
        (All((A, Eventually(A, 1, 3))), [-INF, -2, -1, -1, -1], [-1, -1, -1, -1, -1]),
        (Any((B, Always(A, 1, 3))), [-2.5, -2.5, -2.5, -2, -2], [INF, -2, -2, -2, -2]),
        (AtLeast(2, (A, Eventually(A, 1, 3), Always(A, 1, 3))), [-INF, -2, -1, -1, -1], [INF, -1, -1, -1, -1]),
    ],
)
def test_what_is_asked_at_step_0_alone_comes_out_as_time_goes_on(
    formula: Node, low: list[float], high: list[float]
) -> None:
    found = row(formula)
    assert found.unfolds
    assert (found.least[0].tolist(), found.most[0].tolist()) == (low, high)
    truth = [np.array(each) for each in (low, high)]
    assert found.surely[0].tolist() == (truth[0] >= 0).tolist()
    assert found.possibly[0].tolist() == (truth[1] >= 0).tolist()


def test_what_is_asked_at_many_steps_has_its_value_at_each() -> None:
    inner = Eventually(A, 0, 1)
    goal = At(0, Always(inner, 1, 2))
    found = row(inner, goal)
    assert not found.unfolds
    assert found.least is not None
    assert found.least[0, :4].tolist() == found.most[0, :4].tolist() == [-1, 1, 3, 3]
    assert found.asked.tolist() == [[False, True, True, False, False], [False] * 5]
    atom = row(A, goal)
    assert atom.asked.tolist() == [[False, True, True, True, False], [False] * 5]
    assert atom.least.tolist() == atom.most.tolist() == [FIRST, SECOND]
    assert atom.surely.tolist() == atom.possibly.tolist() == (np.array([FIRST, SECOND]) >= 0).tolist()


def test_a_formula_about_the_team_has_one_row() -> None:
    goal = All((At(0, Eventually(A, 0, 1)), At(1, Eventually(A, 0, 1))))
    found = row(goal)
    assert found.least.shape == found.asked.shape == (1, 5)
    assert found.least.tolist() == [[-1, -1, -1, -1, -1]]
    assert found.most.tolist() == [[INF, -1, -1, -1, -1]]
    assert found.asked.tolist() == [[True, False, False, False, False]]


def test_a_formula_whose_negation_is_asked_is_asked_there_and_comes_to_the_opposite() -> None:
    some, none = Eventually(A, 1, 3), Always(Not(A), 1, 3)
    found = row(some, none, {some: none})
    assert found.unfolds
    assert (found.least[0].tolist(), found.most[0].tolist()) == ([-INF, -2, 1, 3, 3], [INF, INF, INF, 3, 3])
    assert found.asked[0].tolist() == [True, False, False, False, False]
    assert row(A, none, {some: none}).asked[0].tolist() == [False, True, True, True, False]


def test_what_is_below_no_goal_is_asked_nowhere() -> None:
    assert not row(B, A).asked.any()
    where = asked_where((A,), {A, B}, TRACE, {})
    assert where[A].tolist() == [[True, False, False, False, False]] * 2
    assert where[B].shape == (2, 5)
    assert not where[B].any()


def test_a_verdict_is_made_of_what_is_asked_at_once_down_to_the_first_windows() -> None:
    window, back = Eventually(Always(A, 0, 1), 0, 1), Eventually(A, -1, 0)
    both = All((A, window, back))
    goal = At(0, Any((B, both)))
    assert chain([goal]) == [window, both, goal.body, goal]
    assert chain([back]) == []
    assert chain([A]) == []
    assert chain([All((A, B))]) == []
