"""The kernel as text: every kind of node has its words, and what is more than a leaf its name."""

from __future__ import annotations

import math

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
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.ir.kernel.show import KernelWords, asked, metres_text, show
from tests.support.random_runs import BASE, SPAN, graphs_of, mission_of

RADIO = graphs_of(3)[0]
PART = ir.Proximity("radio", RADIO.radius, (0, 2), SPAN)
F = Is(frozenset((0,)))


@pytest.mark.parametrize(
    ("node", "words"),
    [
        (Is(frozenset((2, 0))), "is(drone[0], drone[2])"),
        (Not(F), "not a"),
        (All((F, F)), "all(a, b)"),
        (Any((F, F)), "any(a, b)"),
        (AtLeast(2, (F, F)), "at-least 2 (a, b)"),
        (Always(F, 1, 2), "always [1..2] a"),
        (Eventually(F, 0, None), "eventually [0..end] a"),
        (Until(F, F, 0, 3), "a until [0..3] b"),
        (Release(F, F, 1, None), "a release [1..end] b"),
        (Until(F, F, -3, 0), "a since [-3..0] b"),
        (Release(F, F, -3, -1), "a trigger [-3..-1] b"),
        (Neighbour(RADIO, F), "neighbour on radio a"),
        (EveryNeighbour(RADIO, F), "every neighbour on radio a"),
        (Reach(RADIO, F, F, 2), "a reach 2 hops on radio b"),
        (EveryReach(PART, F, F, 2), "a every reach 2 hops on radio over drone[0], drone[2] b"),
        (Route(RADIO, F, F, 0.5, 2.0), "a route 0.5..2 m on radio b"),
        (EveryRoute(PART, F, F, 0.0, math.inf), "a every route 0.. m on radio over drone[0], drone[2] b"),
        (PathLength(PART, 1, 0.5, 2.0), "path to drone[1] 0.5..2 m on radio over drone[0], drone[2]"),
        (At(1, F), "at drone[1] a"),
    ],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_every_node_has_its_words(node: Node, words: str) -> None:
    assert KernelWords(mission_of(3, 4)).of(node, ("a", "b")) == words


def test_what_is_no_leaf_has_a_name_that_whoever_needs_it_says() -> None:
    inside = Atom(ir.Inside(BASE, False))
    shared, always = Any((inside, Not(F))), All(())
    goals = Goal("both", All((shared, Always(shared, 0, 1), always)), SPAN), Goal("some", Any(()), SPAN, 0.5)
    lines = show(Kernel(goals[:1], goals[1:]), mission_of(3, 4)).splitlines()
    word = KernelWords(mission_of(3, 4)).of(inside, ())
    assert lines == [
        f"%1 = any({word}, not is(drone[0]))",
        "%2 = always [0..1] %1",
        "%3 = all(%1, %2, true)",
        "require both = %3",
        "prefer[0.5] some = false",
    ]


def test_a_weight_and_a_length_have_at_most_twelve_digits() -> None:
    assert (asked(None), asked(1 / 3)) == ("require", "prefer[0.333333333333]")
    assert (metres_text(0.1 + 0.2, 1e9), metres_text(2.0, math.inf)) == ("0.3..1000000000 m", "2.. m")


def test_an_inequality_has_its_weights_but_for_one() -> None:
    terms = (1.0, "x"), (2.5, "y"), (-1.0, "z")
    assert KernelWords(mission_of(3, 4)).inequality(terms, -4.0, ">=") == "(x + 2.5*y + -1*z + -4 >= 0)"
