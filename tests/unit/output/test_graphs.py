"""Roadmaps and links as graphs of networkx, as text, and on the map."""

from __future__ import annotations

import io
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import missionc
from missionc.backends.roadmap_graph import RoadmapEdge, RoadmapGraph, show_roadmaps
from missionc.cli.app import main
from missionc.output.plot.plot import plot
from tests.support.small_missions import SMALL, WRONG

nx = pytest.importorskip("networkx")

ROOT = Path(__file__).resolve().parents[3]
HALL = """mission hall
time  step 500 ms, horizon 12 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (3, 3)
region goal = box (7, 7) to (9, 9)
obstacle wall = box (4, 2) to (5, 9)
team cart[2] { radius 0.2 m  dynamics single_integrator(speed <= 2 m/s)  start in base }
agent van { radius 0.2 m  dynamics double_integrator(speed <= 2 m/s, acceleration <= 2 m/s^2)  start at (9, 1) }
graph radio = proximity 4 m
require visit: every cart: eventually[0, 12 s] goal
require park:  van: eventually[0, 12 s] goal
"""
TWO = RoadmapGraph(
    ("cart",),
    ("a", "b", "c"),
    np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 0.0]]),
    np.array([[0.0, 0.0], [0.0, 0.5], [0.0, 0.0]]),
    (("base", "wet"), (), ()),
    (("cart",), (), ()),
    (
        RoadmapEdge(0, 1, 3, 5.0, np.array([[0.0, 0.0], [3.0, 4.0]])),
        RoadmapEdge(1, 0, 3, 5.0, np.array([[3.0, 4.0], [0.0, 0.0]])),
        RoadmapEdge(1, 2, 1, 4.0, np.array([[3.0, 4.0], [3.0, 0.0]])),
    ),
)


def hall(text: str = HALL) -> missionc.Checked:
    return missionc.check(missionc.Source("hall.mission", text))


def test_each_kind_of_agent_has_a_graph_with_places_labels_steps_and_lengths() -> None:
    carts, van = missionc.roadmap_graphs(hall(), seed=1)
    assert nx.is_strongly_connected(carts)
    assert {place["vx"] for _, place in van.nodes(data=True)} > {0.0}
    assert (carts.graph["agents"], van.graph["agents"]) == ("cart[0] cart[1]", "van")
    for graph, fastest in ((carts, 2.0), (van, 2.0)):
        assert nx.is_weakly_connected(graph)
        for _, place in graph.nodes(data=True):
            inside = {
                name
                for name, low, high in (("base", 0.5, 3.0), ("goal", 7.0, 9.0))
                if low <= place["x"] <= high and low <= place["y"] <= high
            }
            assert set(place["labels"].split()) == inside
            assert not (4 < place["x"] < 5 and 2 < place["y"] < 9)
        for one, other, edge in graph.edges(data=True):
            ends = [np.array([graph.nodes[node]["x"], graph.nodes[node]["y"]]) for node in (one, other)]
            assert edge["length"] >= np.linalg.norm(ends[1] - ends[0]) - 1e-9
            assert edge["duration"] == edge["steps"] * 0.5
            assert edge["length"] <= fastest * edge["duration"] + 1e-9
    starts = [place["starts"] for _, place in carts.nodes(data=True) if place["starts"]]
    assert starts
    assert set(starts) == {"cart[0] cart[1]"}
    assert [(place["x"], place["y"]) for _, place in van.nodes(data=True) if place["starts"]] == [(9.0, 1.0)]


def test_the_same_seed_gives_the_same_graph_and_another_another() -> None:
    first, again, other = (missionc.roadmap_graphs(hall(), seed=seed)[1] for seed in (1, 1, 2))
    assert nx.utils.graphs_equal(first, again)
    assert not nx.utils.graphs_equal(first, other)


def test_a_graph_goes_through_graphml_and_json_unchanged() -> None:
    graph = missionc.roadmap_graphs(hall())[0]
    buffer = io.BytesIO()
    nx.write_graphml(graph, buffer)
    buffer.seek(0)
    read = nx.read_graphml(buffer)
    again = nx.node_link_graph(nx.node_link_data(graph, edges="edges"), edges="edges")
    for other in (read, again):
        assert other.adj == graph.adj
        assert other.nodes(data=True) == graph.nodes(data=True)
        assert other.graph["agents"] == "cart[0] cart[1]"


