"""Negation normal form: `Not` on leaves alone, the same meaning, and one node for what is used twice."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given, settings

from missionc import ir
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, Eventually, Is, Node, Not, PathLength, says_opposite
from missionc.ir.kernel.normal_form import negated, negation_normal_form
from missionc.ir.kernel.walk import postorder
from missionc.ir.lower.expand import expand
from missionc.verification.monitoring.monitor import robustness, truth
from tests import reference
from tests.support.random_runs import BASE, SPAN, Case, cases, mission_of

LEAF = Atom(ir.Inside(BASE, body=False), SPAN)


def denials(node: Node) -> list[Node]:
    return [below.body for below in postorder((node,)) if isinstance(below, Not)]


@settings(max_examples=100)
@given(cases())
def test_a_formula_and_its_negation_are_opposites_and_deny_leaves_alone(case: Case) -> None:
    assume(reference.ahead(case.formula) <= case.run.last)
    mission = mission_of(len(case.trace.position), case.run.last, ir.Requirement("asked", case.formula, SPAN))
    kernel, _ = expand(mission)
    assert kernel is not None
    formula = kernel.requirements[0].formula
    opposite = negated(formula)
    for each in (formula, opposite):
        assert all(isinstance(body, Atom | Is | PathLength) for body in denials(each))
    assert truth(formula, mission, case.trace)[0, 0] != truth(opposite, mission, case.trace)[0, 0]
    values = [robustness(each, mission, case.trace)[0, 0] for each in (formula, opposite)]
    np.testing.assert_array_equal(values[0], -values[1])


def test_what_has_no_negation_below_it_stays_the_node_it_is() -> None:
    formula = At(0, Any((Eventually(LEAF, 0, 3), Not(LEAF))))
    assert negation_normal_form(formula) is formula


def test_what_is_used_twice_is_one_node_in_each_polarity() -> None:
    shared = Eventually(LEAF, 0, 3)
    whole = negation_normal_form(Not(All((shared, At(1, shared), Not(At(2, shared))))))
    assert isinstance(whole, Any)
    first, second, third = whole.parts
    assert isinstance(second, At)
    assert isinstance(third, At)
    assert second.body is first
    assert third.body is shared


def test_that_fewer_hold_is_that_enough_of_the_others_fail() -> None:
    few = negated(AtLeast(2, (LEAF, LEAF, LEAF), SPAN))
    assert isinstance(few, AtLeast)
    assert few.count == 2
    assert [isinstance(part, Not) for part in few.parts] == [True] * 3


def test_a_negation_keeps_the_words_and_says_their_opposite() -> None:
    words = Eventually(LEAF, 0, 3, SPAN)
    once = negated(words)
    assert (once.span, says_opposite(once)) == (SPAN, True)
    twice = negated(once)
    assert (twice.span, says_opposite(twice)) == (SPAN, False)
