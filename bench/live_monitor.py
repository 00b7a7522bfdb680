"""Benchmark of live monitoring: 100 agents at 100 Hz, on one core.

    python bench/live_monitor.py [STEPS …]

Agents move at random. Measures, for each mission and each number of steps, in a separate process: the time from JSON
lines, one for each agent and step, to the verdict, as a fraction of real time; milliseconds from the last line of a
step to its verdicts, as median and 99th percentile, and the latter also in processor time, which other programs affect
less; and the memory of the process, after a quarter of the steps and at the end.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

AGENTS, HERTZ, SPEED = 100, 100, 10.0

HEAD = """mission fleet
time  step 0.01 s, horizon {horizon:g} s
world (-200, -200) to (200, 200)
region base = box (-20, -20) to (20, 20)
region goal = box (100, 100) to (140, 140)
team drone[{agents}] {{
  radius   0.1 m
  dynamics single_integrator(speed <= 10 m/s)
  start    grid (-10, -10) to (10, 10)
}}
graph radio = proximity 8 m
"""

PLAIN = """require fence: every drone: always[0, end] x <= 190
require visit: every drone: eventually[0, end] goal
require leave: every drone: base until[0, end] (not base)
"""

MISSIONS = {
    "places": PLAIN,
    "windows": PLAIN
    + """require back: every drone: always[0, {less:g} s] (base or eventually[0, 5 s] base)
require often: every drone: every 5 s: base
""",
    "network": PLAIN + "require network: always[0, end] connected(radio)\n",
}


def rounds(steps: int) -> Iterator[list[str]]:
    """Lines of every step, one for each agent."""
    generator = np.random.default_rng(0)
    position = generator.uniform(-10, 10, (AGENTS, 2))
    for step in range(steps + 1):
        places = position.round(4).tolist()
        yield [
            json.dumps({"t": step / HERTZ, "agent": f"drone[{agent}]", "position": place})
            for agent, place in enumerate(places)
        ]
        position = position + generator.uniform(-SPEED, SPEED, position.shape) / HERTZ / 2


def measure(name: str, steps: int) -> None:
    from missionc.base.source import Source
    from missionc.compiler import driver

    horizon = steps / HERTZ
    text = (HEAD + MISSIONS[name]).format(horizon=horizon, less=horizon - 5, agents=AGENTS)
    checked, session = driver.live_session(Source("fleet.mission", text))
    assert session is not None, [str(each) for each in checked.findings]
    latency, worked, spent, memory = [], [], 0.0, []
    for number, lines in enumerate(rounds(steps)):
        begin = time.perf_counter()
        for line in lines[:-1]:
            list(session.feed(line))
        last, worked_last = time.perf_counter(), time.process_time()
        list(session.feed(lines[-1]))
        end = time.perf_counter()
        spent += end - begin
        worked.append(1000 * (time.process_time() - worked_last))
        latency.append(1000 * (end - last))
        if number in (steps // 4, steps):
            memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    median, late = np.percentile(latency, [50, 99])
    processor = np.percentile(worked, 99)
    share = spent / (steps + 1) * HERTZ
    figures = (
        f"{share:.2f}",
        f"{median:.1f}",
        f"{late:.1f}",
        f"{processor:.1f}",
        f"{memory[0]:.0f}",
        f"{memory[-1]:.0f}",
    )
    print(f"| {name} | {steps} | {' | '.join(figures)} |", flush=True)


def main() -> None:
    print(
        "| mission | steps | of real time | median ms | 99 % ms | processor 99 % ms | MB after a quarter | MB |\n"
        + "|---" * 8
        + "|",
        flush=True,
    )
    for name in MISSIONS:
        for steps in [int(word) for word in sys.argv[1:]] or [2000, 8000]:
            subprocess.run([sys.executable, __file__, "--one", name, str(steps)], check=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        measure(sys.argv[2], int(sys.argv[3]))
    else:
        main()
