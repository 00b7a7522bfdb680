"""Benchmark of a sweep's overhead: speed-up of k workers over one, and the executor's cost of a run.

    python bench/sweep.py [--workers 2] [--runs 24] [--turns 3] [--mission missions/strel_escape.mission]

One worker and k workers do the same runs alternately, first as processes of this machine, then as a Dask cluster on it,
whose start is not counted. The columns for each executor:

- *ratio*: speed-up of k workers, from the minimum elapsed seconds of all turns.
- *of the cores*: the speed-up divided by k, which is meaningful only on a machine without other load.
- *share*: upper bound on that: with k workers, the processor seconds of the runs as a fraction of those of all
  processes (this program, scheduler, workers, their processes, and the runs).
- *beside*: processor milliseconds of the other processes per run.
- *round trip*: elapsed milliseconds of a request that is rejected after parsing, sent together with many others; the
  cost of the executor in both directions.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from concurrent.futures import wait
from contextlib import contextmanager
from pathlib import Path

import psutil

from missionc.compiler.front_end import check
from missionc.compiler.provenance import inputs
from missionc.tools.sweep import run_answer, run_request, run_sweep
from missionc.tools.sweep.run_request import Request, Settings
from missionc.tools.sweep.run_sweep import Pool

ROOT = Path(__file__).resolve().parents[1]
REFUSED = 400
"""Number of requests of a round trip."""


@contextmanager
def pool(kind: str, workers: int) -> Iterator[Pool]:
    opened = run_sweep.on_cluster(f"local:{workers}") if kind == "dask" else run_sweep.on_this_machine(workers)
    with opened as found:
        assert isinstance(found, Pool), found
        yield found


def done(found: Pool, texts: list[str]) -> tuple[float, list[run_answer.Answer]]:
    """Wall-clock seconds of all requests together, and the answers."""
    began = time.perf_counter()
    futures = [found.executor.submit(found.answer_to, text) for text in texts]
    wait(futures)
    seconds = time.perf_counter() - began
    return seconds, [run_answer.read_run_answer(future.result()) for future in futures]


def others() -> float:
    """Processor seconds so far of this program and all of its descendants that are not runs."""
    own = psutil.Process()
    times = [each.cpu_times() for each in (own, *own.children(recursive=True))]
    return sum(each.user + each.system for each in times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--runs", type=int, default=24)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--mission", type=Path, default=ROOT / "missions" / "strel_escape.mission")
    arguments = parser.parse_args()
    checked = check(arguments.mission)
    assert checked.choice is not None
    settings = Settings(dict(inputs(checked)))
    texts = [
        run_request.run_request_text(Request(settings, {}, seed, checked.choice.engines))
        for seed in range(arguments.runs)
    ]
    many = arguments.workers
    print(
        f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, k = {many}; "
        f"{arguments.runs} runs of {arguments.mission.name}"
    )
    print("| executor | wall s, 1 | wall s, k | ratio | of the cores | share | beside ms | round trip ms |")
    print("|---|---|---|---|---|---|---|---|", flush=True)
    for kind in ("processes", "dask"):
        best: dict[int, tuple[float, ...]] = {}
        with pool(kind, 1) as one, pool(kind, many) as several:
            pools = {1: one, many: several}
            for workers, found in pools.items():
                done(found, texts[: 2 * workers])
            for _ in range(arguments.turns):
                for workers, found in pools.items():
                    before = others()
                    seconds, answers = done(found, texts)
                    beside = others() - before
                    assert {each.result.outcome for each in answers} == {"planned"}, str(answers[0])
                    spent = sum(float(each.result.values["cpu_seconds"] or 0) for each in answers)
                    row = (seconds, spent / (spent + beside), 1e3 * beside / len(texts))
                    best[workers] = min(best.get(workers, row), row)
            trip = done(several, ["{}"] * REFUSED)[0] / REFUSED * many * 1e3
        ratio = best[1][0] / best[many][0]
        print(
            f"| {kind} | {best[1][0]:.2f} | {best[many][0]:.2f} | {ratio:.2f} | {ratio / many:.2f}"
            f" | {best[many][1]:.2f} | {best[many][2]:.1f} | {trip:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
