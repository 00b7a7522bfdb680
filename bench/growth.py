"""Benchmark of growth: teams of 10 to 1000 robots with individual tasks in a proportional world.

Measures time and memory.

    python bench/growth.py [--agents N ...] [--limit SECONDS] [--nodes N] [--print]

The world has a square of 10 m with a rack for each robot. Each robot fetches from its own shelf, up to three squares
away, and delivers to a dock that four squares share; no requirement involves two robots. Prints processor seconds and
bytes of `missionc compile`, including children, until the folder is written; the elapsed seconds for the files of the
flight; both for each robot; and, from each size to the next, the exponent of the processor seconds in the number of
robots.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import random
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

SIZES = (10, 30, 100, 300, 1000)

SQUARE = 10
"""Side of a square, metres."""

BLOCK = 3
"""Shelves are assigned randomly among the robots in blocks of this many squares in each direction."""


def mission(agents: int, nodes: int = 0, seed: int = 0) -> str:
    """Mission with ``agents`` robots, and ``nodes`` nodes for each if given."""
    side = math.ceil(math.sqrt(agents))
    squares = [(number % side, number // side) for number in range(agents)]
    blocks: dict[tuple[int, int], list[int]] = {}
    for number, (across, up) in enumerate(squares):
        blocks.setdefault((across // BLOCK, up // BLOCK), []).append(number)
    shelf_of: dict[int, int] = {}
    generator = random.Random(seed)
    for members in blocks.values():
        shelf_of |= dict(zip(members, generator.sample(members, len(members)), strict=True))
    rows = math.ceil(agents / side)
    lines = [
        f"mission growth{agents}",
        "time  step 1 s, horizon 90 s",
        f"world (0, 0) to ({SQUARE * side + 2}, {SQUARE * rows + 2})",
    ]
    for number, (across, up) in enumerate(squares):
        x, y = SQUARE * across, SQUARE * up
        lines.append(f"obstacle rack{number} = box ({x + 3}, {y + 6}) to ({x + 9}, {y + 7.5})")
        lines.append(f"region shelf{number} = box ({x + 4}, {y + 4.4}) to ({x + 8}, {y + 5.6})")
        if across % 2 == up % 2 == 0:
            lines.append(f"region dock{across // 2}_{up // 2} = box ({x + 9.2}, {y + 8}) to ({x + 12}, {y + 11.5})")
    starts = ", ".join(f"({SQUARE * across + 1.5}, {SQUARE * up + 2})" for across, up in squares)
    lines.append(f"team bot[{agents}] {{ radius 0.3 m  dynamics unicycle(speed 0..2 m/s)  start at {starts} }}")
    lines.append("separation 0.2 m")
    for number, (across, up) in enumerate(squares):
        job = f"shelf{shelf_of[number]} and eventually[0, 40 s] dock{across // 2}_{up // 2}"
        lines.append(f"require job{number}: bot[{number}]: eventually[0, 50 s] ({job})")
    if nodes:
        lines.append(f"solve with smt {{ nodes = {nodes * agents} }}")
    return "\n".join(lines) + "\n"


FILE_BYTES = 10_000_000
"""Size limit of a mission, which names a shelf for each robot."""


@dataclass(frozen=True, slots=True)
class Run:
    """Mission compiled by the command.

    Args:
        outcome: outcome of the command, or ``failed``.
        seconds: processor seconds, children included.
        writing: wall-clock seconds for the files of the flight.
        peak: peak memory, bytes.
    """

    outcome: str
    seconds: float
    writing: float
    peak: int


def measured(text: str, limit: float) -> Run:
    """Compile a mission with the command, within ``limit`` wall-clock seconds."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as said:
        file = Path(folder) / "case.mission"
        file.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "missionc", "compile", str(file), "--output", str(Path(folder) / "plan")]
        limits = ["--time-limit", str(limit), "--limit", f"file_bytes={FILE_BYTES}"]
        process = subprocess.Popen([*command, *limits, "--format", "json"], stdout=said, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        answer = json.loads(said.read() or "{}")
        outcome, writing = answer.get("outcome", "failed"), answer.get("timings", {}).get("emit", 0.0)
    return Run(outcome, used.ru_utime + used.ru_stime, writing, used.ru_maxrss * 1024)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, nargs="+", default=list(SIZES), help="team sizes")
    parser.add_argument(
        "--limit", type=float, default=600.0, help="time limit of each mission, in seconds of wall time"
    )
    parser.add_argument("--nodes", type=int, default=0, help="roadmap nodes for each robot, instead of the default")
    parser.add_argument("--print", action="store_true", help="print the first mission and stop")
    arguments = parser.parse_args()
    if arguments.print:
        print(mission(arguments.agents[0], arguments.nodes), end="")
        return
    print(
        f"{'robots':>6} {'outcome':>9} {'CPU s':>8} {'files s':>8} {'s each':>8} {'MB':>7} {'MB each':>8} exponent",
        flush=True,
    )
    before: tuple[int, float] | None = None
    for agents in arguments.agents:
        run = measured(mission(agents, arguments.nodes), arguments.limit)
        row = f"{agents:>6} {run.outcome:>9} {run.seconds:>8.1f} {run.writing:>8.1f} {run.seconds / agents:>8.3f}"
        row += f" {run.peak / 2**20:>7.0f} {run.peak / 2**20 / agents:>8.2f}"
        if before is not None:
            row += f" {math.log(run.seconds / before[1]) / math.log(agents / before[0]):>8.2f}"
        print(row, flush=True)
        before = agents, run.seconds


if __name__ == "__main__":
    main()
