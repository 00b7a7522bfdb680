"""The example programs run, and say what they promise."""

from __future__ import annotations

import json
import math
import os
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).resolve().parents[3]


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


def test_a_mission_is_built_and_planned_in_python() -> None:
    lines = output("delivery.py")
    assert lines[0] == "1: requirements `fetch` and `guard` contradict each other"
    assert "require fetch: some cart: eventually[0, 6] (shelf and eventually[0, 6] gate)" in lines
    assert lines[-1].endswith("m, verified True")


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


def test_what_a_crazyflie_logs_is_a_sample() -> None:
    line = runpy.run_path(str(ROOT / "examples/live/crazyflie_log.py"))["line"]
    logged = {f"stateEstimate.{name}": 0.25 for name in ("x", "y", "z", "vx", "vy", "vz")}
    assert json.loads(line("drone[0]", 1.5, logged)) == {
        "t": 1.5,
        "agent": "drone[0]",
        "position": [0.25, 0.25, 0.25],
        "velocity": [0.25, 0.25, 0.25],
    }


def test_a_pose_of_ros_is_a_sample() -> None:
    line = runpy.run_path(str(ROOT / "examples/live/ros2_poses.py"))["line"]
    place = SimpleNamespace(x=1.0, y=2.0, z=3.0)
    turned = SimpleNamespace(x=0.0, y=0.0, z=math.sin(0.25), w=math.cos(0.25))
    sample = json.loads(line("drone[0]", 1.5, SimpleNamespace(position=place, orientation=turned)))
    assert sample["position"] == [1.0, 2.0, 3.0]
    assert sample["heading"] == pytest.approx(0.5)


def test_every_example_is_run_here() -> None:
    tested = Path(__file__).read_text(encoding="utf-8")
    programs = [path for path in (ROOT / "examples").rglob("*.py") if not (path.parent / "__init__.py").exists()]
    assert all(path.name in tested for path in programs)
