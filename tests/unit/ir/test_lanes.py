"""A roadmap of the user's own: read from GraphML, checked against the world, planned on, and kept by the plan."""

from __future__ import annotations

import json
import random
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import missionc
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.cli.app import main
from missionc.frontend.syntax.graphml import Graphml, read_graphml
from missionc.geometry.lane_room import straight_runs
from missionc.ir.lower.flyable_steps import step_limits
from missionc.verification.verify_plan import verify

nx = pytest.importorskip("networkx")

ROOT = Path(__file__).resolve().parents[3]
MISSION = """mission carts
time  step 1 s, horizon 40 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (2, 2)
region goal = box (8, 8) to (9.5, 9.5)
obstacle rack = box (3, 3) to (7, 7)
agent cart { radius 0.3 m  dynamics single_integrator(speed <= 2 m/s)  start in base }
require fetch: cart: eventually[0, 40 s] goal
require home:  cart: eventually[40 s, 40 s] base
solve with smt { roadmap = "lanes.graphml" }
"""
PLACES = {"dock": (1, 1), "west": (1, 9), "shelf": (9, 9), "east": (9, 1)}
LOOP = [("dock", "west"), ("west", "shelf"), ("shelf", "east"), ("east", "dock")]


def ring(*edges: tuple[str, str], places: dict[str, tuple[float, ...]] | None = None, **said: float) -> nx.DiGraph:
    """The places, and one-way lanes between them; what is said, of the first of them."""
    graph = nx.DiGraph()
    for name, place in (places or PLACES).items():
        graph.add_node(name, **dict(zip("xyz", map(float, place), strict=False)))
    graph.add_edges_from(edges or LOOP)
    first = next(iter(graph.edges))
    graph.edges[first].update(said)
    return graph


def written(folder: Path, graph: nx.Graph | str, mission: str = MISSION) -> Path:
    """The mission in a folder, its lanes beside it."""
    if isinstance(graph, str):
        (folder / "lanes.graphml").write_text(graph, encoding="utf-8")
    else:
        nx.write_graphml(graph, folder / "lanes.graphml")
    (folder / "carts.mission").write_text(mission, encoding="utf-8")
    return folder / "carts.mission"


def codes(folder: Path, graph: nx.Graph | str, mission: str = MISSION) -> list[str]:
    return [finding.code.name for finding in missionc.check(written(folder, graph, mission)).findings]


def nodes_met(trace: np.ndarray, graph: nx.DiGraph) -> list[str]:
    """The nodes that a path, (steps, dim), comes to, one after the other."""
    places = {name: np.array([node[axis] for axis in "xyz"[: trace.shape[1]]]) for name, node in graph.nodes(data=True)}
    met = [name for point in trace for name, place in places.items() if np.linalg.norm(point - place) < 1e-6]
    return [name for number, name in enumerate(met) if number == 0 or met[number - 1] != name]


# ------------------------------------------------------------------ planned


def test_a_plan_goes_along_the_lanes_and_never_against_one(tmp_path: Path) -> None:
    graph = ring()
    compiled = missionc.compile(written(tmp_path, graph))
    assert isinstance(compiled.outcome, missionc.Verified)
    assert [check.passed for check in compiled.outcome.certificate.checks if check.name == "lane"] == [True]
    met = nodes_met(compiled.outcome.plan.trace.position[0], graph)
    assert met == ["dock", "west", "shelf", "east", "dock"]
    assert all(graph.has_edge(*pair) for pair in pairwise(met))


@pytest.mark.usefixtures("coarse_covers")
def test_a_mission_that_would_have_to_go_against_a_lane_is_impossible(tmp_path: Path) -> None:
    compiled = missionc.compile(written(tmp_path, ring(*LOOP[:3])))
    assert isinstance(compiled.outcome, missionc.Impossible)
    assert "on the roadmap of `lanes.graphml`" in compiled.outcome.statement
    assert "add nodes and lanes to `lanes.graphml`" in compiled.findings[-1].help
    assert isinstance(missionc.compile(written(tmp_path, nx.Graph(ring(*LOOP[:3])))).outcome, missionc.Verified)


