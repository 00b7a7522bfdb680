"""Every mission of the transport paper, many seeds each: success, time, path length, clearance.

    python bench/clot_scenarios.py [--seeds 20] [--only NAME …] [--limit SECONDS] [--preset NAME] [--samples N]

Seconds are of one CPU thread's own time, from the checked mission to a plan that passed
verification, restarts included: other programs on the machine lengthen them little. *Emit* is what a user waits
for besides, the polynomials and their proof. *Published* is what the paper reports on its GPU,
for its own unpublished scenes. *Iterations* and *joint motions* are what a preset's search took and had to choose from
in the mean (the paper reports 6.85, 13.95 and 17.37 iterations, and 9.40, 44.70 and 19.05 joint motions, of its first
three scenarios); a dash where nothing was searched.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

import numpy as np

import missionc
from missionc.backends.api import Budget, Planned
from missionc.backends.load import load
from missionc.backends.options import TRANSPORT_PRESETS, Options
from missionc.diagnostics.model import Diagnostic
from missionc.flight.crazyflie import crazyflie
from missionc.verify.verify_plan import verify

MISSIONS = Path(__file__).resolve().parent.parent / "missions"

SCENARIOS = {
    "visit3": ("clot_visit", {"N": "3"}, 4.19),
    "visit5": ("clot_visit", {"N": "5"}, 6.93),
    "visit12": ("clot_visit", {"N": "12"}, 20.3),
    "visit30": ("clot_visit", {"N": "30"}, None),
    "star": ("clot_star", {}, 34.9),
    "corridor": ("clot_corridor", {}, 91.0),
    "regions": ("clot_regions", {}, 151.9),
    "split": ("clot_split", {}, 242.4),
    "split100": ("clot_split100", {}, 971.5),
    "dynamic2": ("clot_dynamic", {"V": "2 m/s"}, 9.0),
    "dynamic6": ("clot_dynamic", {"V": "6 m/s"}, 9.0),
    "crazyflie": ("crazyflie_corridor", {}, 2.91),
}
"""Name of the row: mission, parameters, the paper's seconds."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", nargs="*", choices=list(SCENARIOS))
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for each seed")
    parser.add_argument("--preset", choices=TRANSPORT_PRESETS, default=TRANSPORT_PRESETS[0], help="how to plan")
    parser.add_argument("--samples", type=int, help="trajectories that the preset optimises at once")
    arguments = parser.parse_args()
    options = Options(preset=arguments.preset, samples=arguments.samples)
    backend = load("clot")
    if isinstance(backend, Diagnostic):
        raise SystemExit(backend.message)
    print(
        "| scenario | solved | mean s | median s | max s | emit s | attempts "
        "| iterations | joint motions | path m | bend m/s² | clearance m | published s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for name in arguments.only or SCENARIOS:
        file, overrides, published = SCENARIOS[name]
        checked = missionc.check(MISSIONS / f"{file}.mission", overrides=overrides, backend="clot")
        mission, kernel = checked.mission, checked.kernel
        assert mission is not None
        assert kernel is not None
        seconds, emitting, attempts, lengths, bends, clearances = [], [], [], [], [], []
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
            position = outcome.trace.position
            lengths.append(float(np.linalg.norm(np.diff(position, axis=1), axis=-1).sum(axis=1).mean()))
            bend = np.diff(position, 2, axis=1) / mission.step**2
            bends.append(float(np.linalg.norm(bend, axis=-1).mean()))
            clearances.append(
                min(check.margin for check in certificate.checks if check.name in ("obstacle", "separation"))
            )
        if not seconds:
            print(f"| {name} | 0/{arguments.seeds} | | | | | | | | | | | {published or '–'} |", flush=True)
            continue
        print(
            f"| {name} | {len(seconds)}/{arguments.seeds} | {statistics.mean(seconds):.2f} | "
            f"{statistics.median(seconds):.2f} | {max(seconds):.2f} | {statistics.mean(emitting):.2f} | "
            f"{statistics.mean(attempts):.2f} | "
            f"{' | '.join(f'{statistics.mean(values):.2f}' if values else '–' for values in searched.values())} | "
            f"{statistics.mean(lengths):.2f} | {statistics.mean(bends):.2f} | {min(clearances):.3f} | "
            f"{published or '–'} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
