"""The example programs run, and say what they promise."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def output(program: str, *words: str) -> list[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    run = subprocess.run(
        [sys.executable, f"examples/{program}", *words], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    return run.stdout.splitlines()


def test_a_folder_is_checked() -> None:
    lines = output("check_a_folder.py", "missions")
    assert len(lines) == len(list((ROOT / "missions").glob("*.mission")))
    assert all(" ok " in line for line in lines)


def test_the_smallest_team_is_found() -> None:
    lines = output("how_small_a_team.py")
    assert lines[0] == "2 drones: impossible, because of heard"
    assert ": planned, robustness " in lines[-1]


def test_a_flight_is_judged() -> None:
    calm, breeze, storm = output("judge_a_flight.py", "missions/strel_goal.mission")
    assert calm.startswith("wind 0.0 m: satisfied")
    assert breeze.startswith("wind 0.02 m: ")
    assert storm.startswith("wind 0.5 m: violated")


def test_a_roadmap_is_looked_at_as_a_graph(tmp_path: Path) -> None:
    pytest.importorskip("networkx")
    file = tmp_path / "lanes.graphml"
    lines = output("roadmap_as_graph.py", "missions/gallery/factory_lanes.mission", str(file))
    assert lines[0] == "tug[0] tug[1] tug[2]: 20 nodes, 28 edges"
    assert lines[1].endswith("p0, p1, p2, t1, t2, t3")
    assert "  to bays: 48 s at most, from the farthest node" in lines
    assert file.read_bytes().startswith(b"<?xml")


def test_every_example_is_run_here() -> None:
    tested = Path(__file__).read_text(encoding="utf-8")
    assert all(path.name in tested for path in (ROOT / "examples").glob("*.py"))
