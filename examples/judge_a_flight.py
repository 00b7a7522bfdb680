"""Plan a mission, disturb the flight by wind, and ask whether it still is what the mission says.

python examples/judge_a_flight.py missions/wildfire.mission
"""

from __future__ import annotations

import csv
import sys
import tempfile
from pathlib import Path

import numpy as np

import missionc


def main(mission: str) -> int:
    compiled = missionc.compile(mission)
    if not isinstance(compiled.outcome, missionc.Verified) or compiled.checked.mission is None:
        print("no plan")
        return 1
    trace = compiled.outcome.plan.trace
    generator = np.random.default_rng(0)
    for wind in (0.0, 0.02, 0.5):
        flown = trace.position + generator.normal(scale=wind, size=trace.position.shape)
        with tempfile.TemporaryDirectory() as folder:
            log = Path(folder) / "flown.csv"
            with log.open("w", newline="") as file:
                table = csv.writer(file)
                table.writerow(["agent", "t", *"xyz"[: flown.shape[2]]])
                for agent in compiled.checked.mission.agents:
                    for step, point in enumerate(flown[agent.index]):
                        table.writerow([agent.name, step * trace.step, *point])
            judged = missionc.monitor(mission, log)
        worst = min(judged.requirements, key=lambda each: each.robustness)
        verdict = "satisfied" if judged.satisfied else "violated"
        print(f"wind {wind} m: {verdict}, least robustness {worst.robustness:.2f} ({worst.name})")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1] if len(sys.argv) > 1 else "missions/wildfire.mission"))
