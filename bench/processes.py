"""Benchmark of several processes: the same missions planned in one and in several, alternating.

    python bench/processes.py [--processes 2] [--best-of 3] [--only NAME …]

Every run must give the same motion, bit by bit. Seconds are from the checked mission to the plan, the minimum of all
runs: elapsed time, and processor time including children. A ratio is that of several processes to one. *Chain* is the
ratio of elapsed times that a machine without other load and with free child processes would have: processor seconds of
the sequential work in one process, divided by all of its processor seconds.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import missionc
from missionc.backends.api import Budget, Planned
from missionc.backends.clot.backend import TransportRun
from missionc.backends.clot.paper.expand_agent import Expansion
from missionc.backends.load import load
from missionc.backends.options import Options
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.source import Source
from missionc.compiler.front_end import Checked

MISSIONS = Path(__file__).resolve().parent.parent / "missions"

GAP = """\
mission gap
time step 0.4 s, horizon 10 s
world (0, 0) to (10, 6)
region base = box (0.5, 2) to (2.5, 4)
region goal = box (7, 2) to (9.5, 4)
obstacle low  = box (4.5, 0) to (5.5, 2.7)
obstacle high = box (4.5, 3.3) to (5.5, 6)
team drone[4] { radius 0.15 m  dynamics single_integrator(speed <= 3 m/s)  start in base }
graph radio = proximity 1.5 m
require visit: eventually[0, 10 s] every drone: goal
require link:  always[0, 10 s] connected(radio)
"""
"""Mission whose first schedule leads to no plan, and its second one does."""

VISIT = MISSIONS / "clot_visit.mission"

ROWS: dict[str, tuple[Path | Source, dict[str, str], Options]] = {
    "visit5, search": (VISIT, {"N": "5"}, Options(preset="search")),
    "visit12, search": (VISIT, {"N": "12"}, Options(preset="search")),
    "visit3, paper, 24 samples": (VISIT, {"N": "3"}, Options(preset="paper", samples=24)),
    "gap": (Source("gap.mission", GAP), {}, Options()),
    "visit5": (VISIT, {"N": "5"}, Options()),
    "split100": (MISSIONS / "clot_split100.mission", {}, Options()),
}
"""Name: mission, parameters, planning options."""


class Chain:
    """Processor seconds of parallel work, group by group."""

    def __init__(self) -> None:
        self.groups: list[list[float]] = []

    def beginning(self, function: Any) -> Any:
        def begun(*arguments: Any) -> Any:
            self.groups.append([])
            return function(*arguments)

        return begun

    def timed(self, function: Any) -> Any:
        def timed(*arguments: Any) -> Any:
            begin = time.process_time()
            found = function(*arguments)
            self.groups[-1].append(time.process_time() - begin)
            return found

        return timed

    def saved(self, processes: int) -> float:
        """Saved seconds if each piece goes to the first idle process."""
        left = 0.0
        for group in self.groups:
            busy = [0.0] * processes
            for seconds in group:
                busy[busy.index(min(busy))] += seconds
            left += max(busy)
        return sum(map(sum, self.groups)) - left


def chain(checked: Checked, options: Options, processes: int) -> float:
    """Sequential part of the work."""
    seen = Chain()
    if options.preset == "sketch":
        owner, group, piece = TransportRun, "plan", "attempt"
    else:
        owner, group, piece = Expansion, "__call__", "_one"
    before = getattr(owner, group), getattr(owner, piece)
    setattr(owner, group, seen.beginning(before[0]))
    setattr(owner, piece, seen.timed(before[1]))
    try:
        _, _, spent = planned(checked, options)
    finally:
        setattr(owner, group, before[0])
        setattr(owner, piece, before[1])
    return 1 - seen.saved(processes) / spent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--best-of", type=int, default=3)
    parser.add_argument("--only", nargs="*", choices=list(ROWS))
    arguments = parser.parse_args()
    many = arguments.processes
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print(f"| mission | attempts | wall s, 1 | wall s, {many} | ratio | CPU s, 1 | CPU s, {many} | ratio | chain |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    for name in arguments.only or ROWS:
        file, overrides, options = ROWS[name]
        checked = missionc.check(file, overrides=overrides, backend="clot")
        runs: dict[int, list[tuple[float, float]]] = {1: [], many: []}
        motions: set[bytes] = set()
        for _ in range(arguments.best_of):
            for processes, seconds in runs.items():
                found, wall, spent = planned(checked, replace(options, processes=processes))
                motions.add(found.trace.position.tobytes())
                seconds.append((wall, spent))
        assert len(motions) == 1, f"{name}: the plan depends on the number of processes"
        attempts = dict(found.report.sizes)["attempts"]
        (wall, wall_many), (spent, spent_many) = zip(
            *(map(min, zip(*seconds, strict=True)) for seconds in runs.values()), strict=True
        )
        print(
            f"| {name} | {attempts} | {wall:.2f} | {wall_many:.2f} | {wall_many / wall:.2f}"
            f" | {spent:.2f} | {spent_many:.2f} | {spent_many / spent:.2f} | {chain(checked, options, many):.2f} |",
            flush=True,
        )


def planned(checked: Checked, options: Options) -> tuple[Planned, float, float]:
    """Plan, wall-clock seconds, and processor seconds."""
    assert checked.mission is not None
    assert checked.kernel is not None
    backend = load("clot", options)
    assert not isinstance(backend, Diagnostic)
    begin, before = time.perf_counter(), _spent()
    found = backend.plan(checked.mission, checked.kernel, options, Budget(time.monotonic() + 600))
    wall, spent = time.perf_counter() - begin, _spent() - before
    assert isinstance(found, Planned), f"no plan: {found}"
    return found, wall, spent


def _spent() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


if __name__ == "__main__":
    main()
