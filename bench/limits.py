"""Benchmark of missions as large as their limits allow: exit code, time and memory.

    python bench/limits.py [--only NAME ...] [--limit SECONDS] [--memory MEGABYTES] [--clot-memory MEGABYTES] [--check]

Each case is one process with the given ``--time-limit`` and ``--memory-limit``. Prints the elapsed time and the maximum
memory of the process and its children together (proportional set size, sampled 20 times a second), each with its limit,
the exit status, and the reported codes. Linux only.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

HEAD = """mission {name}
time   step {step} s, horizon {horizon} s
world  (0, 0) to ({size}, {size})
region base = box (0.5, 0.5) to ({half}, {half})
region goal = box ({half}, {half}) to ({size}, {size})
"""
TEAM = "team drone[{count}] {{ radius 0.05 m  dynamics unicycle(speed 0..2 m/s)  start in base }}\n"
FORMERS = "team drone[{count}] {{ radius 0.05 m  dynamics single_integrator(speed <= 2 m/s)  start in base }}\n"
VISIT = "require visit: every drone: eventually[0, {horizon} s] goal\n"


@dataclass(frozen=True, slots=True)
class Case:
    """Mission with its compilation flags; ``transport`` if it needs torch."""

    name: str
    text: Callable[[], str]
    flags: tuple[str, ...] = ()
    transport: bool = False


def head(name: str, horizon: float = 20, size: float = 10, step: float = 1) -> str:
    return HEAD.format(name=name, horizon=horizon, size=size, half=size / 2, step=step)


def long_horizon(steps: int, backend: str = "smt") -> str:
    return "".join(
        (
            head("long", horizon=steps),
            FORMERS.format(count=2),
            VISIT.format(horizon=steps),
            f"require back: every drone: always[0, {steps - 20} s] eventually[0, 20 s] base\n",
            f"solve with {backend}\n",
        )
    )


def many_agents(count: int) -> str:
    size = max(10, round(count**0.5))
    return (
        head("crowd", size=size)
        + TEAM.format(count=count)
        + "graph radio = proximity 2 m\n"
        + VISIT.format(horizon=20)
        + "require relay: every drone: always[0, 20 s] (drone reach[hops 0..4 on radio] base)\n"
    )


def many_nodes(nodes: int) -> str:
    return head("nodes") + TEAM.format(count=3) + VISIT.format(horizon=20) + f"solve with smt {{ nodes = {nodes} }}\n"


def moving_obstacles(count: int) -> str:
    moving = (
        f"obstacle cart{each} = disc at ({1 + each % 20 * 0.9:g}, {1 + each // 20 * 0.9:g}) radius 0.05 m"
        f" moving ({0.02 * (each % 3 - 1):g}, {0.02 * (each % 5 - 2):g}) m/s\n"
        for each in range(count)
    )
    return head("carts", size=20, horizon=60) + "".join(moving) + TEAM.format(count=5) + VISIT.format(horizon=60)


def nested_windows(steps: int, depth: int) -> str:
    formula = "goal"
    for each in range(depth):
        formula = f"{('always', 'eventually')[each % 2]}[0, {steps} s] ({formula} or base)"
    return (
        head("nested", horizon=steps * depth)
        + FORMERS.format(count=3)
        + f"require nested: every drone: {formula}\n"
        + f"require until: every drone: (base or goal) until[0, {steps} s] (base until[0, {steps} s] goal)\n"
    )


def formation() -> str:
    return (
        head("stars", horizon=20)
        + FORMERS.format(count=5)
        + "formation row = chain of drone spacing 0.8 m tolerance 0.1 m\n"
        + VISIT.format(horizon=20)
        + "require row: eventually[0, 20 s] row\nsolve with clot\n"
    )


def many_regions(count: int) -> str:
    regions = (
        f"region r{each} = disc at ({each % 44 * 0.2 + 0.5:.1f}, {each // 44 * 0.2 + 0.5:.1f}) radius 0.1\n"
        for each in range(count)
    )
    visits = " and ".join(f"eventually[0, 20 s] r{each}" for each in range(0, count, 40))
    return head("places") + "".join(regions) + TEAM.format(count=5) + f"require tour: some drone: {visits}\n"


def undefined_names(count: int) -> str:
    return head("names") + TEAM.format(count=1) + "require a: " + " or ".join(f"nam{each}" for each in range(count))


def wildfire(count: int, steps: int) -> str:
    size = max(10, round(1.2 * count**0.5))
    return (
        head("wildfire", horizon=steps, size=size)
        + "region fire = disc at (4.5, 3.5) radius 0.7\nobstacle ridge = box (2.6, 6.4) to (3.8, 9)\n"
        + TEAM.format(count=count)
        + "graph radio = proximity 1.6 m\nseparation 0.1 m\n"
        + f"require relay: every drone: always[0, {steps} s] (goal implies not fire reach[hops 0..2 on radio] base)\n"
        + f"require rescue: some drone: eventually[0, {steps} s] goal\n"
        + f"require home: every drone: eventually[12 s, {steps} s] base\n"
    )


def starts_and_corners(agents: int, obstacles: int, corners: int) -> str:
    from math import cos, pi, sin

    size = 200.0
    shapes = []
    for each in range(obstacles):
        x, y = 110 + each % 5 * 15, 110 + each // 5 * 15
        points = (
            f"({x + 5 * cos(2 * pi * k / corners):.2f},{y + 5 * sin(2 * pi * k / corners):.2f})" for k in range(corners)
        )
        shapes.append(f"obstacle o{each} = polygon {', '.join(points)}\n")
    return head("corners", size=size) + "".join(shapes) + TEAM.format(count=agents) + VISIT.format(horizon=20)


CASES = (
    Case("horizon 1e5", lambda: long_horizon(100_000)),
    Case("horizon 2e4, clot", lambda: long_horizon(20_000, "clot"), transport=True),
    Case("horizon 1e5, clot", lambda: long_horizon(100_000, "clot"), transport=True),
    Case("horizon 2e4, hybrid", lambda: long_horizon(20_000, "hybrid"), transport=True),
    Case("2,000 agents", lambda: many_agents(2_000)),
    Case("10,000 agents", lambda: many_agents(10_000)),
    Case("nodes = 1e6", lambda: many_nodes(1_000_000)),
    Case("nodes = 1e5", lambda: many_nodes(100_000)),
    Case("200 moving obstacles", lambda: moving_obstacles(200)),
    Case("nested windows, 3 x 3,000", lambda: nested_windows(3_000, 3)),
    Case("nested windows, 20 x 2,000", lambda: nested_windows(2_000, 20)),
    Case("256 processes", formation, ("--processes", "256"), transport=True),
    Case("256 processes, search", formation, ("--processes", "256", "--preset", "search"), transport=True),
    Case("100,000 samples", formation, ("--preset", "paper", "--samples", "100000"), transport=True),
    Case("1,900 regions", lambda: many_regions(1_900)),
    Case("4,000 undefined names", lambda: undefined_names(4_000)),
    Case("100 agents of wildfire", lambda: wildfire(100, 60)),
    Case("starts x corners", lambda: starts_and_corners(10_000, 25, 90)),
)


def members(root: int) -> set[int]:
    """Process with all of its descendants."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except (OSError, IndexError):
                continue
    found = {root}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found


