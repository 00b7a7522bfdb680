"""Ranges of pairs: what is refused, which links lead one way, and what every stage makes of them."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

import missionc
from missionc import ir
from missionc.backends.api import Budget, Planned
from missionc.backends.clot.cost_graph.cost_graph import build
from missionc.backends.clot.schedule.gather_team import gather_team
from missionc.backends.load import load_engines
from missionc.backends.options import Options
from missionc.base.diagnostics import code
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.trace import Trace
from missionc.base.units import Metres
from missionc.ir.couplings import all_ranges, between, directed, kinds, range_of
from missionc.ir.kernel.nodes import Atom
from missionc.ir.language.margins.links import all_links
from missionc.ir.language.margins.predicate_margins import algebraic_connectivity
from missionc.ir.lower.tighten import tightened
from missionc.verification.monitoring.monitor import monitor
from missionc.verification.plan.algebraic_connectivity import connectivity
from tests.support.random_runs import SPAN, trace_of

HEAD = """mission pairs
time  step 1 s, horizon 4 s
world (0, 0) to (20, 10)
region base = box (0.5, 0.5) to (6, 9)
agent tower { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 5) }
agent relay { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (4, 5) }
team drone[3] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start in base }
group aloft = relay, drone
"""
NET = "graph radio = proximity 3 m { tower to drone 9 m, drone to tower 4 m }\n"


def checked(*lines: str) -> missionc.Checked:
    return missionc.check(missionc.Source("pairs.mission", HEAD + "\n".join(lines) + "\n"), backend="any")


def random_trace(size: int, steps: int) -> Trace:
    return trace_of(np.random.default_rng(0).uniform(0.5, 9, (size, steps + 1, 2)).tolist())


def graph(line: str) -> ir.Graph:
    found = checked(line)
    assert found.mission is not None, found.findings
    return found.mission.graphs[0]


def errors(*lines: str) -> list[tuple[str, str]]:
    return [(each.code.name, each.message) for each in checked(*lines).findings if not each.code.warning]


def test_a_pair_has_its_range_one_way_and_the_other() -> None:
    radio = graph(NET)
    assert [range_of(radio, *pair) for pair in ((0, 2), (0, 4), (2, 0), (0, 1), (2, 3))] == [9.0, 9.0, 4.0, 3.0, 3.0]
    assert kinds(radio) == ((0,), (1,), (2, 3, 4))
    assert directed(radio)
    assert all_ranges(radio) == (9.0, 4.0, 3.0)
    assert between(radio, 0, 2).rule == ir.Proximity("", Metres(9.0), (), SPAN).rule


def test_pairs_that_no_range_is_given_of_have_no_links() -> None:
    star = graph("graph star = proximity { tower to drone 9 m, drone to tower 9 m }")
    assert not directed(star)
    links = all_links(star, random_trace(5, 1).position * 0.01)[0]
    linked = {(int(one), int(other)) for one, other in np.argwhere(links > 0)}
    assert linked == {(0, each) for each in (2, 3, 4)} | {(each, 0) for each in (2, 3, 4)}


def test_ranges_are_of_members_and_groups_and_within_the_agents_of_the_graph() -> None:
    net = graph("graph net = sight 3 m over aloft { relay to drone[1..2] 5 m, drone to drone 2 m }")
    assert [range_of(net, *pair) for pair in ((1, 3), (1, 2), (3, 1), (2, 3))] == [5.0, 3.0, 3.0, 2.0]
    assert directed(net)


@pytest.mark.parametrize(
    ("written", "name", "message"),
    [
        ("proximity 3 m { aloft to tower 5 m, drone[1] to tower 4 m }", "MC240", "from `drone[1]` to `tower` is given"),
        ("proximity 3 m { drone to drone 5 m, drone[0] to drone[2] 5 m }", "MC240", "from `drone[0]` to `drone[2]`"),
        ("proximity 3 m { tower to tower 5 m }", "MC241", "a range from `tower` to itself"),
        ("proximity 3 m { tower to drone 0 m }", "MC210", "the range from `tower` to `drone` is 0 m; it must be more"),
        ("proximity { tower to drone -1 m }", "MC210", "the range from `tower` to `drone` is -1 m"),
        ("proximity 3 m { tower to drone 3 s }", "MC201", ""),
        ("proximity 3 m { tower to dron 3 m }", "MC101", ""),
        ("proximity 3 m { tower to base 3 m }", "MC104", ""),
        ("proximity 3 m { tower to drone[7] 3 m }", "MC105", ""),
        ("proximity 3 m over aloft { tower to drone 3 m }", "MC104", "`tower` of `tower` is not on the graph `g`"),
        ("beacons 3 m { tower to drone 3 m }", "MC001", "`beacons` has one range for all pairs"),
        ("proximity", "MC001", ""),
        ("proximity 3 m { }", "MC001", ""),
    ],
)
def test_ranges_that_cannot_be_meant_are_refused(written: str, name: str, message: str) -> None:
    found = errors(f"graph g = {written}")
    assert [each for each, _ in found] == [name]
    assert message in found[0][1]
    assert {code.RANGE_SAID_TWICE.name, code.RANGE_TO_ITSELF.name} == {"MC240", "MC241"}


def test_a_range_that_one_agent_alone_would_have_twice_is_no_pair() -> None:
    assert (
        errors("graph g = proximity 3 m { drone[0] to aloft 5 m, tower to drone[0] 4 m, drone[1] to tower 4 m }") == []
    )


def test_lambda_2_is_refused_of_links_that_lead_one_way_alone() -> None:
    asked = "require whole: eventually[0, 4 s] connected(radio)", "solve with clot { connectivity = lambda2 }"
    both = "graph radio = proximity 3 m { tower to drone 9 m, drone to tower 9 m }"
    assert [name for name, _ in errors(NET, *asked)] == [code.ONE_WAY_LAMBDA2.name] == ["MC536"]
    assert errors(both, *asked) == []
    assert errors(NET, asked[1], "require near: tower: eventually[0, 4 s] somewhere[hops 1..1] drone") == []


def test_starts_decide_a_link_by_the_range_of_its_own_direction() -> None:
    line = "graph radio = proximity 1 m { tower to relay 3.5 m }"
    told = "require told: tower: always[0, 4 s] somewhere[hops 1..1] relay"
    answers = "require answers: relay: always[0, 4 s] somewhere[hops 1..1] tower"
    assert errors(line, told) == []
    ((name, message),) = errors(line, answers)
    assert name == "MC510"
    assert "`answers` contradicts the start of" in message
    (finding,) = [each for each in checked(line, answers).findings if each.code.name == "MC510"]
    assert "the range of `radio` from `relay` to `tower` is 1 m" in " ".join(finding.notes)


def test_connected_is_one_leaf_of_the_cost_graph_whichever_way_links_lead() -> None:
    for line in (NET, "graph radio = proximity 3 m"):
        found = checked(
            line, "require whole: connected(radio)", "require torn: eventually[0, 4 s] not connected(radio)"
        )
        assert found.mission is not None
        assert found.kernel is not None
        goal = build(found.kernel).requirements[0].formula
        assert isinstance(goal, Atom)
        assert isinstance(goal.predicate, ir.Connected)


def test_a_team_is_gathered_until_it_is_connected_there_and_back() -> None:
    radio = graph(NET)
    position = np.array([(0, 0), (19, 9), (10, 0), (10, 9), (1, 9)], dtype=float)
    there = gather_team([ir.Connected(radio, radio.agents)], position)
    linked = all_links(radio, there[:, None])[0] > 0
    assert (np.linalg.matrix_power(linked.astype(float) + np.eye(5), 5) > 0).all()


def test_no_lambda_2_is_certified_of_links_that_lead_one_way() -> None:
    for line, figures in ((NET, 0), ("graph radio = proximity 3 m", 1)):
        found = checked(line, "require whole: eventually[0, 4 s] connected(radio)")
        assert found.mission is not None
        assert len(connectivity(found.mission, random_trace(5, 4))) == figures
    assert algebraic_connectivity(graph("graph radio = proximity 3 m"), random_trace(5, 4)).shape == (5,)


def test_every_range_is_tightened_by_what_two_agents_may_miss() -> None:
    found = checked(NET, "require whole: eventually[0, 4 s] connected(radio)")
    assert found.mission is not None
    assert found.kernel is not None
    (radio,) = tightened(found.mission, found.kernel, Metres(0.5))[0].graphs
    assert [radio.radius, *(each.radius for each in radio.ranges)] == [2.0, 8.0, 3.0]


@pytest.mark.parametrize("backend", ["smt", "clot", "hybrid"])
def test_each_backend_keeps_a_team_told_and_heard(backend: str) -> None:
    text = (
        HEAD
        + NET
        + (
            "region site = box (9, 3) to (12, 7)\n"
            "require go: some drone: eventually[0, 4 s] distance(site) <= 1 m\n"
            "require whole: always[0, 4 s] connected(radio)\n"
            "require torn: eventually[0, 4 s] not connected(radio, drone)\n"
        )
    )
    compiled = missionc.compile(missionc.Source("pairs.mission", text), backend=backend)
    assert isinstance(compiled.outcome, missionc.Verified), compiled.findings
    plan = json.loads(dict(compiled.files)["plan.json"])
    edges = [{tuple(edge) for edge in step} for step in plan["graphs"]["radio"]]
    assert any((other, one) not in step for step in edges for one, other in step)
    position = np.array([agent["position"] for agent in plan["agents"]])
    radio = graph(NET)
    for step, linked in enumerate(edges):
        lengths = np.linalg.norm(position[:, None, step] - position[None, :, step], axis=-1)
        pairs = {(one, other) for one in range(5) for other in range(5) if one != other}
        assert linked == {pair for pair in pairs if lengths[pair] < range_of(radio, *pair)}


TOGETHER = """mission together
time step 1 s, horizon 6 s
world (0, 0) to (8, 4)
team drone[2] { radius 0.1 m dynamics single_integrator(speed <= 1 m/s) start at (1, 1), (1, 2) }
agent scout { radius 0.1 m dynamics single_integrator(speed <= 1 m/s) start at (2, 2) }
graph radio = proximity 2 m { scout to drone 2.5 m }
require torn: eventually[0, 6 s] not connected(radio)
"""


def test_transport_parts_a_team_whose_links_lead_one_way() -> None:
    found = missionc.check(missionc.Source("together.mission", TOGETHER), backend="clot")
    mission, kernel, backend = found.mission, found.kernel, load_engines(("clot",), Options())
    assert mission is not None
    assert kernel is not None
    assert not isinstance(backend, Diagnostic)
    planned = backend.plan(mission, kernel, Options(), Budget(time.monotonic() + 3600))
    assert isinstance(planned, Planned)
    assert monitor(mission, kernel, planned.trace).requirements[0].satisfied
