"""Benchmark of the methods in [clot] Table I: visit two regions together and stay connected.

Compares the transport backend with other methods in one run.

    python bench/clot_table1.py [--agents 3 5 12 30] [--seeds 20] [--rival-seeds 20] [--limit 60] [--only METHOD …]

Every method plans ``missions/clot_visit.mission``, and the same verifier evaluates the results. *Ours* is the
unmodified backend. The others run in a separate process each, with at most ``--limit`` CPU seconds per run:

    clot          the paper's own method as published, as the preset ``paper``
    clot search   search with the sketch and schedule of *ours*, and joint optimization: the preset ``search``
    fsot, mpot    our implementations of the paper's ablations, as presets: agents in a fixed order; all at once
    cons          a linear consensus law that tracks a reference
    gradient      Adam on smooth robustness from 16 initial values; implemented in this folder
    cbs           conflict-based search on a grid, leg by leg
    micp          stlpy's formula tree as mixed-integer program, solved by HiGHS; first feasible point
    micp between  the same, with conditions that separate bodies between the steps
    nlp           stlpy's smooth robustness, maximized by SNOPT

A method without any plan that is valid at the steps gets only one seed for each larger team. The module docstrings in
``bench/table1/`` state the approximations of each formulation. An extra installs the packages of the other methods:
``pip install 'missionc[rivals]'``. A method whose package is missing is omitted and named; if ``--only`` selects it,
nothing runs, and the exit status is 1.

Columns: *solved*, number of verified plans, also between the steps; *at steps*, number of plans that are valid at the
steps (which a formulation at samples can ensure); mean CPU seconds of all runs, with the limit for stopped ones (``>``
if there are any); mean path length of a robot; smoothness, the mean ``|v(t+1) - v(t)|`` over robots and steps (the
paper does not define its own); minimum clearance, at any time, between bodies or to an obstacle, minus the required
one; for searches, the mean number of iterations and of joint motions among which they select; peak memory of the
process, including libraries. Path, smoothness and clearance are means over the solved runs; without any, those of the
returned motions in brackets. *Published* are the paper's success and seconds, on its GPU, in its own unpublished scene.
"""

from __future__ import annotations

import argparse
import importlib.util
import statistics
import sys
from collections import Counter
from pathlib import Path

MISSION = Path(__file__).resolve().parent.parent / "missions" / "clot_visit.mission"

sys.path.insert(0, str(Path(__file__).resolve().parent))

from table1.runner import Run, Task, runs  # noqa: E402
from table1.score import Score  # noqa: E402

METHODS: dict[str, tuple[str, tuple[tuple[str, object], ...], bool, tuple[str, ...]]] = {
    "ours": ("ours", (), True, ("torch",)),
    "clot": ("ours", (("preset", "paper"),), True, ("torch",)),
    "clot search": ("ours", (("preset", "search"),), True, ("torch",)),
    "fsot": ("ours", (("preset", "fsot"),), True, ("torch",)),
    "mpot": ("ours", (("preset", "mpot"),), True, ("torch",)),
    "gradient": ("gradient", (), True, ("torch",)),
    "cons": ("cons", (), False, ("torch",)),
    "cbs": ("cbs", (), False, ("w9_pathfinding",)),
    "micp": ("micp", (), False, ("stlpy",)),
    "micp between": ("micp", (("between", True),), False, ("stlpy",)),
    "nlp": ("nlp", (), False, ("stlpy", "pydrake")),
}
"""Name of the row: module, options, whether the first call is not counted, packages."""
INSTALL = "pip install 'missionc[rivals]'"

