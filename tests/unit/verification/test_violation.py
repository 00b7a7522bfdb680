"""The step and the agents that decide a false formula, on the x axis from step to step."""

from __future__ import annotations

import pytest

from missionc import ir
from missionc.base.units import Metres
from missionc.ir.kernel.nodes import All, Always, Any, At, AtLeast, Atom, Eventually, Is, Not, Release, Until
from missionc.ir.predicates import Compare, Coordinate, DistanceBetween, InFormation
from missionc.verification.monitoring.violation import Decision, first_violation
from tests.support.random_runs import SPAN, mission_of, trace_of

FIRST, SECOND, THIRD = [-1.0, 1.0, -1.0, -1.0, 2.0, -1.0], [1.0, 1.0, 1.0, -1.0, 1.0, 1.0], [3.0] * 6
TRACE = trace_of([[(x, 0.0) for x in row] for row in (FIRST, SECOND, THIRD)])
MISSION = mission_of(3, 5)


def least(value: float) -> Atom:
    return Atom(Compare(((1.0, Coordinate(0)),), -value, False))


A, FAR = least(0.0), least(1.5)
NEVER = Is(frozenset())
CLOSE = Atom(Compare(((-1.0, DistanceBetween(1, 2)),), 2.5, False))
EDGES = ir.FormationEdge(0, 1, 2.0), ir.FormationEdge(1, 2, 2.0), ir.FormationEdge(0, 2, 9.0)


def row(*edges: ir.FormationEdge) -> Atom:
    return Atom(InFormation(ir.Formation("row", "chain", (0, 1, 2), edges, Metres(0.5), False, SPAN)))


def test_a_false_formula_is_decided_at_a_step_by_some(subtests: pytest.Subtests) -> None:
    for formula, step, agents in [
        (A, 0, {0}),
        (At(1, FAR), 0, {1}),
        (At(1, Not(A)), 0, {1}),
        (NEVER, 0, {0}),
        # The first step that breaks it; the last of those that might have kept it.
        (Always(A, 0, 5), 0, {0}),
        (Always(A, 1, 5), 2, {0}),
        (At(1, Always(A, 0, None)), 3, {1}),
        (Eventually(FAR, 0, 3), 3, {0}),
        (At(1, Eventually(FAR, 2, None)), 5, {1}),
        (All((At(2, A), At(1, Always(A, 0, 4)), Eventually(FAR, 0, 2))), 2, {0}),
        (Any((At(1, Always(A, 0, 4)), Eventually(FAR, 0, 2))), 3, {0, 1}),
        (Any(()), 0, set()),
        (AtLeast(2, (At(1, Always(A, 0, 4)), At(2, A), Eventually(FAR, 0, 2))), 3, {0, 1}),
        (AtLeast(3, (At(1, Always(A, 0, 4)), At(2, A), Eventually(FAR, 0, 2))), 2, {0}),
        (AtLeast(4, (At(2, A),)), 0, set()),
        # Given up before its end comes, or its end never comes.
        (Until(A, FAR, 0, 4), 0, {0}),
        (At(1, Until(A, FAR, 0, 4)), 3, {1}),
        (At(1, Until(A, FAR, 0, 2)), 2, {1}),
        (At(1, Until(A, FAR, 1, None)), 3, {1}),
        (Release(FAR, A, 1, 5), 2, {0}),
        # Of windows that look back, of which the first false one decides.
        (Always(Eventually(A, -1, 0), 1, 5), 3, {0}),
        (Always(Eventually(A, -1, -1), 2, 5), 2, {0}),
        (Always(Always(A, -1, 0), 1, 5), 0, {0}),
        (Always(Always(A, -2, -1), 4, 5), 2, {0}),
        (At(1, Always(Always(A, -2, 0), 2, 5)), 3, {1}),
        (Eventually(A, -2, -1), 0, {0}),
        # An end at the last moment would have kept it; one that no motion brings is lost from the start.
        (At(1, Always(Until(A, FAR, -3, 0), 5, 5)), 5, {1}),
        (At(1, Always(Until(A, FAR, -3, -1), 5, 5)), 4, {1}),
        (At(1, Always(Until(A, NEVER, -3, 0), 5, 5)), 0, {1}),
        (Eventually(NEVER, 2, 4), 0, {0}),
        (At(1, Always(Until(A, FAR, -1, -1), 5, 5)), 4, {1}),
        (At(1, Always(Release(NEVER, A, -3, 0), 5, 5)), 3, {1}),
        # Whom a predicate names it is about.
        (Always(CLOSE, 2, 5), 3, {1, 2}),
        (row(*EDGES), 0, {0, 2}),
        (row(EDGES[0], EDGES[1], ir.FormationEdge(0, 2, 4.0), ir.FormationEdge(1, 0, 9.0)), 0, {0, 1}),
    ]:
        with subtests.test(formula=formula, step=step, agents=agents):
            assert first_violation(At(0, formula), MISSION, TRACE) == Decision(step, frozenset(agents))
