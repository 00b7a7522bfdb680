"""Benchmark of `missionc check` as a complete process, on missions with 30 to 700 lines.

    python bench/check_time.py [RUNS]

Prints the minimum and the median time of the runs in seconds, from the start of the process to its end, including
interpreter and imports. ``nothing`` is an interpreter that only imports the command. Bytecode is cached, as it is by
default.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def mission(lines: int) -> str:
    """Mission with about ``lines`` lines that checks without errors."""
    count = max(1, (lines - 16) // 3)
    text = (ROOT / "missions" / "wildfire.mission").read_text(encoding="utf-8").splitlines()
    for number in range(count):
        x, y = 0.5 + 9 * (number * 7 % 50) / 50, 9.2 + 0.5 * (number % 10) / 10
        text.append(f"region spot{number} = disc at ({x:g}, {y:g}) radius 0.2")
        text.append(f"let near{number} = distance(spot{number}) <= {1 + number % 5} m or survivor")
        text.append(f"require rule{number}: some drone: eventually[0, {5 + number % 15} s] (near{number} or base)")
    return "\n".join(text) + "\n"


def seconds(command: list[str], runs: int) -> list[float]:
    took = []
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    for _ in range(runs):
        begin = time.perf_counter()
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True, env=environment)
        took.append(time.perf_counter() - begin)
    return took


def main(runs: int) -> None:
    print(f"{'mission':<12} {'least':>7} {'median':>7}   seconds, {runs} runs")
    rows = {"nothing": [sys.executable, "-c", "import missionc.cli.commands.check"]}
    with tempfile.TemporaryDirectory() as folder:
        for lines in (30, 200, 700):
            path = Path(folder) / f"of_{lines}_lines.mission"
            path.write_text(mission(lines), encoding="utf-8")
            rows[f"{lines} lines"] = [sys.executable, "-m", "missionc", "check", str(path)]
        for name, command in rows.items():
            took = seconds(command, runs)
            print(f"{name:<12} {min(took):7.3f} {statistics.median(took):7.3f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