PUBLISHED = {
    ("clot", 3): (1.0, 4.19, 14.5, 0.51),
    ("clot", 5): (1.0, 6.93, 14.0, 0.46),
    ("clot", 12): (1.0, 20.3, 13.5, 0.43),
    ("cons", 3): (1.0, 1.41, 12.3, 0.56),
    ("cons", 5): (1.0, 3.00, 12.1, 0.54),
    ("cons", 12): (0.0, None, None, None),
    ("mpot", 3): (1.0, 3.14, 14.6, 0.54),
    ("mpot", 5): (1.0, 5.55, 14.3, 0.49),
    ("mpot", 12): (0.1, 26.5, 13.7, 0.46),
    ("fsot", 3): (1.0, 4.00, 13.4, 0.45),
    ("fsot", 5): (1.0, 6.63, 12.8, 0.40),
    ("fsot", 12): (0.7, 19.8, 12.0, 0.36),
    ("micp", 3): (0.0, 28.5, None, None),
    ("micp", 5): (0.0, None, None, None),
    ("micp", 12): (0.0, None, None, None),
    ("nlp", 3): (0.0, 16.0, None, None),
    ("nlp", 5): (0.0, None, None, None),
    ("nlp", 12): (0.0, None, None, None),
    ("cbs", 3): (1.0, 4.64, 16.0, None),
    ("cbs", 5): (0.0, 6.73, 15.0, None),
    ("cbs", 12): (0.0, None, None, None),
}
"""[clot] Table I: success, seconds, path m, smoothness."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--agents", type=int, nargs="+", default=[3, 5, 12, 30])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--rival-seeds", type=int, help="number of seeds of the other methods; default: --seeds")
    parser.add_argument("--limit", type=float, default=60.0, help="time limit of a run in CPU seconds")
    parser.add_argument("--memory", type=float, default=8.0, help="memory limit of a process in GiB")
    parser.add_argument("--only", nargs="+", choices=list(METHODS), default=[])
    arguments = parser.parse_args()
    missing = {name: absent for name in METHODS if (absent := missing_packages(name))}
    if words := [f"{name} needs {' and '.join(missing[name])}" for name in arguments.only if name in missing]:
        sys.exit(f"not installed: {'; '.join(words)}\nhelp: {INSTALL}")
    print(
        "| N | method | solved | at steps | CPU s | iterations | joint motions "
        "| path m | smoothness m/s | clearance m | peak MB | published |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    remarks: list[str] = []
    beaten: set[str] = set()
    for agents in arguments.agents:
        for name in arguments.only or [name for name in METHODS if name not in missing]:
            module, options, warm, _ = METHODS[name]
            count = arguments.seeds if name == "ours" else arguments.rival_seeds or arguments.seeds
            seeds = list(range(1 if name in beaten else count))
            task = Task(
                module, MISSION, agents, arguments.limit, int(arguments.memory * 2**30), warm=warm, options=options
            )
            made = runs(task, seeds)
            print(row(name, agents, made), flush=True)
            if not any(isinstance(run.score, Score) and run.score.sampled for run in made):
                beaten.add(name)
            why = Counter(words for run in made if (words := reason(run)))
            remarks.extend(f"{name}, N = {agents}, {times} times: {words}" for words, times in why.most_common(3))
    if not arguments.only:
        remarks += [
            f"{name}: left out, {' and '.join(absent)} not installed; {INSTALL}" for name, absent in missing.items()
        ]
    print()
    print("\n".join(remarks))


def missing_packages(name: str) -> list[str]:
    """Packages of a method that are not installed."""
    return [package for package in METHODS[name][3] if importlib.util.find_spec(package) is None]


def row(name: str, agents: int, made: list[Run]) -> str:
    scores = [run.score for run in made if isinstance(run.score, Score)]
    solved = [score for score in scores if score.solved]
    shown = solved or scores
    open_, close = ("", "") if solved else ("(", ")")
    seconds = [run.seconds for run in made]
    stopped = any(run.words.startswith("stopped") for run in made)
    memory = max(run.memory for run in made)
    cells = [str(agents), name, f"{len(solved)}/{len(made)}", f"{sum(score.sampled for score in scores)}/{len(made)}"]
    cells.append(f"{'> ' if stopped else ''}{statistics.mean(seconds):.2f}")
    for figure in ("iterations", "joint_motions"):
        counts = [count for run in made if (count := getattr(run, figure)) is not None]
        cells.append(f"{statistics.mean(counts):.1f}" if counts else "–")
    for figure, pick in (("length", statistics.mean), ("smoothness", statistics.mean), ("clearance", min)):
        values = [getattr(score, figure) for score in shown]
        digits = 3 if figure == "clearance" else 2
        cells.append(f"{open_}{pick(values):.{digits}f}{close}" if values else "–")
    cells.append(f"{memory / 2**20:.0f}" if memory else "–")
    cells.append(published(name, agents))
    return f"| {' | '.join(cells)} |"


def published(name: str, agents: int) -> str:
    if (name, agents) not in PUBLISHED:
        return "–"
    success, seconds, path, smoothness = PUBLISHED[name, agents]
    parts = [f"{success:.0%}"]
    parts += [f"{seconds:g} s"] if seconds is not None else []
    parts += [f"{path:g} m"] if path is not None else []
    parts += [f"{smoothness:g}"] if smoothness is not None else []
    return ", ".join(parts)


def reason(run: Run) -> str:
    """Reason why a run failed, without numbers that vary with the seed."""
    if isinstance(run.score, Score):
        if run.score.solved:
            return ""
        return "refused by the verifier: " + " and ".join(
            sorted({part.split()[0] for part in run.score.refused.split("; ")})
        )
    return run.words.split(" by ")[0]


if __name__ == "__main__":
    main()
