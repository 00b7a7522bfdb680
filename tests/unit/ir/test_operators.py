"""The operators' spellings, and the size and shape of what they grow to."""

from __future__ import annotations

import math

import pytest

from missionc import ir
from missionc.base.units import Metres, Metric, Steps
from missionc.ir.kernel.nodes import All, Any, Is, Node, Not, PathLength, Reach, Release, Route, Until
from missionc.ir.kernel.normal_form import negated
from missionc.ir.kernel.walk import postorder
from missionc.ir.language.operator import Bounds, TooLarge, Use
from missionc.ir.language.operators import OPERATORS, by_name
from tests.support.random_runs import SPAN

F, G = Is(frozenset((0,)), SPAN), Is(frozenset((1,)), SPAN)


def radio(size: int) -> ir.Proximity:
    return ir.Proximity("radio", Metres(1.0), tuple(range(size)), SPAN)


def hops(low: float, high: float, size: int = 5) -> ir.Length:
    return ir.Length(radio(size), Metric.HOPS, low, high, SPAN)


def metres(low: float, high: float, size: int = 5) -> ir.Length:
    return ir.Length(radio(size), Metric.METRES, low, high, SPAN)


def grown(name: str, *arguments: Node, bounds: ir.Window | ir.Length | None = None) -> Node:
    node = by_name[name].expand(Use(arguments, bounds, SPAN))
    assert not isinstance(node, TooLarge)
    return node


def test_letters_and_words_are_told_apart() -> None:
    spellings = [operator.name for operator in OPERATORS] + [each.letter for each in OPERATORS if each.letter]
    assert len(spellings) == len(set(spellings))
    letters = {operator.name: operator.letter for operator in OPERATORS if operator.letter}
    assert letters == {
        "always": "G",
        "eventually": "F",
        "until": "U",
        "release": "Rel",
        "reach": "R",
        "escape": "E",
        "not": "!",
        "and": "&",
        "or": "|",
        "implies": "->",
        "iff": "<->",
    }


def test_spatial_operators_are_those_with_a_length() -> None:
    assert all(operator.spatial == (operator.bounds is Bounds.LENGTH) for operator in OPERATORS)


def test_an_example_shows_its_operator() -> None:
    assert all(operator.name in operator.example for operator in OPERATORS)


def test_every_node_carries_the_words_it_came_from() -> None:
    window = ir.Window(Steps(0), Steps(2), SPAN)
    for operator in OPERATORS:
        bounds: ir.Window | ir.Length | ir.Period | None = {
            Bounds.TIME: window,
            Bounds.PAST: window,
            Bounds.LENGTH: hops(1, 2),
            Bounds.PERIOD: ir.Period(Steps(2), SPAN),
            Bounds.NONE: None,
        }[operator.bounds]
        node = operator.expand(Use((F, G)[: operator.arity], bounds, SPAN, ">=", 2))
        assert not isinstance(node, TooLarge)
        assert all(below.span is SPAN for below in postorder([node]))


def test_a_reach_without_lower_bound_is_one_node() -> None:
    node = grown("reach", F, G, bounds=hops(0, 2))
    assert isinstance(node, Reach)
    assert (node.through, node.end, node.hops) == (F, G, 2)


def test_no_route_is_longer_than_the_graph_has_agents() -> None:
    node = grown("reach", F, G, bounds=hops(0, math.inf))
    assert isinstance(node, Reach)
    assert node.hops == 4
    assert isinstance(never := grown("reach", F, G, bounds=hops(5, 7)), Any)
    assert never.parts == ()


def test_a_lower_bound_of_one_costs_one_reach_for_each_agent() -> None:
    order = postorder([grown("reach", F, G, bounds=hops(1, 2, size=20))])
    assert sum(isinstance(node, Reach) for node in order) == 20
    assert len(order) < 150


def test_a_lower_bound_grows_with_the_sets_left_behind_and_not_with_the_routes() -> None:
    order = postorder([grown("reach", F, G, bounds=hops(4, 9, size=10))])
    routes = 10 * 9 * 8 * 7
    assert sum(isinstance(node, Reach) for node in order) == math.comb(10, 3) * 7 < routes / 5


@pytest.mark.parametrize("bounds", [hops(10, 20, 100), hops(5000, math.inf, 10_000), metres(1.0, 5.0, 40)])
@pytest.mark.parametrize("name", ["reach", "somewhere", "everywhere"])
def test_what_would_grow_too_large_is_refused_before_it_does(name: str, bounds: ir.Length) -> None:
    arguments = (F, G)[: by_name[name].arity]
    node = by_name[name].expand(Use(arguments, bounds, SPAN, room=10_000))
    assert isinstance(node, TooLarge)
    assert node.nodes > 10_000


def test_metres_are_routes_and_distances() -> None:
    route = grown("reach", F, G, bounds=metres(0.0, 5.0))
    assert isinstance(route, Route)
    assert (route.low, route.high) == (0.0, 5.0)
    distances = [
        node for node in postorder([grown("escape", F, bounds=metres(2.0, 5.0))]) if isinstance(node, PathLength)
    ]
    assert {(node.agent, node.low, node.high) for node in distances} == {(agent, 2.0, 5.0) for agent in range(5)}


def test_an_escape_of_no_distance_is_its_operand() -> None:
    assert grown("escape", F, bounds=hops(0, 2)) is F


def test_an_escape_grows_with_the_agents() -> None:
    small, large = (len(postorder([grown("escape", F, bounds=hops(2, math.inf, n))])) for n in (10, 20))
    assert large <= 2 * small


def test_a_release_is_the_dual_of_an_until() -> None:
    node = grown("release", F, G, bounds=ir.Window(Steps(1), None, SPAN))
    assert isinstance(node, Release)
    assert (node.hold, node.end, node.low, node.high) == (F, G, 1, None)
    assert isinstance(until := negated(node), Until)
    assert [isinstance(each, Not) and each.body for each in (until.hold, until.end)] == [F, G]


def test_surround_within_no_bounds_asks_for_no_distance() -> None:
    near = grown("surround", F, G, bounds=hops(0, 2))
    whole = grown("surround", F, G, bounds=hops(0, math.inf))
    assert isinstance(near, All)
    assert isinstance(whole, All)
    assert (len(near.parts), len(whole.parts)) == (3, 2)
