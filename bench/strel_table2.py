"""[strel] Table 2 and its two studies, here: every cell planned, checked for collisions, and verified.

    python bench/strel_table2.py [--agents N ...] [--best-of RUNS] [--solver auto|z3|cadical|race]
                                 [--paper] [--limit SECONDS]

With ``--agents`` only the table's cells with so many agents are run, without
the two studies. Columns: seconds to lower, to solve (collision rounds included), to verify, and
all from the start of ``lower`` to a verified plan; to emit, which is what a
user waits for besides: polynomials, their proof, and files; clauses; the
solver's peak memory; the paper's own encoding and solving seconds, on its machine. With
``--paper`` the paper's encoding, rendered by us in ``paper_encoding.py``, runs
in the same process on the same roadmap, without collisions, as it was given, by
the processor's clock; ``ratio`` is its encoding and solving over our whole by
the clock on the wall. A cell that passes the limit is stopped, and its ratio is
a lower bound.
"""

from __future__ import annotations

import argparse
import resource
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import missionc
from missionc.backends.api import Report
from missionc.backends.options import Options
from missionc.backends.smt.roadmap.roadmap import NoRoadmap, build_roadmaps
from missionc.backends.smt.roadmap.sequence import NEIGHBOURS
from missionc.ir import Mission
from missionc.pipeline.results import Compiled, Verified

ROOT = Path(__file__).resolve().parent.parent

PAPER = {
    ("strel_deliver", 3): (5.231, 0.626),
    ("strel_threat", 3): (4.527, 0.802),
    ("strel_escape", 3): (4.150, 0.310),
    ("strel_goal", 3): (3.891, 0.246),
    ("strel_deliver", 5): (19.100, 2.364),
    ("strel_threat", 5): (15.260, 4.701),
    ("strel_escape", 5): (22.928, 2.156),
    ("strel_goal", 5): (21.012, 0.278),
    ("strel_deliver", 8): (53.619, 6.586),
    ("strel_threat", 8): (50.505, 11.074),
    ("strel_escape", 8): (138.889, 4.369),
    ("strel_goal", 8): (110.524, 0.836),
    ("strel_deliver", 10): (80.393, 9.003),
    ("strel_threat", 10): (85.082, 16.251),
    ("strel_escape", 10): (275.774, 7.986),
    ("strel_goal", 10): (237.111, 1.267),
}
"""[strel] Table 2: encoding and solving seconds."""

HORIZONS = {20: (80, 9), 40: (99, 9), 60: (106, 9), 80: (122, 9), 100: (139, 12)}
"""[strel], scaling with the horizon, φ1 with ten agents."""

AVOIDING = {20: (99, 10), 40: (86, 41), 60: (103, 70), 80: (137, 116), 100: (130, 234)}
"""[strel], scaling with complexity, three threats, ten agents."""


@dataclass(frozen=True)
class Cell:
    name: str
    agents: int
    window: int
    published: tuple[float, float]


def cells(teams: list[int]) -> list[Cell]:
    table = [Cell(name, agents, 10, published) for (name, agents), published in PAPER.items()]
    if teams:
        return [cell for cell in table if cell.agents in teams]
    table += [Cell("strel_deliver", 10, window, published) for window, published in HORIZONS.items()]
    for name in ("strel_avoid", "strel_avoid_all"):
        table += [Cell(name, 10, window, published) for window, published in AVOIDING.items()]
    return table


def paper_seconds(cell: Cell, mission: Mission, limit: float) -> tuple[str, float, bool]:
    """What our rendering of the paper's encoding took: in words, in seconds, and whether it was stopped."""
    from paper_encoding import measure

    roadmaps = build_roadmaps(mission, 110, NEIGHBOURS, np.random.default_rng([0, 0]))
    if isinstance(roadmaps, NoRoadmap):
        raise SystemExit(roadmaps.statement)
    measured = measure(cell.name, mission, roadmaps[0], cell.window, limit)
    total = measured.encoding + (measured.solving or 0.0)
    stopped = measured.solving is None
    words = f"{measured.encoding:.1f}+{measured.solving:.1f}" if measured.solving is not None else measured.answer
    return words, total, stopped


def spent(compiled: Compiled, report: Report) -> tuple[float, float, float, float]:
    """Seconds to lower, to solve with all rounds, to verify, and to emit."""
    seconds = dict(compiled.seconds)
    solve = sum(took for stage, took in report.seconds if stage not in ("roadmap", "lower"))
    return seconds["lower"], solve, seconds["verify"], seconds["emit"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, nargs="+", default=[], help="only the table's cells with so many")
    parser.add_argument("--best-of", type=int, default=1, help="plan so many times and show the quickest run")
    parser.add_argument("--solver", default="auto", choices=["auto", "z3", "cadical", "race"])
    parser.add_argument("--paper", action="store_true", help="run the paper's encoding beside each cell of the table")
    parser.add_argument("--limit", type=float, default=120.0, help="seconds for a cell of the paper's encoding")
    arguments = parser.parse_args()
    sys.path.insert(0, str(Path(__file__).parent))
    print(
        f"{'mission':<14} {'N':>3} {'T':>4} {'lower':>7} {'solve':>7} {'verify':>7} {'total':>7} {'emit':>7}", end=" "
    )
    print(f"{'clauses':>8} {'MB':>5} {'published':>13} {'beside':>22} {'ratio':>8}", flush=True)
    for cell in cells(arguments.agents):
        overrides = {"N": str(cell.agents), "T": f"{cell.window} s"}
        file = ROOT / "missions" / f"{cell.name}.mission"
        options = Options(solver=arguments.solver)
        runs = []
        for _ in range(arguments.best_of):
            compiled = missionc.compile(
                file, overrides=overrides, options=options, throughout=missionc.Throughout.AT_STEPS
            )
            outcome = compiled.outcome
            if isinstance(outcome, Verified):
                runs.append((spent(compiled, outcome.report), outcome.report))
        if not runs:
            print(f"{cell.name:<14} {cell.agents:>3} {cell.window:>4} {type(outcome).__name__}")
            continue
        (lower, solve, verify, emit), report = min(runs, key=lambda run: sum(run[0][:3]))
        sizes = dict(report.sizes)
        total = lower + solve + verify
        row = f"{cell.name:<14} {cell.agents:>3} {cell.window:>4}"
        row += f" {lower:>7.3f} {solve:>7.3f} {verify:>7.3f} {total:>7.3f} {emit:>7.3f}"
        published = f"{cell.published[0]:.1f}+{cell.published[1]:.1f}"
        row += f" {sizes['clauses']:>8} {sizes['solver bytes'] / 2**20:>5.0f} {published:>13}"
        if arguments.paper and compiled.checked.mission:
            words, took, stopped = paper_seconds(cell, compiled.checked.mission, arguments.limit)
            row += f" {words:>22} {'>' if stopped else ''}{took / total:>6.0f}x"
        print(row, flush=True)
    print(f"peak of the compiler itself: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
