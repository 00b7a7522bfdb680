"""The example programs run, and say what they promise."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

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


def test_every_example_is_run_here() -> None:
    tested = Path(__file__).read_text(encoding="utf-8")
    assert all(path.name in tested for path in (ROOT / "examples").glob("*.py"))