def test_a_plan_that_leaves_the_lanes_goes_back_on_one_or_is_too_fast_is_not_verified(tmp_path: Path) -> None:
    compiled = missionc.compile(written(tmp_path, ring(speed=1.0)))
    assert isinstance(compiled.outcome, missionc.Verified)
    mission, kernel, trace = compiled.checked.mission, compiled.checked.kernel, compiled.outcome.plan.trace
    assert mission is not None
    assert kernel is not None

    def lane(position: np.ndarray) -> float:
        checks = verify(mission, kernel, replace(trace, position=position)).checks
        return next(check.margin for check in checks if check.name == "lane")

    assert lane(trace.position) == 0.0
    assert lane(trace.position[:, ::-1]) == pytest.approx(-2.0)
    beside = trace.position.copy()
    beside[0, 2, 0] += 0.25
    assert lane(beside) == pytest.approx(-0.25)
    fast = trace.position.copy()
    fast[0, 3:] = trace.position[0, 4:5]
    fast[0, :3] = trace.position[0, 0]
    assert lane(fast) < -1.0


@pytest.mark.parametrize(
    ("said", "steps"), [({}, 4), ({"speed": 0.8}, 10), ({"duration": 6.5}, 7), ({"speed": 9.0}, 4)]
)
def test_a_lane_takes_as_long_as_it_says_and_the_agents_need(
    tmp_path: Path, said: dict[str, float], steps: int
) -> None:
    checked = missionc.check(written(tmp_path, ring(**said)))
    (graph,) = missionc.roadmap_graphs(checked)
    assert graph.edges["dock", "west"]["steps"] == steps
    assert graph.edges["west", "shelf"]["steps"] == 4
    compiled = missionc.compile(tmp_path / "carts.mission")
    assert isinstance(compiled.outcome, missionc.Verified)


def test_the_roadmap_is_exactly_the_file(tmp_path: Path) -> None:
    graph = ring(*LOOP, ("dock", "east"))
    (given,) = missionc.roadmap_graphs(missionc.check(written(tmp_path, graph)))
    assert dict(given.nodes(data="x")) == dict(graph.nodes(data="x"))
    assert set(given.edges) == set(graph.edges)


def test_a_roadmap_that_was_given_out_can_be_brought_back(tmp_path: Path) -> None:
    sampled = missionc.check(Source("carts.mission", MISSION.replace(' { roadmap = "lanes.graphml" }', "")))
    (graph,) = missionc.roadmap_graphs(sampled)
    compiled = missionc.compile(written(tmp_path, graph))
    assert isinstance(compiled.outcome, missionc.Verified)
    (again,) = missionc.roadmap_graphs(compiled)
    assert set(again.edges) == set(graph.edges)


@pytest.mark.parametrize(
    "dynamics",
    [
        "double_integrator(speed <= 2 m/s, acceleration <= 1 m/s^2)",
        "unicycle(speed 1..2 m/s)",
        "unicycle(speed 0..2 m/s, turn <= 100 deg/s)",
    ],
)
def test_every_dynamics_keeps_to_lanes_and_to_their_speeds(tmp_path: Path, dynamics: str) -> None:
    mission = MISSION.replace("single_integrator(speed <= 2 m/s)", dynamics).replace("40 s", "60 s")
    mission = mission.replace("eventually[60 s, 60 s] base", "eventually[0, 60 s] (goal and eventually[0, 0 s] goal)")
    graph = ring(speed=1.5)
    compiled = missionc.compile(written(tmp_path, graph, mission))
    assert isinstance(compiled.outcome, missionc.Verified), compiled.findings
    steps = np.linalg.norm(np.diff(compiled.outcome.plan.trace.position[0, :, 1]))
    assert steps > 0
    assert nodes_met(compiled.outcome.plan.trace.position[0], graph)[:3] == ["dock", "west", "shelf"]


