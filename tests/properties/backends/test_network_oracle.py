"""Routes, distances and connectivity by networkx: what the monitor says of links, and the graphs given out, agree."""

from __future__ import annotations

import itertools
import math
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import missionc
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.compiler.front_end import ANY_BACKEND, check

nx = pytest.importorskip("networkx")

AGENTS, RADIUS, SIDE = 9, 3.1, 8.0
FIELD, BASE = (0.0, 5.5), (5.0, 8.0)
"""From where to where on the x axis each region is."""

HEAD = f"""mission oracle
time  step 1 s, horizon 1 s
world (0, 0) to ({SIDE:g}, {SIDE:g})
region field = box ({FIELD[0]:g}, 0) to ({FIELD[1]:g}, {SIDE:g})
region base  = box ({BASE[0]:g}, 0) to ({BASE[1]:g}, {SIDE:g})
team drone[{AGENTS}] {{ radius 0.01 m  dynamics single_integrator(speed <= 100 m/s)  start in field }}
graph radio = proximity {RADIUS:g} m
"""
ASKED = {
    "near": "field reach[hops 0..2 on radio] base",
    "short": "field reach[distance 0 m..4.5 m on radio] base",
    "away": "escape[hops 3.. on radio] field",
    "far": "escape[distance 5 m.. on radio] field",
}
SEEDS = (*range(12), 23)


FAR, LOUD, QUIET = 4.6, range(3), range(3, AGENTS)
"""Of the links from the loud agents to the quiet ones; all others have the radius."""
ONE_WAY = f"{{ drone[0..2] to drone[3..{AGENTS - 1}] {FAR:g} m }}"


def text(one_way: bool = False) -> str:
    lines = [f"require {name}_{i}: drone[{i}]: {asked}\n" for name, asked in ASKED.items() for i in range(AGENTS)]
    head = HEAD.rstrip() + f" {ONE_WAY}\n" if one_way else HEAD
    pair = "require pair: connected(radio, drone, 2)\n" if one_way else ""
    return head + "".join(lines) + "require whole: connected(radio, drone)\n" + pair


@cache
def checked_mission(one_way: bool, **options: bool) -> missionc.Checked:
    return check(missionc.Source("oracle.mission", text(one_way)), backend=ANY_BACKEND, **options)


def links(places: np.ndarray, one_way: bool = False) -> object:
    """The agents as numbers, an edge from each to those strictly closer than the range of their pair."""
    graph = nx.DiGraph() if one_way else nx.Graph()
    graph.add_nodes_from(range(AGENTS))
    for one, other in itertools.permutations(range(AGENTS), 2):
        length = math.dist(places[one], places[other])
        if length < (FAR if one_way and one in LOUD and other in QUIET else RADIUS):
            graph.add_edge(one, other, length=length)
    return graph


def whole(graph: object) -> bool:
    return bool(nx.is_strongly_connected(graph) if nx.is_directed(graph) else nx.is_connected(graph))


def reaches(graph: object, agent: int, through: set[int], ends: set[int], most: float, weight: str | None) -> bool:
    """Whether some route over ``through`` comes to one of ``ends`` in that length."""
    for end in ends:
        part = graph.subgraph(through | {agent, end})  # type: ignore[attr-defined]
        if agent != end and agent not in through:
            continue
        if nx.has_path(part, agent, end) and nx.shortest_path_length(part, agent, end, weight=weight) <= most:
            return True
    return False


def escapes(graph: object, agent: int, through: set[int], least: float, weight: str | None) -> bool:
    """Whether some route over ``through`` comes to somebody that far away in the whole graph."""
    if agent not in through:
        return False
    distance = nx.single_source_dijkstra_path_length(graph, agent, weight=weight or (lambda *_: 1))
    inside = graph.subgraph(through)  # type: ignore[attr-defined]
    part = {agent} | nx.descendants(inside, agent)
    return any(distance[other] >= least for other in part)


def random_places(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.2, SIDE - 0.2, (AGENTS, 2))


def regions(places: np.ndarray) -> tuple[set[int], set[int]]:
    """Who is in the field, and who in the base."""
    field = {i for i in range(AGENTS) if FIELD[0] <= places[i, 0] <= FIELD[1]}
    base = {i for i in range(AGENTS) if BASE[0] <= places[i, 0] <= BASE[1]}
    return field, base


