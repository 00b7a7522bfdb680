"""Truth of formulas over time: who leaves another at 2 m/s from 1 m away, in steps of half a second."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missionc import ir
from missionc.base.units import Metres, Seconds
from missionc.geometry.curves.piecewise_polynomials import Curves
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
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.ir.predicates import Compare, Coordinate, DistanceBetween
from missionc.verification.between.interval_sets import STEP, Motion, Signal
from missionc.verification.between.truth_over_time import OTHERS, TruthOverTime, at, last_asked
from tests.support.random_runs import SPAN, mission_of

END = 2 * STEP
ALWAYS, NEVER = Signal(((0, END),), ()), Signal((), ((0, END),))
BIT = STEP >> 13
EARLY, LATE = Signal(((0, STEP - BIT),), ((STEP + BIT, END),)), Signal(((STEP + BIT, END),), ((0, STEP - BIT),))


def along(*lines: tuple[float, float]) -> Motion:
    """Agents on the x axis, each from a place at a speed in m/s."""
    mission = replace(mission_of(len(lines), 2), step=Seconds(0.5))
    rows = [[[[x, v], [0, 0]]] for x, v in lines]
    return Motion(mission, Curves(np.array([0.0, 1.0]), np.array(rows, dtype=np.float64)))


# Who stays, who leaves, and one far away that is on no graph.
MOTION = along((0, 0), (1, 2), (9, 0))
RADIO = ir.Proximity("radio", Metres(2.0), (0, 1), SPAN)
WIDE = ir.Proximity("wide", Metres(99.0), (0, 1), SPAN)
BEYOND = Atom(Compare(((1.0, Coordinate(0)),), -2.0, False))
"""2 m along the axis or more: never of the first, from one step on of the second, always of the third."""
FIRST, SECOND, ALL, NOBODY = (Is(frozenset(each)) for each in ((0,), (1,), (0, 1, 2), ()))


def of(node: Node, *agents: int, motion: Motion = MOTION) -> list[Signal]:
    """When it holds at each of these agents."""
    known = TruthOverTime(motion).of(All(tuple(At(agent, node) for agent in agents)))[node]
    return [known[agent] for agent in agents]


def test_leaves_are_judged_at_each_agent() -> None:
    assert of(BEYOND, 0, 1, 2) == [NEVER, LATE, ALWAYS]
    assert of(Not(BEYOND), 0, 1, 2) == [ALWAYS, EARLY, NEVER]
    assert of(FIRST, 0, 1) == [ALWAYS, NEVER]
    assert of(Not(FIRST), 0, 1) == [NEVER, ALWAYS]


def test_a_predicate_is_worked_out_once_for_all_who_are_asked() -> None:
    evaluation = TruthOverTime(MOTION)
    for agents in ((0, 1), (1, 2)):
        known = evaluation.of(All(tuple(At(agent, BEYOND) for agent in agents)))[BEYOND]
        assert sorted(known) == list(agents)
    assert sorted(agent for _, agent in evaluation.atoms) == [0, 1, 2]
    near = Atom(Compare(((1.0, DistanceBetween(0, 1)),), -2.0, False))
    assert evaluation.of(near)[near] == {0: LATE}
    assert sorted(agent for predicate, agent in evaluation.atoms if predicate is near.predicate) == [OTHERS]


def test_parts_are_judged_together() -> None:
    parts = tuple(At(agent, BEYOND) for agent in (0, 1, 2))
    for node, signal in (
        (All(parts), NEVER),
        (All(parts[1:]), LATE),
        (Any(parts), ALWAYS),
        (Any(parts[:2]), LATE),
        (AtLeast(2, parts), LATE),
        (AtLeast(3, parts), NEVER),
        (All(()), ALWAYS),
        (Any(()), NEVER),
    ):
        assert of(node, 0) == [signal]
    # Of what is asked of two, one may be named by one part alone.
    assert of(Any((BEYOND, FIRST)), 0, 1) == [ALWAYS, LATE]


def test_windows_reach_ahead_and_back() -> None:
    assert of(Eventually(BEYOND, 0, 1), 1) == [Signal(((BIT, END),), ())]
    assert of(Eventually(BEYOND, 1, None), 1) == [Signal(((0, STEP),), ())]
    assert of(Always(BEYOND, 0, None), 1) == [LATE]
    assert of(Always(Not(BEYOND), 0, 1), 1) == [Signal((), ((BIT, END),))]
    once = Signal(((STEP + BIT, END),), ((0, STEP - BIT),))
    assert of(Eventually(BEYOND, -1, 0), 1) == [once]
    assert of(Eventually(Not(BEYOND), -1, -1), 1) == [Signal(((STEP, END - BIT),), ((0, STEP - 1),))]
    # Before the beginning there is nothing to fail.
    assert of(Always(Not(BEYOND), -1, 0), 1) == [once.denied]


def test_until_and_since_and_their_duals() -> None:
    assert of(Until(Not(BEYOND), FIRST, 0, None), 1) == [NEVER]
    # What has to hold before a moment may fail at it.
    assert of(Until(Not(BEYOND), ALL, 1, 1), 1) == [Signal((), ((BIT + 1, END),))]
    assert of(Release(BEYOND, NOBODY, 1, 1), 1) == [Signal(((BIT + 1, END),), ())]
    beginning = Signal(((STEP, END),), ((0, STEP - 1),))
    assert of(Until(Not(BEYOND), ALL, -1, -1), 0, 1) == [beginning, Signal((), ((0, STEP - 1), (STEP + BIT, END)))]
    assert of(Release(BEYOND, NOBODY, -1, -1), 0) == [beginning.denied]


def test_what_looks_ahead_is_not_asked_where_it_would_look_past_the_mission() -> None:
    assert last_asked(1, END) == STEP
    assert of(Until(Eventually(ALL, 1, 1), ALL, 2, 2), 0) == [Signal(((0, 0),), ())]


def test_neighbours_are_those_that_links_lead_to() -> None:
    assert of(Neighbour(RADIO, SECOND), 0, 1, 2) == [EARLY, NEVER, NEVER]
    assert of(Neighbour(WIDE, BEYOND), 0, 1) == [LATE, NEVER]
    assert of(EveryNeighbour(RADIO, NOBODY), 0, 1, 2) == [LATE, LATE, ALWAYS]
    assert of(EveryNeighbour(RADIO, SECOND), 0, 1) == [ALWAYS, LATE]


def test_routes_of_links_lead_out_of_the_graph_by_no_link_at_all() -> None:
    assert of(Reach(RADIO, ALL, SECOND, 1), 0, 1, 2) == [EARLY, ALWAYS, NEVER]
    assert of(Reach(RADIO, NOBODY, SECOND, 1), 0, 1) == [NEVER, ALWAYS]
    assert of(Reach(RADIO, ALL, BEYOND, 1), 2) == [ALWAYS]
    assert of(Reach(RADIO, ALL, SECOND, 0), 0) == [NEVER]
    assert of(EveryReach(RADIO, NOBODY, FIRST, 1), 0, 1, 2) == [LATE, NEVER, NEVER]


@pytest.mark.parametrize(
    ("low", "high", "found"),
    [(0.0, 2.0, [EARLY, ALWAYS, NEVER]), (2.0, math.inf, [LATE, NEVER, NEVER]), (0.0, 0.5, [NEVER, ALWAYS, NEVER])],
)
def test_routes_in_metres(low: float, high: float, found: list[Signal]) -> None:
    assert of(Route(WIDE, ALL, SECOND, low, high), 0, 1, 2) == found
    denied = [signal.denied for signal in found]
    assert of(EveryRoute(WIDE, NOBODY, Not(SECOND), low, high), 0, 1, 2) == denied


def test_who_is_on_no_graph_has_a_route_to_itself_alone_which_has_no_length() -> None:
    assert of(Route(WIDE, ALL, ALL, 0.0, 1.0), 2) == [ALWAYS]
    assert of(Route(WIDE, ALL, ALL, 1.0, 9.0), 2) == [NEVER]


def test_the_shortest_way_to_an_agent() -> None:
    assert of(PathLength(WIDE, 1, 0.0, 2.0), 0, 1, 2) == [EARLY, ALWAYS, NEVER]
    assert of(Not(PathLength(WIDE, 1, 0.0, 2.0)), 0, 1, 2) == [LATE, NEVER, ALWAYS]
    half = STEP // 2
    between = Signal(((half + BIT, 3 * half - BIT),), ((0, half - BIT), (3 * half + BIT, END)))
    assert of(PathLength(WIDE, 1, 1.5, 2.5), 0, 1, 2) == [between, NEVER, NEVER]
    assert of(Not(PathLength(WIDE, 1, 1.5, 2.5)), 0, 1, 2) == [between.denied, ALWAYS, ALWAYS]
    assert of(PathLength(WIDE, 1, 0.5, 9.0), 0, 1) == [ALWAYS, NEVER]
    # To itself who is on no graph has a way, of no length.
    assert of(PathLength(WIDE, 2, 0.0, 2.0), 2, 0) == [ALWAYS, NEVER]
    assert of(PathLength(WIDE, 2, 1.0, 2.0), 2) == [NEVER]


def test_who_is_not_named_is_like_all_others() -> None:
    signals = {OTHERS: NEVER, 1: LATE}
    assert (at(signals, 0), at(signals, 1)) == (NEVER, LATE)
    assert at({1: LATE, 0: EARLY}, 0) == EARLY


def test_nobody_is_on_an_empty_graph() -> None:
    empty = replace(RADIO, agents=())
    assert of(Reach(empty, ALL, SECOND, 1), 0, 1) == [NEVER, ALWAYS]
    assert of(Neighbour(empty, SECOND), 0) == [NEVER]
