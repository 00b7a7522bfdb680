"""Teams of 10 to 1000 robots with tasks of their own, in a world that grows with them: how time and memory grow.

    python bench/growth.py [--agents N ...] [--limit SECONDS] [--against PYTHONPATH]

A square of 10 m with a rack for each robot. Each fetches from a shelf of its own
that is up to three squares away and brings it to a dock that four squares share;
no requirement is about two robots. Prints seconds of the processor and bytes,
children included, of a whole ``missionc compile``, for each robot; and the exponent of seconds in the
number of robots between each size and the one before.
"""

from __future__ import annotations

import argparse
import math
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path

SIZES = (10, 30, 100, 300, 1000)

SQUARE = 10
"""Metres."""

BLOCK = 3
"""Shelves are dealt out among the robots of so many by so many squares."""


def mission(agents: int, seed: int = 0) -> str:
    """The mission with so many robots."""
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
    return "\n".join(lines) + "\n"


def measured(text: str, limit: float) -> tuple[int, float, int]:
    """A mission compiled in a process of its own: exit status, seconds of the processor, bytes at the peak."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "case.mission"
        file.write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "missionc", "compile", str(file), "-o", str(Path(folder) / "plan")]
        command += ["--quiet", "--explain-limit", "0", "--time-limit", str(limit)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, nargs="+", default=list(SIZES), help="teams of so many")
    parser.add_argument("--limit", type=float, default=600.0, help="seconds on the wall for each")
    parser.add_argument(
        "--print", action="store_true", help="print the mission with the first of these numbers, and stop"
    )
    arguments = parser.parse_args()
    if arguments.print:
        print(mission(arguments.agents[0]), end="")
        return
    print(f"{'robots':>6} {'exit':>4} {'CPU s':>8} {'s each':>8} {'MB':>7} {'MB each':>8} {'exponent':>8}", flush=True)
    before: tuple[int, float] | None = None
    for agents in arguments.agents:
        status, seconds, peak = measured(mission(agents), arguments.limit)
        row = f"{agents:>6} {status:>4} {seconds:>8.1f} {seconds / agents:>8.3f} {peak / 2**20:>7.0f}"
        row += f" {peak / 2**20 / agents:>8.2f}"
        if before is not None:
            row += f" {math.log(seconds / before[1]) / math.log(agents / before[0]):>8.2f}"
        print(row, flush=True)
        before = agents, seconds


if __name__ == "__main__":
    main()
