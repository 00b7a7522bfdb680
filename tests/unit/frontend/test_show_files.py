"""Summaries of files: a line for each in `check` and `compile`, records in JSON, a line in an editor."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from missionc.cli.app import main
from missionc.frontend.resolve.resolve_files import file_lines
from missionc.tools.language_server.hover import hover
from tests.support.mapped_missions import YAML, meant, picture, written
from tests.support.open_texts import opened

FILES: dict[str, str | bytes] = {
    "hall.pgm": picture("....", ".##.", "....", "...."),
    "hall.yaml": YAML,
    "places.csv": "name,kind,x,y,radius\nrack,obstacle,12,12,1\nmast,beacon,1,2,\n",
    "starts.csv": "x,y\n1,8\n2,9\n",
    "site.json": json.dumps(
        {
            "type": "FeatureCollection",
            "features": [
                {"type": "Feature", "properties": {"radius": 1}, "geometry": {"type": "Point", "coordinates": [15, 5]}},
                {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [16, 5]}},
            ],
        }
    ),
}
SAID = """obstacles from "hall.yaml"
obstacles from "places.csv"
beacons from "places.csv"
obstacles from "site.json" unit 1 m
team pair[2] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start from "starts.csv" }
"""
LINES = [
    "hall.yaml: 1 obstacle, (4, 5) to (6, 7) m",
    "places.csv: 1 obstacle, (11, 11) to (13, 13) m",
    "places.csv: 1 beacon, (1, 2) to (1, 2) m",
    "site.json: 1 obstacle, (14, 4) to (16, 6) m; left out: 1 Point (a point needs a `radius`, in metres)",
    "starts.csv: 2 points, (1, 8) to (2, 9) m",
]


def test_each_file_has_a_line_and_a_mission_without_files_has_none(tmp_path: Path) -> None:
    assert file_lines(meant(tmp_path, SAID, FILES)) == LINES
    assert file_lines(meant(tmp_path, "", {})) == []


def test_check_prints_a_line_for_each_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(written(tmp_path, SAID, FILES))
    assert main(["check", path]) == 0
    assert capsys.readouterr().out.splitlines()[1:] == [f"  {line}" for line in LINES]
    assert main(["check", path, "--format", "json"]) == 0
    (file,) = json.loads(capsys.readouterr().out)["files"]
    assert [(each["file"], each["kind"], each["count"]) for each in file["places"]] == [
        ("hall.yaml", "obstacle", 1),
        ("places.csv", "obstacle", 1),
        ("places.csv", "beacon", 1),
        ("site.json", "obstacle", 1),
        ("starts.csv", "point", 2),
    ]
    assert file["places"][3]["left_out"][0]["kind"] == "Point"
    assert file["places"][0]["high"] == [6, 7]


def test_a_roadmap_has_its_nodes_and_lanes(tmp_path: Path) -> None:
    graph = """<graphml xmlns="http://graphml.graphdrawing.org/xmlns">
<key id="x" for="node" attr.name="x" attr.type="double"/><key id="y" for="node" attr.name="y" attr.type="double"/>
<graph edgedefault="undirected">
<node id="a"><data key="x">1</data><data key="y">1</data></node>
<node id="b"><data key="x">1</data><data key="y">5</data></node>
<edge source="a" target="b"/></graph></graphml>"""
    said = 'solve with smt { roadmap = "lanes.graphml" }'
    assert file_lines(meant(tmp_path, said, {"lanes.graphml": graph})) == [
        "lanes.graphml: 2 nodes, 2 lanes, (1, 1) to (1, 5) m"
    ]


def test_an_editor_shows_the_summary_where_the_mission_names_the_file(tmp_path: Path) -> None:
    path = written(tmp_path, SAID, FILES)
    text = opened(path.read_text(), name=str(path))
    found = hover(text, text.places.position(text.source.text.index("places.csv")))
    assert found is not None
    assert found.contents.value == f"- {LINES[1]}\n- {LINES[2]}"  # type: ignore[union-attr]
