"""Robustness at the first and the last step from starts and finishes: points, a region of half a metre, or anywhere."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Metres, Seconds
from missionc.frontend.checks.free_space import FreeSpace
from missionc.ir.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    Atom,
    EveryNeighbour,
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Route,
)
from missionc.verification.monitoring import interval_robustness
from missionc.verification.monitoring.interval_robustness import Intervals, RobustnessInterval
from tests.support.random_runs import SPAN, mission_of

INF = math.inf
ANYTHING = (-INF, INF)
YARD = ir.Region("yard", ir.Box((1.5, 0.5), (2.5, 0.5 + 1e-9)), SPAN)
"""Half a metre to either side of (2, 0.5)."""
RADIO = ir.Proximity("radio", Metres(2.0), (0, 1, 2), SPAN)


def mission(agents: int = 3) -> ir.Mission:
    """The first goes from (0.5, 0.5) to (1.5, 0.5), the second is in the yard first, the third comes to (1, 1.5)."""
    made = replace(mission_of(agents, 4), step=Seconds(0.5))
    places: list[tuple[ir.InitialSet, ir.InitialSet | None]] = [
        (ir.InitialSet(SPAN, (0.5, 0.5)), ir.InitialSet(SPAN, (1.5, 0.5))),
        (ir.InitialSet(SPAN, region=YARD), None),
        (ir.InitialSet(SPAN, (1.0, 1.0)), ir.InitialSet(SPAN, (1.0, 1.5))),
    ]
    everybody = [*places, *[places[2]] * (agents - 3)]
    return replace(
        made,
        agents=tuple(
            replace(agent, start=start, finish=finish)
            for agent, (start, finish) in zip(made.agents, everybody, strict=True)
        ),
    )


def intervals(made: ir.Mission | None = None) -> Intervals:
    made = made or mission()
    return Intervals(made, FreeSpace.of(made).atlas)


def of(node: Node, *agents: int, known: Intervals | None = None) -> list[list[tuple[float, float]]]:
    """The intervals of these agents, each at the first and at the last step."""
    (found,) = [(known or intervals()).of([node])[node]]
    rows = np.broadcast_to(found.least, (3, 2)), np.broadcast_to(found.most, (3, 2))
    return [list(zip(rows[0][agent].tolist(), rows[1][agent].tolist(), strict=True)) for agent in agents]


def near(*bounds: tuple[float, float]) -> object:
    return [pytest.approx(each, abs=1e-6) for each in bounds]


def least(value: float, feature: ir.Feature) -> Atom:
    return Atom(ir.Compare(((1.0, feature),), -value, False))


EAST = least(1.0, ir.Coordinate(0))


def test_a_margin_is_that_of_the_place_and_what_the_place_leaves_open() -> None:
    first, second, third = of(EAST, 0, 1, 2)
    assert first == near((-0.5, -0.5), (0.5, 0.5))
    assert second == near((0.5, 1.5), ANYTHING)
    assert third == near((0.0, 0.0), (0.0, 0.0))
    assert of(Not(EAST), 1)[0] == near((-1.5, -0.5), ANYTHING)
    steep = Atom(ir.Compare(((3.0, ir.Coordinate(0)), (4.0, ir.Coordinate(1))), -5.0, False))
    # 3 and 4 metres a metre, of which the margin is the fifth part: by their sum, which is not less than its length.
    low, high = of(steep, 1)[0][0]
    assert (low, high) == pytest.approx((0.6 - 0.7, 0.6 + 0.7), abs=1e-6)


def test_a_border_counts_as_it_does() -> None:
    assert of(EAST, 2)[0][0] == (5e-324, 5e-324)
    strict = Atom(ir.Compare(((1.0, ir.Coordinate(0)),), -1.0, True))
    assert of(strict, 2)[0][0] == (-5e-324, -5e-324)


def test_distances_are_open_by_both_places() -> None:
    apart = least(0.25, ir.DistanceTo(1))
    # The middle of the yard is 1.5 m from the first one.
    assert of(apart, 0)[0] == near((0.75, 1.75), ANYTHING)
    both = least(0.25, ir.DistanceBetween(0, 2))
    assert of(both, 0)[0] == near((math.sqrt(0.5) - 0.25,) * 2, (math.sqrt(1.25) - 0.25,) * 2)
    named = least(0.25, ir.DistanceBetween(0, 1))
    assert of(named, 2)[0] == near((0.75, 1.75), ANYTHING)


def test_what_reads_the_past_or_headings_or_speeds_is_open() -> None:
    fuel = ir.Resource("fuel", (0, 1, 2), 9.0, 9.0, 1.0, 1.0, (), SPAN)
    for node in (least(1.0, ir.Speed()), least(1.0, ir.Level(fuel)), Atom(ir.Facing(0.0, 1.0))):
        assert of(node, 0)[0] == [ANYTHING, ANYTHING]


def test_who_is_asked_is_known() -> None:
    one = Is(frozenset((1,)))
    assert of(one, 0, 1) == [[(-INF, -INF)] * 2, [(INF, INF)] * 2]
    assert of(Not(one), 0, 1) == [[(INF, INF)] * 2, [(-INF, -INF)] * 2]
    assert of(At(2, EAST), 0)[0] == near((0.0, 0.0), (0.0, 0.0))


def test_parts_are_taken_together() -> None:
    parts = At(0, EAST), At(1, EAST), At(2, EAST)
    assert of(All(parts), 0)[0] == near((-0.5, -0.5), (-INF, 0.0))
    assert of(Any(parts), 0)[0] == near((0.5, 1.5), (0.5, INF))
    assert of(AtLeast(2, parts), 0)[0] == near((0.0, 0.0), (0.0, 0.5))
    assert of(All(()), 0)[0] == [(INF, INF)] * 2


def test_links_are_open_by_both_places_and_nobody_is_linked_to_itself() -> None:
    links = intervals().links(RADIO)
    assert np.isneginf(np.diagonal(links.most, axis1=1, axis2=2)).all()
    assert (links.least[0, 0, 1], links.most[0, 0, 1]) == pytest.approx((0.0, 1.0), abs=1e-6)
    assert links.least[0, 0, 2] == links.most[0, 0, 2] == pytest.approx(2 - math.sqrt(0.5))
    assert (links.least[1, 0, 1], links.most[1, 0, 1]) == ANYTHING
    assert intervals().links(RADIO).least.shape == (2, 3, 3)


def test_a_neighbour_is_there_for_sure_or_may_be() -> None:
    second = Is(frozenset((1,)))
    assert of(Neighbour(RADIO, second), 0)[0] == near((0.0, 1.0), ANYTHING)
    assert of(EveryNeighbour(RADIO, Not(second)), 0)[0] == near((-1.0, 0.0), ANYTHING)
    assert of(Reach(RADIO, All(()), second, 1), 0, 1) == [near((0.0, 1.0), ANYTHING), [(INF, INF)] * 2]


def test_routes_in_metres_are_known_where_all_places_are_points() -> None:
    both = replace(RADIO, agents=(0, 2))
    third = Is(frozenset((2,)))
    short = Route(both, All(()), third, 0.0, 1.0)
    assert of(short, 0)[0] == near((1 - math.sqrt(0.5),) * 2, (1 - math.sqrt(1.25),) * 2)
    way = PathLength(both, 2, 0.0, 1.0)
    assert of(way, 0)[0] == near((1 - math.sqrt(0.5),) * 2, (1 - math.sqrt(1.25),) * 2)
    assert of(Not(way), 0)[0] == near((math.sqrt(0.5) - 1,) * 2, (math.sqrt(1.25) - 1,) * 2)
    # With the second on the graph, whose place is none, nothing is said.
    assert of(Route(RADIO, All(()), third, 0.0, 1.0), 0)[0] == [ANYTHING, ANYTHING]
    # Of the beginning alone, where the first and the third come to points and the second is one then.
    fixed = mission()
    point = replace(fixed.agents[1], start=ir.InitialSet(SPAN, (1.0, 0.5)))
    fixed = replace(fixed, agents=(fixed.agents[0], point, fixed.agents[2]))
    known = of(Route(RADIO, All(()), third, 0.0, 1.0), 0, known=intervals(fixed))[0]
    assert known == [pytest.approx((1 - math.sqrt(0.5),) * 2), ANYTHING]


def test_of_too_many_agents_or_formulas_nothing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    near_by = Neighbour(RADIO, Is(frozenset((1,))))
    way = PathLength(replace(RADIO, agents=(0, 2)), 2, 0.0, 1.0)
    monkeypatch.setattr(interval_robustness, "MOST_MEMBERS", 3)
    monkeypatch.setattr(interval_robustness, "MOST_ROUTES", 2)
    assert of(near_by, 0)[0][0] != ANYTHING
    assert of(way, 0)[0][0] != ANYTHING
    monkeypatch.setattr(interval_robustness, "MOST_MEMBERS", 2)
    monkeypatch.setattr(interval_robustness, "MOST_ROUTES", 1)
    assert of(near_by, 0)[0] == [ANYTHING, ANYTHING]
    assert of(way, 0)[0] == [ANYTHING, ANYTHING]
    monkeypatch.setattr(interval_robustness, "MOST_NODES", 2)
    assert set(intervals().of([All((EAST,))])) != set()
    assert intervals().of([All((EAST, near_by))]) == {}


def test_the_edge_of_a_formation_that_is_furthest_off_is_named() -> None:
    edges = ir.FormationEdge(0, 1, 1.5), ir.FormationEdge(0, 2, 1.5)
    row = ir.Formation("row", "chain", (0, 1, 2), edges, Metres(0.25), False, SPAN)
    known = intervals()
    # At first the second is a metre and a half away, the third less; at last the third is 1.118 m away.
    assert known.worst_edge(row, 0) is edges[1]
    assert known.worst_edge(row, 0) is edges[1]
    assert known.worst_edge(replace(row, edges=edges[:1]), 1) is edges[0]


def test_an_interval_has_a_column_for_each_end() -> None:
    found = intervals().of([EAST])[EAST]
    assert isinstance(found, RobustnessInterval)
    assert found.least.shape == found.most.shape == (3, 2)
