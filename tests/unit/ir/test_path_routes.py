"""The shortest way as routes: one that is short enough, and none that is too short; denied, the contrary."""

from __future__ import annotations

import math

from missionc.ir.kernel.nodes import All, Any, EveryRoute, Is, Node, Not, Route
from missionc.ir.kernel.walk import as_routes
from tests.support.random_runs import graphs_of

RADIO = graphs_of(3)[0]


def assert_way(node: Node, kind: type[Route] | type[EveryRoute], most: float) -> None:
    """That it is routes from 0 m on, of at most so many metres, to agent 2, over whomever there is."""
    assert type(node) is kind
    assert (node.graph, node.low, node.high) == (RADIO, 0.0, most)
    end = node.end.body if isinstance(node.end, Not) else node.end
    assert isinstance(end, Is)
    assert end.agents == frozenset((2,))
    assert isinstance(node.end, Not) is (kind is EveryRoute)
    assert isinstance(node.through, All if kind is Route else Any)
    assert node.through.parts == ()


def test_without_a_least_length_one_way_says_it() -> None:
    for low in (0.0, -1.0):
        assert_way(as_routes(RADIO, 2, low, 2.5, True), Route, 2.5)
        assert_way(as_routes(RADIO, 2, low, 2.5, False), EveryRoute, 2.5)


def test_a_least_length_denies_every_way_that_is_shorter() -> None:
    shorter = math.nextafter(0.5, 0.0)
    both = as_routes(RADIO, 2, 0.5, 2.5, True)
    assert isinstance(both, All)
    assert_way(both.parts[0], Route, 2.5)
    assert_way(both.parts[1], EveryRoute, shorter)
    either = as_routes(RADIO, 2, 0.5, 2.5, False)
    assert isinstance(either, Any)
    assert_way(either.parts[0], EveryRoute, 2.5)
    assert_way(either.parts[1], Route, shorter)