def held(processes: Iterable[int]) -> int:
    """Bytes of the processes; shared pages are divided among them."""
    total = 0
    for process in processes:
        try:
            text = Path(f"/proc/{process}/smaps_rollup").read_text()
        except OSError:
            continue
        total += sum(int(line.split()[1]) << 10 for line in text.splitlines() if line.startswith("Pss:"))
    return total


def run(case: Case, limit: float, memory: int, folder: Path) -> tuple[float, int, int, list[str]]:
    """Wall-clock seconds, maximum bytes, exit status, and codes."""
    path = folder / "mission.mission"
    path.write_text(case.text())
    command = [sys.executable, "-m", "missionc", "compile", str(path), "-o", str(folder / "out"), "--force", "--quiet"]
    command += ["--format", "json", "--limit", "file_bytes=10000000", "--limit", "shape_parts=100000"]
    command += ["--time-limit", str(limit), "--memory-limit", str(memory), *case.flags]
    begin, most = time.monotonic(), 0
    with (folder / "said").open("w+") as said:
        process = subprocess.Popen(command, stdout=said, stderr=subprocess.STDOUT, env={**os.environ})
        while process.poll() is None:
            most = max(most, held(members(process.pid)))
            time.sleep(0.05)
            if time.monotonic() - begin > 20 * limit or most > 4 * memory << 20:
                process.kill()  # far enough beyond to be visible, and near enough to spare the machine
        took = time.monotonic() - begin
        said.seek(0)
        text = said.read()
    try:
        document = json.loads(text)
        codes = [f"{each['code']} {each['message'][:90]}" for each in document["diagnostics"][:2]]
    except (ValueError, KeyError):
        codes = [text[-200:]]
    return took, most, process.returncode, codes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", default=[], help="only cases whose names contain one of these words")
    parser.add_argument("--limit", type=float, default=20.0, help="time limit of each case in seconds")
    parser.add_argument("--memory", type=int, default=1024, help="memory limit in megabytes")
    parser.add_argument(
        "--clot-memory", type=int, default=2048, help="memory limit in megabytes for cases that load torch"
    )
    arguments = parser.parse_args()
    print(f"{'case':28} {'seconds':>8} {'allowed':>8} {'MB':>7} {'allowed':>8} {'exit':>5}  said")
    for case in CASES:
        if arguments.only and not any(word in case.name for word in arguments.only):
            continue
        memory = arguments.clot_memory if case.transport else arguments.memory
        with tempfile.TemporaryDirectory() as folder:
            took, most, status, codes = run(case, arguments.limit, memory, Path(folder))
        allowed = 1.05 * arguments.limit + 1
        told = "; ".join(codes)
        late = "!" if took > allowed else " "
        fat = "!" if most > memory << 20 else " "
        print(
            f"{case.name:28} {took:8.1f}{late}{allowed:8.1f} {most >> 20:7}{fat}{memory:8} {status:5}  {told}",
            flush=True,
        )


if __name__ == "__main__":
    main()
