"""Benchmark of flights of compiled folders on every installed simulator.

    python bench/simulators.py FOLDER...

Simulates each folder once, undisturbed, with `missionc simulate`, in a separate process for each engine. Prints for
each the maximum and the mean tracking error of the worst agent (mm), the minimum clearance between bodies (m), the
robustness of each requirement in the plan and in the flight, and the seconds of the process.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path

ENGINES = ("quadrotor", "rotorpy", "crazyflow")
ROOT = Path(__file__).resolve().parent.parent


def flown(folder: str, engine: str) -> tuple[dict[str, object], float]:
    begin = time.perf_counter()
    command = [sys.executable, "-m", "missionc", "simulate", folder, "--engine", engine, "--format", "json"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    ran = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if ran.returncode not in (0, 3):
        raise SystemExit(f"{folder} by {engine}: {ran.stderr or ran.stdout}")
    return json.loads(ran.stdout), time.perf_counter() - begin


def row(folder: str, engine: str) -> str:
    found, seconds = flown(folder, engine)
    tracking = found["tracking"]
    most = 1000 * max(each["most"] for each in tracking)
    mean = 1000 * max(each["mean"] for each in tracking)
    room = min((each["margin"] for each in found["room"]), default=float("nan"))
    pairs = zip(found["planned"], found["requirements"], strict=True)
    verdicts = ", ".join(
        f"{before['name']} {before['robustness']:.3f} → {after['robustness']:.3f}" for before, after in pairs
    )
    passed = "yes" if found["passed"] else "no"
    name = Path(folder).name
    return f"| {name} | {engine} | {mean:.0f} | {most:.0f} | {room:.3f} | {verdicts} | {passed} | {seconds:.0f} |"


def main() -> None:
    print(
        "| folder | engine | mean error (mm) | largest error (mm) | distance (m) "
        "| robustness planned → flown | passed | time (s) |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for folder in sys.argv[1:]:
        for engine in ENGINES:
            if engine == ENGINES[0] or find_spec(engine):
                print(row(folder, engine), flush=True)


if __name__ == "__main__":
    main()
