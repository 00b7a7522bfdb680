"""Margins of predicates, links and formations."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import get_args

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from missionc import ir
from missionc.base.trace import Trace
from missionc.base.units import Metres
from missionc.ir.couplings import directed
from missionc.ir.language.margins import links
from missionc.ir.language.margins.predicate_margins import (
    algebraic_connectivity,
    all_links,
    formation_margin,
    holds,
    link_margin,
    margin,
    of_pair,
    of_states,
)
from missionc.ir.predicates.facts import PredicateFacts
from tests.support.random_runs import BASE, FIELD, MAST, SPAN, graphs_of, mission_of, trace_of


def random_trace(size: int, steps: int, seed: int = 0) -> Trace:
    generator = np.random.default_rng(seed)
    return trace_of(generator.uniform(0.0, 3.0, (size, steps + 1, 2)).tolist())


def single(x: float, y: float) -> Trace:
    return trace_of([[(x, y)]])


def at(predicate: ir.Predicate, x: float, y: float) -> float:
    return float(margin(predicate, mission_of(1, 0), single(x, y))[0, 0])


def test_a_region_is_about_the_centre_and_inside_and_touches_about_the_body() -> None:
    assert at(ir.Inside(BASE, body=False), 0.5, 0.75) == pytest.approx(0.5)
    assert at(ir.Inside(BASE, body=True), 0.5, 0.75) == pytest.approx(0.0)
    assert at(ir.Touches(BASE), 1.25, 0.75) == pytest.approx(0.25)
    assert at(ir.Touches(BASE), 2.0, 0.75) == pytest.approx(-0.5)


def test_regions_and_tolerances_hold_at_their_border_and_strict_comparisons_do_not() -> None:
    zero = np.zeros(1)
    assert holds(ir.Inside(BASE, body=False), zero).all()
    assert holds(ir.Touches(BASE), zero).all()
    at_least, more = (ir.Compare(((1.0, ir.Coordinate(0)),), 0.0, strict) for strict in (False, True))
    assert holds(at_least, zero).all()
    assert not holds(more, zero).any()
    assert not holds(ir.Connected(graphs_of(2)[0], (0, 1)), zero).any()


def test_a_comparison_is_scaled_to_metres() -> None:
    slanted = ir.Compare(((3.0, ir.Coordinate(0)), (4.0, ir.Coordinate(1))), -5.0, strict=False)
    assert at(slanted, 3.0, 4.0) == pytest.approx(20.0 / 5.0)
    twice = ir.Compare(((-2.0, ir.DistanceTo(MAST)),), 4.0, strict=False)
    assert at(twice, 1.0, 0.5) == pytest.approx(2.0)


def test_a_comparison_of_speed_alone_stays_in_metres_per_second() -> None:
    slow = ir.Compare(((-2.0, ir.Speed()),), 3.0, strict=False)
    trace = trace_of([[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0)]])
    assert margin(slow, mission_of(1, 2), trace).tolist() == [[0.5, 1.5, 1.5]]


def test_altitude_is_the_teams_own_in_a_plane_and_the_third_coordinate_in_a_volume() -> None:
    high = ir.Compare(((1.0, ir.Altitude()),), -0.25, strict=False)
    assert at(high, 0.0, 0.0) == pytest.approx(0.75)
    volume = replace(mission_of(1, 0), world=ir.World((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), SPAN))
    assert margin(high, volume, trace_of([[(0.0, 0.0, 0.5)]]))[0, 0] == pytest.approx(0.25)
    assert ir.Compare(((1.0, ir.Altitude()), (1.0, ir.Coordinate(0))), 0.0, False).scale(3) == math.sqrt(2.0)


@given(st.integers(0, 1000))
def test_a_comparison_changes_by_a_metre_at_most_when_the_agent_moves_by_one(seed: int) -> None:
    generator = np.random.default_rng(seed)
    features: list[ir.Feature] = [ir.Coordinate(0), ir.Coordinate(1), ir.DistanceTo(FIELD), ir.DistanceTo(MAST)]
    weights = generator.uniform(-3, 3, len(features)).tolist()
    predicate = ir.Compare(tuple(zip(weights, features, strict=True)), 0.5, strict=False)
    first, second = generator.uniform(-1, 4, (2, 2))
    change = abs(at(predicate, *first) - at(predicate, *second))
    assert change <= math.dist(first, second) + 1e-9


def test_margins_of_states_are_those_of_the_trace() -> None:
    mission, trace = mission_of(3, 4), random_trace(3, 4)
    predicates: list[ir.Predicate] = [
        ir.Inside(FIELD, body=False),
        ir.Inside(FIELD, body=True),
        ir.Touches(FIELD),
        ir.Compare(((1.0, ir.Speed()), (2.0, ir.Coordinate(1)), (-1.0, ir.DistanceTo(BASE))), -1.0, strict=False),
        ir.Compare(((1.0, ir.Altitude()),), -1.0, strict=False),
    ]
    for predicate in predicates:
        whole = margin(predicate, mission, trace)
        for agent in range(3):
            own = of_states(predicate, mission, agent, trace.position[agent], trace.velocity[agent])
            assert own.tolist() == whole[agent].tolist()


def test_margins_of_a_pair_are_those_of_the_trace() -> None:
    mission, trace = mission_of(3, 4), random_trace(3, 4)
    near = ir.Compare(((-1.0, ir.DistanceTo(2)), (0.5, ir.Coordinate(0))), 1.0, strict=False)
    apart = ir.Compare(((1.0, ir.DistanceBetween(2, 0)),), -1.0, strict=True)
    first, second = trace.position[0], trace.position[2]
    assert of_pair(near, mission, 0, 2, first, second).tolist() == margin(near, mission, trace)[0].tolist()
    assert of_pair(apart, mission, 0, 2, first, second).tolist() == margin(apart, mission, trace).tolist()


def test_what_a_state_or_a_pair_does_not_decide_is_refused() -> None:
    mission = mission_of(3, 0)
    here = np.zeros((1, 2))
    with pytest.raises(ValueError, match="depends on more than"):
        of_states(ir.Compare(((1.0, ir.DistanceTo(1)),), 0.0, False), mission, 0, here, here)
    with pytest.raises(ValueError, match="third agent"):
        of_pair(ir.Compare(((1.0, ir.DistanceTo(2)),), 0.0, False), mission, 0, 1, here, here)
    with pytest.raises(ValueError, match="comparisons"):
        of_pair(ir.Touches(BASE), mission, 0, 1, here, here)
    assert of_states(ir.Compare(((1.0, ir.DistanceTo(0)),), 0.0, False), mission, 0, here, here).tolist() == [0.0]


def test_a_beacon_link_is_as_good_as_the_worse_of_two_agents_at_their_best_beacon() -> None:
    cell = ir.BeaconCover("cell", Metres(2.0), ((0.0, 0.0), (10.0, 0.0)), (0, 1), SPAN)
    first, second = np.array([1.0, 0.0]), np.array([0.0, 1.5])
    assert link_margin(cell, 0, 1, first, second) == pytest.approx(0.5)
    assert link_margin(cell, 0, 1, first, np.array([9.0, 0.0])) == pytest.approx(-7.0)


def test_no_agent_is_linked_to_itself_and_links_go_both_ways_where_ranges_do() -> None:
    for graph in graphs_of(4):
        everything = all_links(graph, random_trace(4, 3).position)
        assert everything.shape == (4, len(graph.agents), len(graph.agents))
        assert np.isneginf(np.diagonal(everything, axis1=1, axis2=2)).all()
        assert np.array_equal(everything, everything.swapaxes(1, 2)) is not directed(graph)


@given(st.integers(0, 1000))
def test_connectivity_is_the_worst_link_of_the_best_tree_and_positive_where_the_graph_is_connected(seed: int) -> None:
    mission, trace = mission_of(5, 2), random_trace(5, 2, seed)
    radio = ir.Proximity("radio", Metres(1.5), tuple(range(5)), SPAN)
    margins = margin(ir.Connected(radio, radio.agents), mission, trace)
    second = algebraic_connectivity(radio, trace)
    for step in range(3):
        edges = all_links(radio, trace.position)[step]
        lengths = np.where(np.isneginf(edges), 0.0, radio.radius - edges)
        assert margins[step] == pytest.approx(radio.radius - minimum_spanning_tree(lengths).toarray().max())
        components, _ = connected_components(edges > 0)
        assert (components == 1) == (margins[step] > 0) == (second[step] > 1e-9)


@given(st.integers(0, 1000), st.integers(2, 4))
def test_connectivity_of_a_higher_order_is_that_of_all_who_may_be_left(seed: int, order: int) -> None:
    networkx = pytest.importorskip("networkx")
    mission, trace = mission_of(5, 2), random_trace(5, 2, seed)
    radio = ir.Proximity("radio", Metres(2.0), tuple(range(5)), SPAN)
    margins = margin(ir.Connected(radio, radio.agents, order), mission, trace)
    assert (margins <= margin(ir.Connected(radio, radio.agents), mission, trace)).all()
    for step in range(3):
        linked = networkx.from_numpy_array(all_links(radio, trace.position)[step] > 0)
        assert (networkx.node_connectivity(linked) >= order) == (margins[step] > 0)


def test_a_ring_survives_one_loss_by_its_longest_link_and_no_second() -> None:
    ring = trace_of([[(0.0, 0.0)], [(1.0, 0.0)], [(1.25, 1.0)], [(0.0, 1.0)]])
    radio = ir.Proximity("radio", Metres(1.3), (0, 1, 2, 3), SPAN)
    assert margin(ir.Connected(radio, radio.agents, 2), mission_of(4, 0), ring).tolist() == pytest.approx([0.05])
    assert margin(ir.Connected(radio, radio.agents, 3), mission_of(4, 0), ring)[0] < 0


def test_connectivity_of_some_agents_goes_over_those_alone() -> None:
    line = trace_of([[(0.0, 0.0)], [(1.0, 0.0)], [(2.0, 0.0)]])
    radio = ir.Proximity("radio", Metres(1.5), (0, 1, 2), SPAN)
    assert margin(ir.Connected(radio, (0, 1, 2)), mission_of(3, 0), line).tolist() == [0.5]
    assert margin(ir.Connected(radio, (0, 2)), mission_of(3, 0), line).tolist() == [-0.5]
    assert margin(ir.Connected(radio, (1,)), mission_of(3, 0), line).tolist() == [math.inf]


def test_a_long_trace_is_judged_in_pieces_to_the_same_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    trace, graph = random_trace(4, 20), graphs_of(4)[0]
    whole = algebraic_connectivity(graph, trace)
    monkeypatch.setattr(links, "ELEMENTS", 48)
    assert len(list(links.link_pieces(21, 4))) == 7
    assert algebraic_connectivity(graph, trace).tolist() == whole.tolist()


def test_formations_keep_distances_and_offsets_within_their_tolerance() -> None:
    edges = (ir.FormationEdge(0, 1, 1.0), ir.FormationEdge(1, 2, (1.0, 0.0)))
    wall = ir.Formation("wall", "line", (0, 1, 2), edges, Metres(0.5), False, SPAN)
    total = replace(wall, total=True)
    trace = trace_of([[(0.0, 0.0)], [(1.25, 0.0)], [(2.25, 0.5)]])
    mission = mission_of(3, 0)
    assert margin(ir.InFormation(wall), mission, trace).tolist() == [0.0]
    assert margin(ir.InFormation(total), mission, trace).tolist() == [-0.25]
    assert formation_margin(wall, edges[0], trace.position[0], trace.position[1]).tolist() == [0.25]


def test_every_kind_of_predicate_has_each_meaning_that_is_asked_of_one(subtests: pytest.Subtests) -> None:
    of_missions = [kind for kind in get_args(ir.Predicate) if kind is not ir.DuringMotion]
    for kind, meaning in product(of_missions, ["margin", "rate", "moved", "show", "phrases"]):
        with subtests.test(kind=kind, meaning=meaning):
            assert issubclass(kind, PredicateFacts)
            assert getattr(kind, meaning) is not getattr(PredicateFacts, meaning)
