"""Constants in formulas: what is left of one that contains them, and of a kernel that planners get."""

from __future__ import annotations

from dataclasses import replace

import pytest

from missionc import ir
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Goal,
    Is,
    Kernel,
    Neighbour,
    Node,
    Not,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.ir.kernel.normal_form import NO, YES, at_least, constant, folded, without_constants
from missionc.ir.kernel.walk import children
from missionc.ir.predicates import Inside
from tests.support.random_runs import BASE, SPAN, graphs_of

A, B = Atom(Inside(BASE, False)), Is(frozenset((1,)))
RADIO = graphs_of(3)[0]


def shape(node: Node) -> object:
    """The formula as a value that can be compared: kinds and constants, ``a`` and ``b``."""
    if node is A or node is B:
        return "a" if node is A else "b"
    fixed = constant(node)
    if fixed is not None:
        return fixed
    window = (node.low, node.high) if isinstance(node, Always | Eventually | Until | Release) else ()
    count = (node.count,) if isinstance(node, AtLeast) else ()
    return (type(node).__name__, *window, *count, *map(shape, children(node)))


def test_a_formula_without_its_constants_is_worth_the_same(subtests: pytest.Subtests) -> None:
    for formula, left in [
        (Any((A, NO)), "a"),
        (Any((A, NO, B)), ("Any", "a", "b")),
        (Any((A, YES)), True),
        (All((A, YES)), "a"),
        (All((A, NO)), False),
        (All((YES, YES)), True),
        (Any((NO,)), False),
        (AtLeast(2, (A, B, NO)), ("All", "a", "b")),
        (AtLeast(2, (A, B, YES)), ("Any", "a", "b")),
        (AtLeast(2, (A, NO, NO)), False),
        (AtLeast(2, (A, YES, YES)), True),
        (AtLeast(0, (A,)), True),
        (AtLeast(2, (A,)), False),
        (At(1, YES), True),
        (Not(YES), False),
        (Always(YES, 0, 3), True),
        (Eventually(NO, 1, None), False),
        # One that looks back may hold no step, unless it includes the present one.
        (Eventually(NO, -2, -1), False),
        (Always(YES, -2, -1), True),
        (Eventually(YES, -2, -1), ("Eventually", -2, -1, True)),
        (Eventually(YES, -2, 0), True),
        (Until(NO, A, 0, 3), "a"),
        (Until(NO, A, 1, 3), False),
        (Until(YES, A, 1, 3), ("Eventually", 1, 3, "a")),
        (Until(A, NO, 0, 3), False),
        (Until(A, YES, 0, 3), True),
        (Until(A, YES, 1, 3), ("Until", 1, 3, "a", True)),
        (Until(NO, A, -3, -1), False),
        (Until(NO, A, -3, 0), "a"),
        (Until(YES, A, -3, -1), ("Eventually", -3, -1, "a")),
        (Release(YES, A, 0, 3), "a"),
        (Release(YES, A, 1, 3), True),
        (Release(NO, A, 1, 3), ("Always", 1, 3, "a")),
        (Release(A, NO, 0, 3), False),
        (Release(A, YES, 1, 3), True),
        (Neighbour(RADIO, NO), False),
        (EveryNeighbour(RADIO, YES), True),
        (Neighbour(RADIO, YES), ("Neighbour", True)),
        (Reach(RADIO, NO, A, 2), "a"),
        (Reach(RADIO, YES, A, 2), ("Reach", True, "a")),
        (Reach(RADIO, A, YES, 2), True),
        (EveryReach(RADIO, YES, A, 2), "a"),
        (EveryReach(RADIO, A, NO, 2), False),
        (Route(RADIO, NO, A, 1.0, 2.0), False),
        (Route(RADIO, A, NO, 0.0, 2.0), False),
        (Route(RADIO, A, YES, 0.0, 2.0), True),
        (Route(RADIO, A, YES, 1.0, 2.0), ("Route", "a", True)),
        (EveryRoute(RADIO, YES, A, 1.0, 2.0), True),
    ]:
        with subtests.test(formula=formula, left=left):
            assert shape(folded(formula, children(formula))) == left


def test_a_formula_without_constants_is_the_same_node() -> None:
    for formula in (Any((A, B)), AtLeast(1, (A, B)), Until(A, B, 0, 3), At(0, A), Reach(RADIO, YES, A, 2)):
        assert folded(formula, children(formula)) is formula
    kernel = Kernel((Goal("g", Always(A, 0, 3), SPAN),), ())
    assert without_constants(kernel, 3) is kernel


def test_goals_keep_their_names_words_and_weights() -> None:
    everybody, nobody = Is(frozenset((0, 1, 2))), Is(frozenset())
    goals = (Goal("yes", Any((At(0, A), everybody)), SPAN), Goal("no", All((At(0, A), nobody), SPAN), SPAN))
    wish = Goal("", Any((At(0, A), At(1, Always(nobody, 0, 2)))), SPAN, 2.0)
    kernel = without_constants(Kernel(goals, (wish,)), 3)
    yes, no = kernel.requirements
    assert (yes.name, constant(yes.formula)) == ("yes", True)
    assert (no.name, constant(no.formula), no.span) == ("no", False, SPAN)
    assert shape(kernel.preferences[0].formula) == ("At", "a")
    assert replace(kernel.preferences[0], formula=wish.formula).weight == 2.0


def test_what_was_folded_is_no_meaning_of_the_authors_words() -> None:
    kept, gone = ir.Truth(True, SPAN), ir.Truth(False, SPAN)
    left, whole = At(0, A), Any((At(0, A), NO))
    kernel = Kernel((Goal("g", whole, SPAN), Goal("h", left, SPAN)), (), {kept: left, gone: whole})
    assert without_constants(kernel, 3).meanings == {kept: left}


@pytest.mark.parametrize(("count", "left"), [(0, True), (1, ("Any", "a", "b")), (2, ("All", "a", "b")), (3, False)])
def test_a_count_has_the_plainest_constructor(count: int, left: object) -> None:
    assert shape(at_least(count, (A, B))) == left