def test_a_volume_has_lanes_with_three_coordinates(tmp_path: Path) -> None:
    mission = """mission carts
time  step 1 s, horizon 30 s
world (0, 0, 0) to (10, 10, 5)
region goal = ball at (9, 9, 4) radius 0.5 m
agent cart { radius 0.3 m  dynamics single_integrator(speed <= 2 m/s)  start at (1, 2, 1) }
require fetch: cart: eventually[0, 30 s] goal
solve with smt { roadmap = "lanes.graphml" }
"""
    graph = ring(("low", "high"), ("high", "end"), places={"low": (1, 1, 1), "high": (1, 1, 4), "end": (9, 9, 4)})
    compiled = missionc.compile(written(tmp_path, graph, mission))
    assert isinstance(compiled.outcome, missionc.Verified)
    assert nodes_met(compiled.outcome.plan.trace.position[0], graph) == ["low", "high", "end"]
    graph.nodes["high"].pop("z")
    assert codes(tmp_path, graph, mission) == ["MC032"]


def test_a_start_beside_the_lanes_is_joined_to_the_nearest_node_that_it_sees(tmp_path: Path) -> None:
    mission = MISSION.replace("start in base", "start at (2.5, 5)").replace("require home", "#")
    graph = ring(*LOOP, ("near", "east"), places={**PLACES, "near": (8, 5)})
    compiled = missionc.compile(written(tmp_path, graph, mission))
    assert isinstance(compiled.outcome, missionc.Verified)
    (given,) = missionc.roadmap_graphs(compiled)
    assert set(given.edges) - set(graph.edges) == {("(2.5, 5)", "dock"), ("dock", "(2.5, 5)")}
    shut = mission + "obstacle wall = box (1.8, 4) to (3, 4.5)\nobstacle roof = box (1.8, 5.5) to (3, 6)\n"
    shut += "obstacle side = box (1.7, 4) to (2.1, 6)\n"
    assert "MC543" in codes(tmp_path, graph, shut)


def test_a_folder_holds_the_roadmap_and_is_verified_with_it(tmp_path: Path) -> None:
    file = written(tmp_path, ring())
    assert main(["compile", str(file), "-o", str(tmp_path / "out")]) == 0
    kept = tmp_path / "out" / "mission" / "lanes.graphml"
    assert kept.read_bytes() == (tmp_path / "lanes.graphml").read_bytes()
    assert main(["verify", str(tmp_path / "out")]) == 0
    checks = json.loads((tmp_path / "out" / "certificate.json").read_text(encoding="utf-8"))["checks"]
    assert "lane" in {check["name"] for check in checks}
    kept.write_text(kept.read_text().replace("9.0", "8.9"))
    assert main(["verify", str(tmp_path / "out")]) != 0


def test_only_the_roadmap_backend_plans_on_lanes(tmp_path: Path) -> None:
    assert codes(tmp_path, ring(), MISSION.replace("with smt", "with clot")) == ["MC401"]
    checked = missionc.check(written(tmp_path, ring(), MISSION.replace("with smt", "with auto")))
    assert checked.choice is not None
    assert checked.choice.engines == ("smt",)


# ------------------------------------------------------------------ read


def test_a_check_with_lanes_loads_no_networkx(tmp_path: Path) -> None:
    file = written(tmp_path, ring())
    program = f"import sys, missionc; assert missionc.check({str(file)!r}).ok; print('networkx' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert run.stdout == "False\n"


def test_an_edge_without_direction_leads_both_ways_and_may_say_so_itself(tmp_path: Path) -> None:
    checked = missionc.check(written(tmp_path, nx.Graph(ring(*LOOP[:3]))))
    assert checked.mission is not None
    assert checked.mission.solve.roadmap is not None
    assert len(checked.mission.solve.roadmap.lanes) == 6
    text = (tmp_path / "lanes.graphml").read_text().replace("<edge ", '<edge directed="true" ', 1)
    checked = missionc.check(written(tmp_path, text))
    assert checked.mission is not None
    assert checked.mission.solve.roadmap is not None
    assert len(checked.mission.solve.roadmap.lanes) == 5


def graphml(inner: str, before: str = "", keys: str = "") -> str:
    """A file around some elements of its graph."""
    x, y = (f'<key id="{axis}" for="node" attr.name="{axis}" attr.type="double"/>' for axis in "xy")
    head = f'<graphml xmlns="http://graphml.graphdrawing.org/xmlns">{x}{y}{keys}'
    return f'{before}{head}<graph edgedefault="directed">{inner}</graph></graphml>'


