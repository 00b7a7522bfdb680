"""Benchmark of [strel] Table 2 and its studies: every cell planned, checked for collisions, and verified.

    python bench/strel_table2.py [--agents N ...] [--best-of RUNS] [--solver auto|z3|cadical|race]
                                 [--paper] [--limit SECONDS]

``--agents`` selects the table's cells with these numbers of agents, without the studies. Columns: seconds to lower, to
solve (including collision rounds), to verify, and in total from the start of ``lower`` to a verified plan; seconds to
emit polynomials, their proof and files; number of clauses; peak memory of the solver; the paper's own encoding and
solving seconds, on its machine.

With ``--paper`` each cell is also planned by ``--preset paper``. Further columns: mean number of roadmap nodes over the
agents; seconds for the roadmaps, for the proximity graph, for the encoding and for Z3, the last two in processor time;
its answer; and ``ratio``, its encoding and solving time divided by our total, both elapsed time. A cell that exceeds
the limit, in elapsed seconds, is stopped, and has no ratio.
"""

from __future__ import annotations

import argparse
import resource
from dataclasses import dataclass
from pathlib import Path

import missionc
from missionc.backends.api import NotFound, Report
from missionc.backends.options import Options
from missionc.compiler.results import Compiled, Verified

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


AVOIDING_ONE = {20: (74, 14), 40: (86, 24), 60: (104, 27), 80: (148, 54), 100: (205, 67)}
"""[strel], scaling with complexity, one threat, ten agents."""


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
    table += [Cell("strel_avoid_one", 10, window, published) for window, published in AVOIDING_ONE.items()]
    for name in ("strel_avoid", "strel_avoid_all"):
        table += [Cell(name, 10, window, published) for window, published in AVOIDING.items()]
    return table


def as_published(cell: Cell, limit: float, total: float) -> str:
    """Further columns of a cell, whose plan took ``total`` seconds here."""
    compiled = compiled_cell(cell, Options(preset="paper"), limit)
    outcome = compiled.outcome
    assert isinstance(outcome, Verified | NotFound), outcome
    sizes, seconds = dict(outcome.report.sizes), dict(outcome.report.seconds)
    stages = [seconds.get(stage) for stage in ("roadmap", "links", "encode", "solve")]
    row = f" {sizes['nodes']:>5}" + "".join(f" {'-' if each is None else f'{each:.3f}':>8}" for each in stages)
    answer = "plan" if isinstance(outcome, Verified) else "collides" if outcome.best else outcome.reason.name.lower()
    answer = "no model" if answer == "method" else answer
    whole = f"{sum(each or 0.0 for each in stages[2:]) / total:.0f}x" if stages[3] is not None else ""
    return f"{row} {answer:>9} {whole:>7}"


def compiled_cell(cell: Cell, options: Options, limit: float = 600.0) -> Compiled:
    overrides = {"N": str(cell.agents), "T": f"{cell.window} s"}
    file = ROOT / "missions" / f"{cell.name}.mission"
    at_steps = missionc.ContinuousTime.AT_STEPS
    return missionc.compile(file, overrides=overrides, options=options, continuous_time=at_steps, time_limit=limit)


def spent(compiled: Compiled, report: Report) -> tuple[float, float, float, float]:
    """Seconds to lower, to solve with all rounds, to verify, and to emit."""
    seconds = dict(compiled.seconds)
    solve = sum(took for stage, took in report.seconds if stage not in ("roadmap", "lower"))
    return seconds["lower"], solve, seconds["verify"], seconds["emit"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, nargs="+", default=[], help="only table cells with these team sizes")
    parser.add_argument("--best-of", type=int, default=1, help="number of runs; the fastest one is shown")
    parser.add_argument("--solver", default="auto", choices=["auto", "z3", "cadical", "race"])
    parser.add_argument("--paper", action="store_true", help="also plan each cell with the published method")
    parser.add_argument("--limit", type=float, default=120.0, help="time limit of the published method in seconds")
    arguments = parser.parse_args()
    print(
        f"{'mission':<14} {'N':>3} {'T':>4} {'lower':>7} {'solve':>7} {'verify':>7} {'total':>7} {'emit':>7}", end=" "
    )
    print(f"{'clauses':>8} {'MB':>5} {'published':>13}", end=" ")
    more = f"{'nodes':>5} {'prm':>8} {'graph':>8} {'encode':>8} {'solve':>8} {'answer':>9} {'ratio':>7}"
    print(more * arguments.paper, flush=True)
    for cell in cells(arguments.agents):
        runs = []
        for _ in range(arguments.best_of):
            compiled = compiled_cell(cell, Options(solver=arguments.solver))
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
        if arguments.paper:
            row += as_published(cell, arguments.limit, total)
        print(row, flush=True)
    print(f"peak memory of the compiler: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
