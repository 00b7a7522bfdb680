"""Weights of links: what is refused, and routes by what their links weigh, with networkx as the oracle."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import missionc
from missionc import ir
from missionc.backends.choose_backend import needs_of
from missionc.backends.features import Feature
from missionc.base.trace import Trace
from missionc.ir.couplings import heaviest, kinds_of_weight, lightest, weigh
from missionc.ir.language.margins.links import all_links
from missionc.verification.monitoring.monitor import truths
from tests.support.random_runs import trace_of

AGENTS, FIELD = 7, 5.0
HEAD = """mission weights
time  step 1 s, horizon 2 s
world (0, 0) to (10, 10)
region field = box (5, 0) to (10, 10)
agent tower { radius 0.01 m  dynamics single_integrator(speed <= 9 m/s)  start at (1, 5) }
team drone[6] { radius 0.01 m  dynamics single_integrator(speed <= 9 m/s)  start in field }
group few = drone[0..2]
"""
NET = (
    "graph net = proximity 3 m { tower to drone 5 m } weight delay 2 { drone to tower 5, few to few 1 } weight cost 3\n"
)
SEEDS = range(20)


def checked(*lines: str) -> missionc.Checked:
    return missionc.check(missionc.Source("weights.mission", HEAD + "\n".join(lines) + "\n"), backend="any")


def errors(*lines: str) -> list[tuple[str, str]]:
    return [(each.code.name, each.message) for each in checked(*lines).findings if not each.code.warning]


def mission(*lines: str) -> ir.Mission:
    found = checked(*lines)
    assert found.mission is not None, found.findings
    return found.mission


def random_trace(seed: int) -> Trace:
    return trace_of(np.random.default_rng(seed).uniform(1, 9, (AGENTS, 3, 2)).tolist())


def test_a_link_weighs_what_its_pair_does() -> None:
    (net,) = mission(NET).graphs
    delay, cost = net.weights
    assert [weigh(delay, *pair) for pair in ((1, 0), (0, 1), (1, 2), (1, 5), (5, 6))] == [5, 2, 1, 2, 2]
    assert kinds_of_weight(net, delay) == ((0,), (1, 2, 3), (4, 5, 6))
    assert (lightest(delay), heaviest(delay)) == (1, 5)
    assert (lightest(cost), heaviest(cost), kinds_of_weight(net, cost)) == (3, 3, (tuple(range(AGENTS)),))


@pytest.mark.parametrize(
    ("graph", "name", "message"),
    [
        ("proximity 3 m weight cost 0", "MC210", "`cost` is 0; it must be at least 1"),
        ("proximity 3 m weight cost 101", "MC210", "`cost` is 101; it must be at most 100"),
        ("proximity 3 m weight cost 1.5", "MC209", ""),
        ("proximity 3 m weight cost 2 s", "MC201", ""),
        ("proximity 3 m weight cost 2 { tower to drone 0 }", "MC210", "`cost` from `tower` to `drone` is 0"),
        ("proximity 3 m weight cost 2 weight cost 3", "MC013", "the weight `cost`"),
        ("proximity 3 m weight hops 2", "MC007", "cannot be named `hops`"),
        ("proximity 3 m weight cost 2 { few to tower 1, drone to tower 2 }", "MC240", "the weight from `drone[0]`"),
        ("proximity 3 m weight cost 2 { tower to tower 1 }", "MC241", "a weight from `tower` to itself"),
        ("proximity 3 m over drone weight cost 2 { tower to drone 1 }", "MC104", "is not on the graph `net`"),
    ],
)
def test_weights_that_cannot_be_meant_are_refused(graph: str, name: str, message: str) -> None:
    found = errors(f"graph net = {graph}")
    assert [each for each, _ in found] == [name]
    assert message in found[0][1]


def test_a_length_in_a_weight_that_the_graph_has_not_is_refused_with_the_one_that_is_meant() -> None:
    found = checked(NET, "require r: tower: somewhere[dely 0..4 on net] field")
    (finding,) = [each for each in found.findings if each.code.name == "MC101"]
    assert finding.message == "graph `net` has no weight `dely`; its weights are `delay`, `cost`"
    assert finding.fix is not None
    assert finding.fix.replacement == "delay"
    ((name, message),) = errors("graph net = proximity 3 m", "require r: tower: somewhere[cost 0..4] field")
    assert (name, message) == ("MC101", "graph `net` has no weight `cost`; it has no weights")


@pytest.mark.parametrize(
    ("bounds", "name"),
    [("delay 4..2", "MC303"), ("delay 0..2 m", "MC201"), ("delay 0..2.5", "MC209"), ("cost 19..30", "MC307")],
)
def test_bounds_of_a_weight_are_whole_numbers_in_order_that_a_route_can_come_to(bounds: str, name: str) -> None:
    found = errors(NET, f"require r: tower: somewhere[{bounds} on net] field")
    assert [each for each, _ in found] == [name]


def test_sums_of_weights_are_limited_before_they_are_told_apart() -> None:
    graph = "graph net = proximity 3 m weight cost 100 { tower to drone 99, few to tower 97 }"
    asked = "require r: tower: count[cost 1..600 on net] field >= 2"
    found = missionc.check(missionc.Source("weights.mission", f"{HEAD}{graph}\n{asked}\n"), backend="any")
    assert found.ok
    found = missionc.check(
        missionc.Source("weights.mission", f"{HEAD}{graph}\n{asked}\n"),
        backend="any",
        limits=missionc.Limits(formula_nodes=10_000),
    )
    (finding,) = [each for each in found.findings if not each.code.warning]
    assert finding.code.name == "MC207"
    assert finding.primary is not None
    assert finding.primary.message == "the expansion distinguishes every sum of `cost`"


def test_a_weight_is_planned_where_hops_are() -> None:
    found = mission(NET, "require r: tower: eventually[0, 2 s] somewhere[cost 0..4 on net] field")
    assert Feature.HOPS in {need.feature for need in needs_of(found.requirements[0].formula)}


ASKED = {
    "near": "somewhere[delay 0..4 on net] field",
    "other": "somewhere[delay 1..4 on net] field",
    "long": "somewhere[delay 6..8 on net] field",
    "away": "escape[delay 5.. on net] not field",
    "two": "count[delay 1..3 on net] field >= 2",
    "all_": "everywhere[delay 1..3 on net] field",
    "cheap": "drone reach[cost 0..6 on net] tower",
}


def by_networkx(found: ir.Mission, trace: Trace, step: int, agent: int) -> dict[str, bool]:
    """Likewise, by paths and distances of networkx."""
    nx = pytest.importorskip("networkx")
    (net,) = found.graphs
    delay, cost = net.weights
    graph = nx.DiGraph()
    graph.add_nodes_from(range(AGENTS))
    linked = all_links(net, trace.position)[step] > 0
    for one, other in itertools.permutations(range(AGENTS), 2):
        if linked[one, other]:
            graph.add_edge(one, other, delay=weigh(delay, one, other), cost=weigh(cost, one, other))
    field = {each for each in range(AGENTS) if trace.position[each, step, 0] >= FIELD}
    away = nx.single_source_dijkstra_path_length(graph, agent, weight="delay")
    routes = [
        (route[-1], nx.path_weight(graph, route, "delay"))
        for other in set(range(AGENTS)) - {agent}
        for route in nx.all_simple_paths(graph, agent, other)
    ]
    outside = graph.subgraph(set(range(AGENTS)) - field)
    drones = graph.subgraph(set(range(1, AGENTS)) | {0})
    return {
        "near": any(away[each] <= 4 for each in field & set(away)),
        "other": any(1 <= length <= 4 for end, length in routes if end in field),
        "long": any(6 <= length <= 8 for end, length in routes if end in field),
        "away": agent not in field and any(away[each] >= 5 for each in nx.descendants(outside, agent)),
        "two": sum(1 <= away[each] <= 3 for each in field & set(away)) >= 2,
        "all_": all(end in field for end, length in routes if 1 <= length <= 3),
        "cheap": agent == 0
        or (nx.has_path(drones, agent, 0) and nx.shortest_path_length(drones, agent, 0, weight="cost") <= 6),
    }


def test_routes_weigh_what_networkx_says() -> None:
    lines = [f"require {name}: every {{0}}: eventually[0, 2 s] ({asked})" for name, asked in ASKED.items()]
    found = checked(NET, *(line.format("drone") for line in lines))
    assert found.mission is not None, found.findings
    assert found.kernel is not None
    answers: dict[str, set[bool]] = {name: set() for name in ASKED}
    for seed in SEEDS:
        trace = random_trace(seed)
        bodies = {
            requirement.name: found.kernel.meanings[requirement.formula.body.operands[0]]  # type: ignore[union-attr]
            for requirement in found.mission.requirements
        }
        values = truths(bodies.values(), found.mission, trace)
        held = {name: np.broadcast_to(values[node], (AGENTS, 3)) for name, node in bodies.items()}
        for agent, step in itertools.product(range(AGENTS), range(3)):
            for name, expected in by_networkx(found.mission, trace, step, agent).items():
                assert bool(held[name][agent, step]) is expected, (name, seed, agent, step)
                answers[name].add(expected)
    assert answers == {name: {True, False} for name in ASKED}


@pytest.mark.parametrize("backend", ["smt", "hybrid"])
def test_each_backend_that_plans_hops_keeps_a_bound_in_a_weight(backend: str) -> None:
    if backend != "smt":
        pytest.importorskip("torch")
    lines = (
        "graph net = proximity 3 m weight delay 2 { drone to tower 5, tower to drone 5 }",
        "require go: drone[0]: eventually[0, 8 s] x >= 5.2 m",
        "require near: drone[0]: always[0, 8 s] somewhere[delay <= 7 on net] tower",
    )
    head = HEAD.replace("horizon 2 s", "horizon 8 s").replace(
        "start in field", "start at (1.5, 4), (1.5, 5), (1.5, 6), (2.5, 4), (2.5, 5), (2.5, 6)"
    )
    text = head + "\n".join(lines) + "\n"
    compiled = missionc.compile(missionc.Source("weights.mission", text), backend=backend)
    assert isinstance(compiled.outcome, missionc.Verified), compiled.findings
    assert all(each.satisfied for each in compiled.outcome.plan.judgements)