def node(name: str, x: object = 1, y: object = 1) -> str:
    return f'<node id="{name}"><data key="x">{x}</data><data key="y">{y}</data></node>'


LAUGHS = '<!DOCTYPE l [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>'
SPEED = '<key id="v" for="edge" attr.name="speed" attr.type="double"/>'
PAIR = node("a") + node("b", 1, 9)


@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("", "MC031", "invalid XML: no element found"),
        ("mission demo", "MC031", "invalid XML: syntax error"),
        ("<graphml></graphml>", "MC031", "no graph found"),
        ("<svg/>", "MC031", "unexpected element `svg`"),
        (graphml(""), "MC031", "no nodes"),
        (graphml(PAIR)[:-20], "MC031", "invalid XML"),
        (graphml(PAIR.replace("1", "&a;"), LAUGHS), "MC031", "a document type is not allowed"),
        (graphml(PAIR, '<!DOCTYPE graphml SYSTEM "file:///etc/passwd">'), "MC031", "a document type is not allowed"),
        (graphml(PAIR.replace(">1<", ">&unknown;<", 1)), "MC031", "undefined entity"),
        (graphml(PAIR + "<desc>" * 80 + "</desc>" * 80), "MC031", "nested more than 64 deep"),
        (graphml(PAIR + '<hyperedge id="h"/>'), "MC031", "unexpected element `hyperedge`"),
        (graphml(PAIR).replace("</graphml>", "<graph/></graphml>"), "MC031", "more than one graph"),
        (graphml(PAIR + node("a")), "MC031", "duplicate node `a`"),
        (graphml(PAIR + node("")), "MC031", "`node` needs a printable text `id`"),
        (graphml(PAIR + node("a&#x202e;b", 2, 2)), "MC031", "`node` needs a printable text `id`"),
        (graphml(PAIR + node("n" * 200, 2, 2)), "MC031", "the name of a node is longer than 128 characters"),
        (graphml(PAIR + '<edge source="a" target="c"/>'), "MC031", "unknown node `c`"),
        (graphml(PAIR + '<edge source="a" target="a"/>'), "MC031", "the edge of `a` leads to itself"),
        (graphml(PAIR + '<edge source="a" target="b"/>' * 2), "MC031", "duplicate edge from `a` to `b`"),
        (graphml(PAIR + '<edge source="a"/>'), "MC031", "`edge` needs a printable text `target`"),
        (graphml(PAIR + '<node id="c"><data key="q">1</data></node>'), "MC031", "unknown key `q`"),
        (graphml(PAIR + '<node id="c"><data key="x">1</data></node>'), "MC032", "node `c` has no `y`"),
        (graphml(node("a", "here")), "MC032", "`x` is `here`; expected a number"),
        (graphml(node("a", "nan")), "MC032", "`x` is `nan`; expected a number"),
        (graphml(node("a", "1e999")), "MC032", "`x` is `1e999`; expected a number"),
        (graphml(node("a", "2e9")), "MC032", "`x` is `2e9`; expected a number"),
        (graphml(PAIR + '<edge source="a" target="b"><data key="v">0</data></edge>', keys=SPEED), "MC032", "above 0"),
        (graphml(PAIR, keys=SPEED.replace("speed", "colour")), "MC032", "unknown attribute `colour` of an edge"),
        (graphml(PAIR, keys=SPEED.replace("edge", "node")), "MC032", "unknown attribute `speed` of a node"),
        (graphml(PAIR + node("c", 30, 1)), "MC541", "outside the world"),
        (graphml(PAIR + node("c", 5, 5)), "MC541", "too close to `rack`"),
        (graphml(PAIR + node("c", 9, 1) + '<edge source="b" target="c"/>'), "MC542", "from `b` to `c`"),
        (graphml(node("b", 1, 9)), "MC543", "the roadmap has no node there"),
    ],
)
def test_a_file_that_is_no_roadmap_of_this_world_is_refused_at_its_place(
    tmp_path: Path, text: str, code: str, says: str
) -> None:
    findings = missionc.check(written(tmp_path, text)).findings
    assert [finding.code.name for finding in findings] == [code]
    assert says in findings[0].message
    assert findings[0].help
    where = findings[0].primary
    assert where is not None
    assert where.span.source.name == str(tmp_path / ("carts.mission" if code == "MC543" else "lanes.graphml"))


