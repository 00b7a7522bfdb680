"""Benchmark of first compilations with a vehicle: success of the flight proof for the first plan.

    python bench/first_compiles.py [--only NAME …] [--time-limit 120] [--json FILE] [--against FILE]

The missions are those of the repository that name a vehicle, and those of the gallery at the scale of a Crazyflie
(worlds of at most 30 m, agents of at most 1.5 m/s), which fly as ``crazyflie21``. Each is compiled once, as by a user,
one after the other, in a separate process and without explanations of infeasibility. *Code* is the error code. *Pace*
is the fraction of the vehicles' speeds at which a flight exists, if the first plan has none at full speed.
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from field import run
from response_time import ROOT

from missionc.compiler import driver

VEHICLE = "crazyflie21"
LARGEST, FASTEST = 30.0, 1.5
"""Limits at the scale of a Crazyflie: world in metres, speed in m/s."""
PACE = re.compile(r"at ([0-9.]+) of the speeds")


@dataclass(frozen=True, slots=True)
class Row:
    """Result of one first compilation."""

    outcome: str
    code: str
    pace: str
    processor: float
    wall: float

    @property
    def flown(self) -> bool:
        return self.outcome == "planned"


def missions() -> Iterator[tuple[str, Path, str]]:
    """Names, files, and the vehicle for teams without one."""
    for path in sorted((ROOT / "missions").glob("*.mission")) + sorted((ROOT / "missions/vehicles").glob("*.mission")):
        if "vehicle " in path.read_text(encoding="utf-8"):
            yield path.stem, path, ""
    for path in sorted((ROOT / "missions" / "gallery").glob("*.mission")):
        mission = driver.check(path, vehicle=VEHICLE).mission
        if mission is None:
            continue
        world = max(high - low for low, high in zip(mission.world.low, mission.world.high, strict=True))
        if world <= LARGEST and max(agent.dynamics.top_speed for agent in mission.agents) <= FASTEST:
            yield path.stem, path, VEHICLE


def measured(path: Path, vehicle: str, limit: float) -> Row:
    """Compile one mission and measure it."""
    with tempfile.TemporaryDirectory() as name:
        came = run(path, limit, Path(name) / "plan", ("--vehicle", vehicle) if vehicle else ())
    found = came.document["diagnostics"]
    code = next((each["code"] for each in found if each["severity"] == "error"), "")
    pace = PACE.search(json.dumps(came.document))
    return Row(str(came.document["outcome"]), code, pace[1] if pace else "", came.processor, came.wall)


def line(name: str, row: Row, before: Row | None, compares: bool) -> str:
    cells = [name, row.outcome, row.code or "–", row.pace or "–", f"{row.processor:.1f}", f"{row.wall:.1f}"]
    if compares:
        cells += [(before.code or before.outcome) if before else "–", f"{before.processor:.1f}" if before else "–"]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="*", metavar="NAME", help="only these missions")
    parser.add_argument(
        "--time-limit", type=float, default=120.0, help="time limit of each mission, in seconds of wall time"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the results to a file")
    parser.add_argument("--against", type=Path, metavar="FILE", help="compare with the results in this file")
    arguments = parser.parse_args()
    kept = json.loads(arguments.against.read_text(encoding="utf-8")) if arguments.against else {}
    before = {name: Row(**row) for name, row in kept.items()}
    heads = ["mission", "outcome", "code", "pace", "CPU s", "wall s"] + (["before", "CPU s before"] if before else [])
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}", flush=True)
    rows: dict[str, Row] = {}
    for name, path, vehicle in missions():
        if arguments.only and name not in arguments.only:
            continue
        rows[name] = measured(path, vehicle, arguments.time_limit)
        print(line(name, rows[name], before.get(name), bool(before)), flush=True)
        if arguments.json:
            text = json.dumps({each: asdict(row) for each, row in rows.items()}, indent=1)
            arguments.json.write_text(text + "\n", encoding="utf-8")
    print(f"\n{sum(row.flown for row in rows.values())} of {len(rows)} pass the flight proof at the first compilation")


if __name__ == "__main__":
    main()
