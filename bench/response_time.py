"""Benchmark of the waiting time for `missionc demo`, and after a save with `--watch`.

    python bench/response_time.py [RUNS]

Prints the minimum and the median time of the runs in seconds. `demo` is the complete process, from its start to its
end, without a browser; *processor* is its processor time, which other programs affect little. `check` and `compile` are
from the save to the last line of output; 0.15 s of that is the time for which a file must be unchanged. Bytecode is
cached, as it is by default.
"""

from __future__ import annotations

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MISSION = ROOT / "missions" / "wildfire.mission"
ENVIRONMENT = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"} | {
    "PYTHONPATH": str(ROOT),
    "PYTHONUNBUFFERED": "1",
}


def demo(folder: Path, runs: int) -> Iterator[tuple[float, float]]:
    """Wall-clock and processor seconds, children included."""
    command = [sys.executable, "-m", "missionc", "demo", "--no-open"]
    for _ in range(runs + 1):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begin = time.perf_counter()
        subprocess.run(command, cwd=folder, check=True, capture_output=True, env=ENVIRONMENT)
        took = time.perf_counter() - begin
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        yield took, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def saved(folder: Path, words: list[str], last: str, runs: int) -> Iterator[float]:
    """Seconds from a save to the line that begins with these words."""
    text = MISSION.read_text(encoding="utf-8")
    mission = folder / "wildfire.mission"
    mission.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "missionc", *words]
    with subprocess.Popen(command, cwd=folder, env=ENVIRONMENT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for number in range(runs + 1):
            begin = time.perf_counter()
            while not process.stdout.readline().startswith(last):
                pass
            if number:
                yield time.perf_counter() - begin
            time.sleep(3.0)  # the next process loads the planner, as it does while a user types
            mission.write_text(text + "#\n" * (number + 1), encoding="utf-8")
        process.terminate()


def main(runs: int) -> None:
    print(f"{'':<20} {'least':>7} {'median':>7}   seconds, {runs} runs")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        wall, processor = zip(*list(demo(folder, runs))[1:], strict=True)
        checks = list(saved(folder, ["check", "wildfire.mission", "--watch"], "wildfire.mission:", runs))
        plans = list(saved(folder, ["compile", "wildfire.mission", "--watch", "--no-open"], "  build/", runs))
    rows = {"demo": wall, "demo, processor": processor, "check after a save": checks, "plan after a save": plans}
    for row, took in rows.items():
        print(f"{row:<20} {min(took):7.3f} {statistics.median(took):7.3f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