def by_networkx(places: np.ndarray, one_way: bool = False) -> dict[str, bool]:
    """What each requirement of ``text`` is at these places."""
    graph = links(places, one_way)
    field, base = regions(places)
    expected = {"whole": whole(graph)}
    if one_way:
        expected["pair"] = all(whole(graph.subgraph(set(range(AGENTS)) - {i})) for i in range(AGENTS))  # type: ignore[attr-defined]
    for i in range(AGENTS):
        expected |= {
            f"near_{i}": reaches(graph, i, field, base, 2, None),
            f"short_{i}": reaches(graph, i, field, base, 4.5, "length"),
            f"away_{i}": escapes(graph, i, field, 3, None),
            f"far_{i}": escapes(graph, i, field, 5.0, "length"),
        }
    return expected


@pytest.mark.parametrize("one_way", [False, True])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_monitor_finds_the_routes_that_networkx_finds(
    seed: int, one_way: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    checked = checked_mission(one_way, judging=True)
    monkeypatch.setattr("missionc.compiler.judge_motion.check", lambda *_, **__: checked)
    places = random_places(seed)
    trace = tmp_path / "trace.csv"
    rows = [f"drone[{i}],{t},{x!r},{y!r}" for i, (x, y) in enumerate(places.tolist()) for t in (0, 1)]
    trace.write_text("agent,t,x,y\n" + "\n".join(rows) + "\n")
    monitored = missionc.monitor(missionc.Source("oracle.mission", text(one_way)), trace)
    assert monitored.ok, monitored.findings
    assert {each.name: each.satisfied for each in monitored.requirements} == by_networkx(places, one_way)


@pytest.mark.parametrize("one_way", [False, True])
def test_both_answers_come_of_each_kind_of_requirement(one_way: bool) -> None:
    """The comparison would say little of one that is always true, or never."""
    answers = {name.partition("_")[0]: set[bool]() for name in by_networkx(random_places(0), one_way)}
    for seed in SEEDS:
        for name, holds in by_networkx(random_places(seed), one_way).items():
            answers[name.partition("_")[0]].add(holds)
    assert answers == {name: {True, False} for name in answers}


def test_links_that_lead_one_way_change_what_is_asked() -> None:
    """A graph read as if each link led back would pass where it must not."""
    differs = set()
    for seed in SEEDS:
        there = by_networkx(random_places(seed), True)
        graph = links(random_places(seed), True).to_undirected()  # type: ignore[attr-defined]
        differs |= {"whole"} if whole(graph) != there["whole"] else set()
        differs |= (
            {"near"}
            if any(
                reaches(graph, i, *regions(random_places(seed)), 2, None) != there[f"near_{i}"] for i in range(AGENTS)
            )
            else set()
        )
    assert differs == {"whole", "near"}


def test_the_graph_given_out_has_the_links_of_the_step(subtests: pytest.Subtests) -> None:
    for one_way, seed in product([False, True], SEEDS):
        with subtests.test(one_way=one_way, seed=seed):
            position = np.random.default_rng(seed).uniform(0.2, SIDE - 0.2, (AGENTS, 2, 2))
            trace = Trace(Seconds(1.0), position, np.zeros_like(position), np.zeros((AGENTS, 2)))
            checked = checked_mission(one_way)
            ends = tuple if one_way else frozenset
            for step in (0, 1):
                given = missionc.link_graph(checked, trace, "radio", step)
                expected = nx.relabel_nodes(
                    links(position[:, step], one_way), {i: f"drone[{i}]" for i in range(AGENTS)}
                )
                assert set(given) == set(expected)
                assert nx.is_directed(given) is one_way
                assert {ends(edge) for edge in given.edges} == {ends(edge) for edge in expected.edges}
                for one, other, length in given.edges(data="length"):
                    assert length == pytest.approx(expected.edges[one, other]["length"])
                    reach = FAR if one_way and int(one[6:-1]) in LOUD and int(other[6:-1]) in QUIET else RADIUS
                    assert given.edges[one, other]["margin"] == pytest.approx(reach - length)
