"""Benchmark of the steps after the search: polynomials, their proof, and files, in two source trees.

    python bench/emit_time.py [--against TREE] [--only NAME …] [--limit SECONDS]

Each tree plans in a separate process, one after the other. Seconds are processor time of the stage ``emit`` and of the
complete compilation. *Peaks* are the maximum speed and acceleration of the polynomials. *Same* states whether both
trees wrote the same bytes; if not, their plans may differ.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

CASES = {
    "phi1, N = 10, T = 60": ("strel_deliver", {"N": "10", "T": "60 s"}),
    "phi1, N = 10, T = 100": ("strel_deliver", {"N": "10", "T": "100 s"}),
    "phi1, N = 20, T = 60": ("strel_deliver", {"N": "20", "T": "60 s"}),
    "phi1, N = 20, T = 100": ("strel_deliver", {"N": "20", "T": "100 s"}),
    "visit30": ("clot_visit", {"N": "30"}),
    "split": ("clot_split", {}),
    "split100": ("clot_split100", {}),
    "crazyflie_corridor": ("crazyflie_corridor", {}),
    "crazyflie_corridor_flight": ("crazyflie_corridor_flight", {}),
    "wildfire_flight": ("wildfire_flight", {}),
    "figures20": ("field/figures20", {}),
    "hospital_couriers": ("field/hospital_couriers", {}),
    "museum_night": ("field/museum_night", {}),
}
"""Name of the row: mission, parameters."""

CHILD = """
import hashlib, json, sys, time
import missionc
from missionc.output import output_files
spent = 0.0
def emit(*given):
    global spent
    begin = time.process_time()
    value = original(*given)
    spent += time.process_time() - begin
    return value
original, output_files.emit = output_files.emit, emit
file, overrides, limit = json.loads(sys.argv[1])
begin = time.process_time()
outcome = missionc.compile(file, overrides=overrides, time_limit=limit).outcome
whole = time.process_time() - begin
certificate = getattr(outcome, "certificate", None)
figures = certificate.figures if certificate else ()
peaks = {figure.name: figure.value for figure in figures if figure.name.startswith("peak ")}
files = sorted(content for name, content in dict(getattr(outcome, "files", {})).items() if name.endswith(".csv"))
digest = hashlib.sha256(b"".join(files)).hexdigest() if files else ""
print(json.dumps([type(outcome).__name__, spent, whole, peaks, digest]))
"""


def measured(tree: Path, name: str, limit: float) -> tuple[str, float, float, dict[str, float], str]:
    """Outcome, seconds of ``emit`` and in total, peaks, and a digest of the files."""
    file, overrides = CASES[name]
    given = json.dumps([str(ROOT / "missions" / f"{file}.mission"), overrides, limit])
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    ran = subprocess.run(
        [sys.executable, "-P", "-c", CHILD, given], env=environment, cwd=tree, capture_output=True, text=True
    )
    if ran.returncode:
        raise SystemExit(ran.stderr)
    outcome, emit, whole, peaks, digest = json.loads(ran.stdout.splitlines()[-1])
    return outcome, emit, whole, peaks, digest


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, help="source tree to compare with, with the same missions")
    parser.add_argument("--only", nargs="*", choices=list(CASES), default=list(CASES))
    parser.add_argument(
        "--limit", type=float, default=120.0, help="time limit of each mission, in seconds of wall time"
    )
    arguments = parser.parse_args()
    print("| mission | emit before s | emit s | ratio | whole s | peaks before | peaks m/s, m/s² | same |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    for name in arguments.only:
        outcome, emit, whole, peaks, digest = measured(ROOT, name, arguments.limit)
        if outcome != "Verified":
            print(f"| {name} | {outcome} | | | | | | |", flush=True)
            continue
        shown = ", ".join(f"{value:.2f}" for value in peaks.values())
        before, ratio, others, same = "–", "–", "–", "–"
        if arguments.against:
            was, emit_before, _, peaks_before, digest_before = measured(arguments.against, name, arguments.limit)
            before, others = (f"{emit_before:.2f}", ", ".join(f"{value:.2f}" for value in peaks_before.values()))
            ratio = f"{emit_before / emit:.1f}" if was == "Verified" else was
            same = "yes" if digest == digest_before else "no"
        print(f"| {name} | {before} | {emit:.2f} | {ratio} | {whole:.2f} | {others} | {shown} | {same} |", flush=True)


if __name__ == "__main__":
    main()
