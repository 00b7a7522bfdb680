"""Benchmark of every mission in the transport paper, many seeds each: success, time, path length, clearance.

    python bench/clot_scenarios.py [--seeds 20] [--only NAME …] [--limit SECONDS] [--preset NAME] [--samples N]

Seconds are CPU seconds of one thread, from the checked mission to a verified plan, including restarts; other programs
on the machine affect them little. *Emit* is the time for the polynomials and their proof, which follow. *Iterations*
and *joint motions* are, on average, the iterations of a preset's search and the joint motions among which it selects; a
dash means that there was no search. *Published* are the paper's results on its GPU, for its own unpublished scenes:
success, seconds, path, smoothness, iterations, joint motions, as far as it states them.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

from table1.score import BODIES, shape

import missionc
from missionc.backends.api import Budget, Planned
from missionc.backends.load import load
from missionc.backends.options import TRANSPORT_PRESETS, Options
from missionc.base.diagnostics.model import Diagnostic
from missionc.flight.trajectories.crazyflie import crazyflie
from missionc.verification.verify_plan import verify

MISSIONS = Path(__file__).resolve().parent.parent / "missions"

SCENARIOS = {
    "visit3": ("clot_visit", {"N": "3"}, "100 %, 4.19 s, 14.5 m, 0.51 m/s"),
    "visit5": ("clot_visit", {"N": "5"}, "100 %, 6.93 s, 14.0 m, 0.46 m/s"),
    "visit12": ("clot_visit", {"N": "12"}, "100 %, 20.3 s, 13.5 m, 0.43 m/s"),
    "visit30": ("clot_visit", {"N": "30"}, "–"),
    "star": ("clot_star", {}, "100 %, 34.89 s, 6.85 iterations, 9.40 joint motions"),
    "corridor": ("clot_corridor", {}, "100 %, 90.98 s, 13.95 iterations, 44.70 joint motions"),
    "regions": ("clot_regions", {}, "95 %, 151.91 s, 17.37 iterations, 19.05 joint motions"),
    "split": ("clot_split", {}, "95 %, 242.4 s, 30 iterations"),
    "split100": ("clot_split100", {}, "100 %, 971.5 s"),
    "dynamic2": ("clot_dynamic", {"V": "2 m/s"}, "100 %, 9 s"),
    "dynamic6": ("clot_dynamic", {"V": "6 m/s"}, "100 %, 9 s"),
    "crazyflie": ("crazyflie_corridor", {}, "2.91 s"),
}
"""Name of the row: mission, parameters, the paper's values."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", nargs="*", choices=list(SCENARIOS))
    parser.add_argument("--limit", type=float, default=300.0, help="time limit of each seed in seconds")
    parser.add_argument("--preset", choices=TRANSPORT_PRESETS, default=TRANSPORT_PRESETS[0], help="planning method")
    parser.add_argument("--samples", type=int, help="number of trajectories that the preset optimizes together")
    arguments = parser.parse_args()
    options = Options(preset=arguments.preset, samples=arguments.samples)
    backend = load("clot")
    if isinstance(backend, Diagnostic):
        raise SystemExit(backend.message)
    print(
        "| scenario | solved | mean s | median s | max s | emit s | attempts "
        "| iterations | joint motions | path m | smoothness m/s | clearance m | published |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for name in arguments.only or SCENARIOS:
        file, overrides, published = SCENARIOS[name]
        checked = missionc.check(MISSIONS / f"{file}.mission", overrides=overrides, backend="clot")
        mission, kernel = checked.mission, checked.kernel
        assert mission is not None
        assert kernel is not None
        seconds, emitting, attempts, shapes, clearances = [], [], [], [], []
        searched: dict[str, list[int]] = {"local iterations": [], "joint motions": []}
        for seed in range(arguments.seeds):
            begin = time.process_time()
            outcome = backend.plan(mission, kernel, options, Budget(time.monotonic() + arguments.limit, seed=seed))
            if not isinstance(outcome, Planned):
                print(f"  {name} seed {seed}: {outcome.statement}", flush=True)
                continue
            certificate = verify(mission, kernel, outcome.trace)
            if not certificate.passed:
                print(f"  {name} seed {seed}: refused by the verifier: {certificate.failures[0]}", flush=True)
                continue
            planned = time.process_time()
            seconds.append(planned - begin)
            crazyflie(mission, kernel, outcome.trace)
            emitting.append(time.process_time() - planned)
            sizes = dict(outcome.report.sizes)
            attempts.append(sizes["attempts"])
            for size, values in searched.items():
                values += [sizes[size]] if size in sizes else []
            shapes.append(shape(outcome.trace))
            clearances.append(min(check.margin for check in certificate.checks if check.name in BODIES))
        if not seconds:
            print(f"| {name} | 0/{arguments.seeds} | | | | | | | | | | | {published} |", flush=True)
            continue
        print(
            f"| {name} | {len(seconds)}/{arguments.seeds} | {statistics.mean(seconds):.2f} | "
            f"{statistics.median(seconds):.2f} | {max(seconds):.2f} | {statistics.mean(emitting):.2f} | "
            f"{statistics.mean(attempts):.2f} | "
            f"{' | '.join(f'{statistics.mean(values):.2f}' if values else '–' for values in searched.values())} | "
            f"{statistics.mean(length for length, _ in shapes):.2f} | "
            f"{statistics.mean(smoothness for _, smoothness in shapes):.3f} | {min(clearances):.3f} | {published} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