def test_what_other_programs_draw_by_is_passed_over() -> None:
    shape = '<data key="d6"><y:ShapeNode xmlns:y="y"><y:Fill color="#FFCC00"/></y:ShapeNode></data>'
    text = graphml(
        PAIR.replace("</node>", f"{shape}</node>"), keys='<key id="d6" for="node" yfiles.type="nodegraphics"/>'
    )
    read = read_graphml(Source("lanes.graphml", text.replace("yfiles.type", "type")))
    assert isinstance(read, Graphml)
    assert [(each.name, {name: value for name, (value, _) in each.data.items()}) for each in read.nodes] == [
        ("a", {"x": "1", "y": "1"}),
        ("b", {"x": "1", "y": "9"}),
    ]


def test_a_default_stands_where_an_element_says_nothing() -> None:
    keys = SPEED.replace("/>", "><default>0.5</default></key>")
    edges = '<edge source="a" target="b"/><edge source="b" target="a"><data key="v">2</data></edge>'
    read = read_graphml(Source("lanes.graphml", graphml(PAIR + edges, keys=keys)))
    assert isinstance(read, Graphml)
    assert [edge.data["speed"][0] for edge in read.edges] == ["0.5", "2"]


def test_places_in_a_text_with_other_letters_are_right() -> None:
    text = graphml("<desc>größer — ウ</desc>" + node("a") + '<edge source="a" target="b"><data key="q"/></edge>')
    read = read_graphml(Source("lanes.graphml", text))
    assert isinstance(read, Diagnostic)
    assert read.primary is not None
    assert read.primary.span.text == '<data key="q"/>'


def test_mutated_files_are_read_or_refused_and_nothing_else(tmp_path: Path) -> None:
    chance = random.Random(7)
    whole = (ROOT / "missions" / "gallery" / "factory_lanes.graphml").read_text(encoding="utf-8")
    parts = ["<", ">", "/", '"', "&", "]]>", "<!--", "<![CDATA[", "<node", "</graph>", "\x01", "é", "9e9", " ", "\n"]
    refused = 0
    for _ in range(400):
        text = whole
        for _ in range(chance.randint(1, 3)):
            at, until = sorted(chance.choices(range(len(text)), k=2))
            text = text[:at] + chance.choice(parts) + text[min(until, at + chance.randint(0, 8)) :]
        read = read_graphml(Source("lanes.graphml", text))
        refused += isinstance(read, Diagnostic)
        if isinstance(read, Diagnostic):
            assert read.primary is not None
            assert 0 <= read.primary.span.start <= read.primary.span.end <= len(text)
    assert 100 < refused < 400


# ------------------------------------------------------------------ written


@pytest.mark.parametrize(
    ("option", "code"),
    [
        ('roadmap = "../lanes.graphml"', "MC010"),
        ('roadmap = "/etc/passwd"', "MC010"),
        ('roadmap = "none.graphml"', "MC002"),
        ("roadmap = 5", "MC206"),
        ('nodes = "lanes.graphml"', "MC206"),
        ('roadmap = "lanes.graphml", roadmap = "lanes.graphml"', "MC013"),
        ('roadmap = "lanes.graphml", nodes = 50', "MC206"),
    ],
)
def test_an_option_that_is_not_written_so_is_refused(tmp_path: Path, option: str, code: str) -> None:
    assert codes(tmp_path, ring(), MISSION.replace('roadmap = "lanes.graphml"', option)) == [code]