def test_of_a_plan_it_is_the_roadmap_that_the_plan_was_found_on() -> None:
    compiled = missionc.compile(missionc.Source("hall.mission", HALL), backend="smt")
    assert isinstance(compiled.outcome, missionc.Verified)
    carts, van = missionc.roadmap_graphs(compiled)
    nodes = [np.array([[place["x"], place["y"]] for _, place in graph.nodes(data=True)]) for graph in (carts, van)]
    start = compiled.outcome.plan.trace.position[:, 0]
    assert min(np.linalg.norm(nodes[0] - start[0], axis=1)) < 1e-9
    assert min(np.linalg.norm(nodes[1] - start[2], axis=1)) < 1e-9


def test_what_has_no_graph_says_so() -> None:
    checked, trace = hall(), None
    with pytest.raises(ValueError, match=r"`wrong.mission` has errors"):
        missionc.roadmap_graphs(missionc.check(missionc.Source("wrong.mission", WRONG)))
    tight = "mission a time step 1 s, horizon 9 s world (0, 0) to (2, 2) region mid = box (0, 0) to (2, 2)\n"
    tight += "agent cart { radius 0.1 m  dynamics unicycle(speed 4..5 m/s)  start in mid }\nrequire all: cart: mid\n"
    with pytest.raises(ValueError, match=r"MC605: no roadmap could be built: no path from `mid` for `cart`"):
        missionc.roadmap_graphs(missionc.check(missionc.Source("tight.mission", tight)))
    compiled = missionc.compile(missionc.Source("small.mission", SMALL))
    assert isinstance(compiled.outcome, missionc.Verified)
    trace = compiled.outcome.plan.trace
    with pytest.raises(ValueError, match="there is no graph `sonar`; the mission has radio"):
        missionc.link_graph(checked, trace, "sonar", 0)
    with pytest.raises(ValueError, match=r"there is no step 99; the trace has the steps 0 to 6"):
        missionc.link_graph(checked, trace, "radio", 99)


def test_without_networkx_it_says_what_to_install() -> None:
    program = (
        "import sys; sys.modules['networkx'] = None; import missionc\n"
        "checked = missionc.check('missions/wildfire.mission')\n"
        "try: missionc.roadmap_graphs(checked)\n"
        "except ModuleNotFoundError as error: print(error)\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT)
    assert run.stdout == (
        "MC404: a graph needs networkx, which is not installed; install it with `pip install 'missionc[graph]'`\n"
    )


def test_the_text_says_nodes_with_their_labels_and_ways_with_their_steps() -> None:
    assert show_roadmaps((TWO,)) == (
        "roadmap of cart\n"
        "3 nodes, 2 ways between them, 1 one-way\n"
        "  a  (0, 0)  base; wet; start of cart\n"
        "  b  (3, 4)  moving (0, 0.5) m/s\n"
        "  c  (3, 0)\n"
        "  a -- b  3 steps, 5 m\n"
        "  b -> c  1 step, 4 m\n"
    )


def test_the_command_prints_it_and_solves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "hall.mission"
    file.write_text(HALL)
    assert main(["compile", str(file), "--emit", "roadmap"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("roadmap of cart[0], cart[1]\n")
    assert "\nroadmap of van\n" in said
    assert "van" in next(line for line in said.splitlines() if "(9, 1)" in line)
    assert list(tmp_path.iterdir()) == [file]


def test_a_roadmap_on_the_map_is_drawn_the_same_each_time_with_arrows_where_it_is_one_way() -> None:
    compiled = missionc.compile(missionc.Source("small.mission", SMALL))
    assert isinstance(compiled.outcome, missionc.Verified)
    assert compiled.checked.mission is not None
    mission, trace = compiled.checked.mission, compiled.outcome.plan.trace
    bare = plot(mission, trace, "smt", "svg")
    first, again = (plot(mission, trace, "smt", "svg", roadmaps=(TWO,)) for _ in range(2))
    both_ways = plot(mission, trace, "smt", "svg", roadmaps=(replace(TWO, edges=TWO.edges[:2]),))
    assert isinstance(bare, bytes)
    assert isinstance(first, bytes)
    assert isinstance(both_ways, bytes)
    assert first == again
    assert b"roadmap: 3 nodes" in first
    assert b"roadmap" not in bare
    assert first.count(b"<path") - both_ways.count(b"<path") >= 2


def test_the_command_draws_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, picture = tmp_path / "small.mission", tmp_path / "small.svg"
    file.write_text(SMALL)
    folder = str(tmp_path / "out")
    assert main(["compile", str(file), "-o", folder, "--plot", str(picture), "--plot-kind", "roadmap"]) == 0
    assert b"roadmap: " in picture.read_bytes()
    assert main(["compile", str(file), "-o", folder, "--force", "--plot-kind", "roadmap"]) == 2
    assert "add `--plot FILE.svg`" in capsys.readouterr().err
