"""The order in which transport plans agents: couplings by phase, and what follows what."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise, permutations
from pathlib import Path

import numpy as np
import pytest

from missionc import ir
from missionc.backends.clot.paper.planning_sequence import (
    Couplings,
    Edge,
    communication,
    couplings,
    in_any_order,
    in_order,
    of_phases,
)
from missionc.base.source import Source
from missionc.base.trace import Array
from missionc.base.units import Metres
from missionc.compiler.driver import check
from missionc.ir.kernel.analysis import relevance
from missionc.ir.kernel.nodes import (
    All,
    Always,
    At,
    Atom,
    Eventually,
    Goal,
    Is,
    Kernel,
    Neighbour,
    Node,
    Not,
    Reach,
    Until,
)
from tests.support.check_findings import text
from tests.support.legal_plans import NOTHING, SPAN, mission_of

ROOT = Path(__file__).resolve().parents[3]

LINE = [(1.0, 1.0), (2.0, 1.0), (3.0, 1.0), (9.0, 1.0)]
"""The radio of ``mission_of`` reaches 2 m."""


def coupled(
    source: str, name: str = "sample.mission", dock: tuple[float, float] = (0.0, 0.0), nearest: bool = False
) -> Couplings:
    """Of a mission text; agents that may start anywhere stand in a row at 0.3 m from ``dock`` on."""
    checked = check(Source(name, source))
    assert checked.mission is not None, checked.findings
    assert checked.kernel is not None
    points = [
        agent.start.point if agent.start.point is not None else (dock[0] + 0.3 * agent.index, dock[1])
        for agent in checked.mission.agents
    ]
    return couplings(checked.mission, checked.kernel, np.array(points), nearest)


def corpus(name: str) -> Couplings:
    return coupled((ROOT / "missions" / f"{name}.mission").read_text(encoding="utf-8"), name, dock=(0.5, 5.0))


def required(formula: Node, starts: Array | None = None, steps: int = 10) -> list[tuple[int, int, set[Edge]]]:
    """First step, last step and edges of the phases of one requirement."""
    points = np.array(LINE) if starts is None else starts
    kernel = Kernel((Goal("made", formula, SPAN),), ())
    found = couplings(mission_of(points.tolist(), steps), kernel, points)
    return [(phase.first, phase.last, set(phase.edges)) for phase in found.phases]


def chain(*agents: int) -> set[Edge]:
    return set(pairwise(agents))


def apart(first: int, second: int) -> Node:
    return Atom(ir.Compare(((-1.0, ir.DistanceBetween(first, second)),), 2.0, False))


def is_valid(found: Couplings, sequence: tuple[int, ...]) -> bool:
    return all(found.may_follow(sequence[:place], agent) for place, agent in enumerate(sequence))


def test_a_chain_that_must_last_couples_consecutive_agents_throughout() -> None:
    (phase,) = corpus("clot_dynamic").phases
    assert (phase.first, phase.last) == (0, 31)
    assert phase.edges == chain(0, 1, 2, 3, 4)


STAR = {(0, 2), (1, 2), (2, 3), (2, 4)}


def test_formations_under_an_or_couple_both_their_edges_and_each_its_own() -> None:
    phases = corpus("clot_star").phases
    assert {(phase.first, phase.last) for phase in phases} == {(0, 47)}
    made = [set(phase.edges) for phase in phases]
    assert len(made) == 3
    assert all(edges in made for edges in (chain(0, 1, 2, 3, 4), STAR, chain(0, 1, 2, 3, 4) | STAR))


def test_who_follows_is_coupled_in_each_formation_that_there_may_be() -> None:
    found = corpus("clot_star")
    valid = [order for order in permutations(range(5)) if is_valid(found, order)]
    for order in valid:
        assert 2 in order[:2], "the middle of the star"
        assert all(max(order[:place]) - min(order[:place]) < place for place in range(1, 6)), "a piece of the chain"
    assert len(valid) == 12


def test_a_star_about_the_end_of_a_chain_leaves_the_two_sequences_of_the_paper() -> None:
    text = (ROOT / "missions" / "clot_star.mission").read_text(encoding="utf-8")
    for other in (1, 3, 4):
        text = text.replace(f"2-{other}:", f"0-{other}:")
    found = coupled(text.replace("2-0:", "0-2:"), "clot_star", dock=(0.5, 5.0))
    valid = [order for order in permutations(range(5)) if is_valid(found, order)]
    assert valid == [(0, 1, 2, 3, 4), (1, 0, 2, 3, 4)]
    assert found.next_agents(frozenset()) == (0, 1), "nobody else can be the first"


def test_the_windows_of_until_cut_the_corridor_into_phases() -> None:
    found = corpus("clot_corridor")
    assert [(phase.first, phase.last) for phase in found.phases] == [(0, 23), (24, 47)]
    linked, row = (phase.edges for phase in found.phases)
    assert row == set(combinations(range(12), 2)), "each has its place beside each other one in a straight line"
    assert linked < row


@pytest.mark.parametrize(("name", "teams", "size"), [("clot_split", 5, 6), ("clot_split100", 10, 10)])
def test_split_teams_are_lines_first_and_one_fleet_later(name: str, teams: int, size: int) -> None:
    found = corpus(name)
    split, both, merged = found.phases
    assert [(phase.first, phase.last) for phase in found.phases] == [(0, 23), (24, 24), (25, 47)]
    assert both.edges == split.edges | merged.edges
    members = [range(team * size, (team + 1) * size) for team in range(teams)]
    assert split.edges == set().union(*(combinations(team, 2) for team in members))
    assert len(set(split.part)) == teams
    assert len(set(merged.part)) == 1
    across = {(one, other) for one, other in merged.edges if one // size != other // size}
    assert across == {((team - 1) * size, team * size) for team in range(1, teams)}, "one bridge from team to team"
    assert found.components == (frozenset(range(teams * size)),)


def test_among_the_nearest_of_a_rigid_line_a_sequence_grows_at_its_ends() -> None:
    text = (ROOT / "missions" / "clot_corridor.mission").read_text(encoding="utf-8")
    found = coupled(text, "clot_corridor", nearest=True)
    assert set(found.phases[-1].edges) == chain(*range(12)), "at the end, when no link is asked for"
    assert found.valid_agents(frozenset({4})) == (3, 5)
    assert is_valid(found, (4, 3, 5, 2, 1, 0, *range(6, 12)))


@pytest.mark.parametrize(
    ("formation", "edges"),
    [
        ("grid of drone columns 2 spacing 1 m", {(0, 1), (2, 3), (0, 2), (1, 3)}),
        ("distances of drone (0-1: 1 m, 0-2: 2 m, 0-3: 3 m)", {(0, 1), (0, 2), (0, 3)}),
        ("distances of drone (0-1: 1 m, 1-2: 1 m, 0-2: 2 m, 2-3: 1 m)", {(0, 1), (1, 2), (2, 3)}),
    ],
)
def test_a_pair_of_a_formation_is_coupled_where_one_of_them_has_nobody_nearer(formation: str, edges: set[Edge]) -> None:
    text = f"""\