def test_a_file_in_a_folder_below_and_through_a_link_is_found(tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    nx.write_graphml(ring(), tmp_path / "site" / "plan.graphml")
    (tmp_path / "here.graphml").symlink_to("site/plan.graphml")
    for path in ("site/plan.graphml", "here.graphml"):
        assert codes(tmp_path, ring(), MISSION.replace("lanes.graphml", path)) == []
    (tmp_path / "away.graphml").symlink_to("/etc/passwd")
    assert codes(tmp_path, ring(), MISSION.replace("lanes.graphml", "away.graphml")) == ["MC010"]


def test_a_roadmap_counts_to_the_size_of_the_mission(tmp_path: Path) -> None:
    file = written(tmp_path, ring())
    small = missionc.Limits(file_bytes=1200)
    assert [finding.code.name for finding in missionc.check(file, limits=small).findings] == ["MC004"]


def test_the_option_is_printed_and_laid_out_as_it_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path, ring(), MISSION.replace('{ roadmap = "lanes', '{roadmap="lanes'))
    assert main(["fmt", str(file)]) == 0
    assert file.read_text().splitlines()[-1] == MISSION.splitlines()[-1]
    capsys.readouterr()
    assert main(["compile", str(file), "--emit", "ast,ir"]) == 0
    said = capsys.readouterr().out
    assert 'solve with smt { roadmap = "lanes.graphml" }' in said
    assert "solve with smt roadmap = lanes.graphml, 4 nodes, 4 lanes" in said


# ------------------------------------------------------------------- flown

FLOWN = """mission flown
time  step 1 s, horizon 40 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (2, 2)
region goal = box (8, 8) to (9.5, 9.5)
agent cart { vehicle crazyflie21  dynamics single_integrator(speed <= 1 m/s)  start in base }
require fetch: cart: eventually[0, 25 s] goal
require home:  cart: eventually[40 s, 40 s] base
solve with smt { roadmap = "lanes.graphml" }
"""
HALFWAY = {**PLACES, "gate": (1, 3.5), "lift": (1, 6.3)}
PASSED = [("dock", "gate"), ("gate", "lift"), ("lift", "west"), *LOOP[1:]]


def test_a_vehicle_sets_out_and_halts_on_lanes_as_it_can_fly_and_passes_nodes_that_lie_straight_on(
    tmp_path: Path,
) -> None:
    graph = ring(*PASSED, places=HALFWAY)
    compiled = missionc.compile(written(tmp_path, graph, FLOWN))
    assert isinstance(compiled.outcome, missionc.Verified)
    mission, trace = compiled.checked.mission, compiled.outcome.plan.trace
    assert mission is not None
    speeds = np.linalg.norm(np.diff(trace.position[0], axis=0), axis=1)
    moving = np.flatnonzero(speeds > 0)
    limits = step_limits(mission.agents[0], 1.0)
    assert limits is not None
    assert max(speeds[moving[[0, -1]]]) < limits.rest
    assert "dock" in nodes_met(trace.position[0], graph)
    assert not {"gate", "lift"} <= set(nodes_met(trace.position[0], graph)), "who passes a node need not be there"
    assert [check.passed for check in compiled.outcome.certificate.checks if check.name == "lane"] == [True]


def test_runs_are_of_lanes_that_lead_straight_on_at_one_speed(tmp_path: Path) -> None:
    def runs(graph: nx.DiGraph) -> list[tuple[str, ...]]:
        mission = missionc.check(written(tmp_path, graph)).mission
        assert mission is not None
        lanes = mission.solve.roadmap
        assert lanes is not None
        names = [node.name for node in lanes.nodes]
        ends = [[lanes.lanes[lane] for lane in run] for run in straight_runs(lanes)]
        return sorted((names[run[0].source], *(names[lane.target] for lane in run)) for run in ends)

    graph = ring(*PASSED, places=HALFWAY)
    assert runs(graph) == [
        ("dock", "gate", "lift"),
        ("dock", "gate", "lift", "west"),
        ("gate", "lift", "west"),
    ]
    assert runs(ring(*PASSED, places=HALFWAY, speed=0.5)) == [("gate", "lift", "west")]
    assert runs(ring(*PASSED, places=HALFWAY, duration=4.0)) == [("gate", "lift", "west")]
    assert runs(ring(*PASSED, places={**HALFWAY, "gate": (1.01, 3.5)})) == []
    assert runs(ring()) == []