mission figure
time step 1 s, horizon 4 s
world (0, 0) to (9, 9)
team drone[4] {{ radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start grid (1, 1) to (2, 2) }}
formation shape = {formation} tolerance 0.2 m
require keep: always[1 s, 4 s] shape
"""
    assert set(coupled(text, nearest=True).whole.edges) == edges


def test_a_sequence_of_the_split_mission_begins_a_team_over_a_bridge_and_keeps_to_the_teams() -> None:
    found = corpus("clot_split")
    assert is_valid(found, (2, 1, 0, 6, 7))
    assert not found.may_follow({2}, 6), "no link between the teams but from their first agents"
    assert found.may_follow({0, 6}, 8), "its place in the line follows from that of agent 6"
    assert not found.may_follow({0}, 12), "two teams away"
    assert not found.may_follow({0}, 0)


def test_a_chain_has_as_many_valid_sequences_as_ways_to_grow_an_interval() -> None:
    found = corpus("clot_dynamic")
    valid = [order for order in permutations(range(5)) if is_valid(found, order)]
    assert len(valid) == 2**4
    assert all(max(order[:n]) - min(order[:n]) == n - 1 for order in valid for n in range(1, 6))


@pytest.mark.parametrize("name", ["clot_corridor", "clot_regions", "clot_split", "clot_split100", "clot_visit"])
def test_what_is_offered_step_by_step_is_valid_and_reaches_everybody(name: str) -> None:
    found, rng = corpus(name), np.random.default_rng(4)
    agents = len(found.whole.part)
    for first in (0, agents // 2, agents - 1):
        fixed = found.breadth_first(first)
        assert fixed[0] == first
        assert is_valid(found, fixed)
        order: tuple[int, ...] = (first,)
        while offered := found.next_agents(frozenset(order)):
            order += (int(rng.choice(offered)),)
        assert is_valid(found, order)
        assert sorted(order) == sorted(fixed) == list(range(agents))


def test_the_root_offers_everybody() -> None:
    assert corpus("clot_dynamic").next_agents(frozenset()) == (0, 1, 2, 3, 4)


def test_breadth_first_goes_outward_from_the_first() -> None:
    star = of_phases([(0, 5, [(0, 1), (0, 2), (2, 3), (1, 4)])], 5)
    assert star.breadth_first(0) == (0, 1, 2, 4, 3)
    assert star.breadth_first(3) == (3, 2, 0, 1, 4)


def test_agents_that_nothing_couples_are_components_of_their_own_and_come_after_the_begun_ones() -> None:
    pair = of_phases([(0, 5, [(1, 2)])], 4)
    assert pair.components == (frozenset({0}), frozenset({1, 2}), frozenset({3}))
    assert pair.next_agents(frozenset({1})) == (2,)
    assert pair.next_agents(frozenset({1, 2})) == (0, 3)
    assert pair.may_follow({1}, 0)


def test_an_agent_needs_a_planned_neighbour_in_every_phase_that_couples_it() -> None:
    found = of_phases([(0, 4, [(0, 1), (1, 2)]), (5, 9, [(0, 1), (0, 2)])], 3)
    assert not found.may_follow({0}, 2), "in the first phase its neighbour is agent 1"
    assert found.may_follow({0, 1}, 2)
    assert [order for order in permutations(range(3)) if is_valid(found, order)] == [(0, 1, 2), (1, 0, 2)]
    assert found.next_agents(frozenset({2})) == (0, 1), "no valid sequence begins with it: each meets one phase"


def test_a_valid_agent_is_coupled_in_every_phase_where_those_offered_may_only_meet_the_most() -> None:
    crossed = of_phases([(0, 1, [(0, 1), (1, 2), (2, 3)]), (2, 3, [(0, 2), (2, 1), (1, 3)])], 4)
    assert crossed.next_agents(frozenset({0})) == (1, 2)
    assert crossed.valid_agents(frozenset({0})) == (), "1 and 2 have to be the first two"
    assert crossed.valid_agents(frozenset()) == (1, 2)
    assert crossed.valid_agents(frozenset({1, 2})) == (0, 3)


def test_where_no_sequence_is_valid_those_that_meet_the_most_phases_are_offered_all_the_same() -> None:
    hopeless = of_phases([(0, 1, [(0, 1), (1, 2), (2, 3)]), (2, 3, [(1, 3), (3, 0), (0, 2)])], 4)
    assert hopeless.valid_agents(frozenset({0})) == hopeless.next_agents(frozenset({0})) == (1, 2, 3)


def test_an_agent_alone_changes_nothing_for_a_component_without_a_valid_sequence() -> None:
    with_scout = of_phases([(0, 1, [(0, 1), (1, 2), (2, 3)]), (2, 3, [(1, 3), (3, 0), (0, 2)])], 5)
    assert with_scout.valid_agents(frozenset({0, 4})) == (1, 2, 3)


def test_a_phase_without_edges_of_an_agent_does_not_bind_it() -> None:
    found = of_phases([(0, 4, [(0, 1)]), (5, 9, [(0, 1), (1, 2)])], 3)
    assert found.may_follow({1}, 2)
    assert not found.may_follow({0}, 2)


def test_an_agent_that_is_free_in_every_phase_still_needs_a_neighbour_once_its_component_is_begun() -> None:
    found = of_phases([(0, 4, [(0, 1), (2, 3)]), (5, 9, [(1, 2)])], 4)
    assert found.components == (frozenset(range(4)),)
    assert all(phase.meets({0}, 3) for phase in found.phases)
    assert not found.may_follow({0}, 3)
    assert found.may_follow({0, 1, 2}, 3)


def test_the_parent_is_the_nearest_planned_neighbour() -> None:
    found = of_phases([(0, 4, [(0, 3), (1, 3)]), (5, 9, [(2, 3)])], 5)
    positions = np.array([[3.0, 0.0], [2.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.1, 0.0]])
    assert found.parent(3, {0, 1, 2, 4}, positions) == 2, "agent 4 is nearer and not coupled"
    assert found.parent(3, {0, 1}, positions) == 1
    assert found.parent(3, {4}, positions) is None
    assert found.neighbours(3, 0) == {0, 1}
    assert found.neighbours(3, 1) == {2}


def test_linked_agents_communicate_and_the_nearest_join_the_rest() -> None:
    graph = ir.Proximity("radio", Metres(1.5), (0, 1, 2, 3), SPAN)
    assert communication(graph, np.array(LINE)) == chain(0, 1, 2, 3), "6 m is the shortest bridge"
    assert communication(replace(graph, agents=(0, 2)), np.array(LINE)) == {(0, 2)}
    beacons = ir.BeaconCover("mast", Metres(1.5), ((2.0, 1.0),), (0, 1, 2), SPAN)
    assert communication(beacons, np.array(LINE)) == {(0, 1), (0, 2), (1, 2)}


def test_couplings_last_as_long_as_their_formula_can_matter() -> None:
    pair = apart(0, 1)
    assert required(Eventually(Always(pair, 1, 2), 2, 4)) == [(0, 2, set()), (3, 6, {(0, 1)}), (7, 10, set())]
    assert required(Always(pair, 8, None)) == [(0, 7, set()), (8, 10, {(0, 1)})]
    assert required(Until(pair, apart(1, 2), 4, 6)) == [
        (0, 3, {(0, 1)}),
        (4, 5, {(0, 1), (1, 2)}),
        (6, 6, {(1, 2)}),
        (7, 10, set()),
    ]


def test_distances_couple_the_agent_that_is_asked_and_the_one_it_is_measured_to() -> None:
    near = Atom(ir.Compare(((1.0, ir.DistanceTo(2)),), 0.0, False))
    assert required(All((At(0, near), At(3, Always(near, 5, 6)), At(2, near)))) == [
        (0, 0, {(0, 2)}),
        (1, 4, set()),
        (5, 6, {(2, 3)}),
        (7, 10, set()),
    ]


def test_a_spatial_operator_couples_the_graph_and_asks_its_agents() -> None:
    graph = ir.Proximity("radio", Metres(1.5), (0, 1, 2), SPAN)
    near = Atom(ir.Compare(((1.0, ir.DistanceTo(3)),), 0.0, False))
    asked = At(0, Neighbour(graph, Not(near)))
    assert required(asked, steps=1) == [(0, 0, {(0, 1), (1, 2), (0, 3), (1, 3), (2, 3)}), (1, 1, set())]


def test_a_route_may_end_where_it_begins_and_at_every_agent_of_its_graph() -> None:
    graph = ir.Proximity("radio", Metres(0.1), (1, 2), SPAN)
    near = Atom(ir.Compare(((1.0, ir.DistanceTo(3)),), 0.0, False))
    route = Reach(graph, All(()), near, 1)
    assert required(At(1, route), steps=1)[0] == (0, 0, {(1, 2), (1, 3), (2, 3)})
    assert required(At(0, route), steps=1)[0] == (0, 0, {(0, 3)}), "outside the graph there is no other route"


def test_the_connected_predicate_couples_its_agents_alone() -> None:
    graph = ir.Proximity("radio", Metres(1.5), (0, 1, 2, 3), SPAN)
    assert required(Atom(ir.Connected(graph, (0, 2, 3))), steps=1)[0] == (0, 0, {(0, 2), (2, 3)})


def test_a_shared_part_is_asked_wherever_it_is_used() -> None:
    shared = Is(frozenset({0}))
    both = All((At(1, Always(shared, 0, 1)), At(2, Always(shared, 3, 9))))
    where = dict(relevance([both], agents=3, last=4))[shared]
    assert where.astype(int).tolist() == [[0] * 5, [1, 1, 0, 0, 0], [0, 0, 0, 1, 1]]


def test_preferences_and_nothing_at_all_couple_nobody() -> None:
    found = coupled(text("prefer together: always[0, 20 s] connected(radio)"), dock=(1.0, 1.0))
    assert [phase.edges for phase in found.phases] == [frozenset()]
    empty = couplings(mission_of(LINE, 3), NOTHING, np.array(LINE))
    assert len(empty.components) == 4


def test_the_ablations_fix_the_order_or_free_it() -> None:
    assert in_order((2, 0, 1))(frozenset({2})) == (0,)
    assert in_order((2, 0, 1))(frozenset({0, 1, 2})) == ()
    assert in_any_order(3)(frozenset({1})) == (0, 2)
