"""Benchmark of disturbed flights in a closed loop: satisfied requirements with and without replanning.

    python bench/closed_loop.py [--flights 25] [--within 3] [--clock SECONDS] [--workers 1] [MISSION …]

Each mission is compiled once and flown in ``--flights`` random scenarios (a lost drone, a slow one, a new obstacle;
wind, noise, dropouts, late packets, clock errors), in each of them without and with replanning. A requirement is lost
if it is violated; all are lost in a flight in which bodies touch. The columns for each mission:

- *lost*: number of requirements lost without replanning.
- *beyond*: number of those that could not be satisfied any more when the earliest new plan could start, given the
  maximum speeds of the remaining agents.
- *anew*: number of requirements lost with replanning.
- *saved*: fraction of lost requirements that replanning satisfies, of all and of those that are not *beyond*.
- *touched*: number of flights in which bodies touched, without and with replanning.
- *replan/first*: duration of replanning relative to that of the first plan.
"""

from __future__ import annotations

import argparse
import math
import statistics
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from missionc.base.limits import Limits
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.cli.fly_folder import Opened, open_folder
from missionc.compiler.driver import compile
from missionc.compiler.replan.request import Flying
from missionc.compiler.results import Verified
from missionc.ir import Mission
from missionc.tools.closed_loop.fly_loop import LoopFlight, fly_loop
from missionc.tools.closed_loop.loop_record import said
from missionc.tools.closed_loop.scenario import Event, Scenario

ROOT = Path(__file__).resolve().parent.parent
MISSIONS = (
    "missions/wildfire_flight.mission",
    "missions/crazyflie_corridor_flight.mission",
    "missions/gallery/museum_guard.mission",
    "missions/gallery/warehouse_picking.mission",
)
VEHICLE = "crazyflie21"
EVADED = 1.0
"""Minimum distance in metres of a new obstacle: a nearer one hits agents at 1 m/s."""


def drawn(mission: Mission, plan: Trace, random: np.random.Generator) -> Scenario:
    """Random scenario with one event, after the beginning and before the last third of the mission."""
    at = float(mission.horizon * random.uniform(0.1, 0.6))
    there = plan.position[:, int(at / mission.step), :2]
    agent = mission.agents[int(random.integers(len(mission.agents)))].name
    match int(random.integers(3)):
        case 0:
            event = Event(at, lose=agent)
        case 1:
            event = Event(at, slow=agent, to=0.5)
        case _:
            low, high = np.array(mission.world.low[:2]), np.array(mission.world.high[:2])
            radius = 0.04 * float((high - low).min())
            place = low + (high - low) * random.uniform(0.1, 0.9, 2)
            while np.linalg.norm(there - place, axis=1).min() < radius + EVADED:
                place = low + (high - low) * random.uniform(0.1, 0.9, 2)
            x, y = place.round(2).tolist()
            event = Event(at, change=f"obstacle debris = disc at ({x}, {y}) radius {radius:.2f}")
    return Scenario(
        wind=float(random.uniform(0, 0.3)),
        gust=float(random.uniform(0, 0.1)),
        noise=0.01,
        dropped=float(random.uniform(0, 0.2)),
        late=float(random.uniform(0, 0.1)),
        skew=float(random.uniform(0, 0.05)),
        events=(event,),
    )


@dataclass(frozen=True, slots=True)
class Row:
    """Result of one scenario: counts of requirements, collisions, and seconds of each replanning."""

    lost: int
    beyond: int
    lost_anew: int
    kept_anew: int
    touched: bool
    touched_anew: bool
    seconds: tuple[float, ...]
    told: str


def flown(folder: Path, number: int, flight: int, within: float, clock: float | None) -> Row:
    """Results of one scenario with monitoring only and with replanning."""
    flying = _opened(folder)
    mission = flying.checked.mission
    assert mission is not None
    scenario = drawn(mission, flying.trace, np.random.default_rng([number, flight]))
    settings = (flying, scenario, flight, Seconds(within), Limits())
    alone = fly_loop(*settings, replans=False)
    anew = fly_loop(*settings, clock=None if clock is None else Seconds(clock))
    known = anew.happened[0].time if anew.happened else math.inf
    lost, lost_anew = _lost(alone), _lost(anew)
    beyond = {name for name in lost if alone.outcome.since.get(name, math.inf) <= known + within}
    event = scenario.events[0]
    what = f"{event.at:.1f} s {event.lose and f'lose {event.lose}'}{event.slow and f'slow {event.slow}'}{event.change}"
    lines = [f"  {flight}: {what}: lost {_when(alone, lost)}, anew {_when(anew, lost_anew)}"]
    lines += [f"      {each.time:.1f} s: {said(each)}" for each in anew.happened]
    return Row(
        len(lost),
        len(beyond),
        len(lost_anew),
        len(lost - beyond - lost_anew),
        not alone.outcome.untouched,
        not anew.outcome.untouched,
        tuple(each.seconds for each in anew.happened if each.seconds),
        "\n".join(lines),
    )


def _lost(flight: LoopFlight) -> set[str]:
    """Violated requirements: all of them after a collision."""
    return {name for name, kept in flight.outcome.requirements.items() if not (kept and flight.outcome.untouched)}


def _when(flight: LoopFlight, names: set[str]) -> str:
    since = flight.outcome.since
    return ", ".join(f"{name} ({since[name]:.1f} s)" if name in since else name for name in sorted(names)) or "nothing"


@cache
def _opened(folder: Path) -> Flying:
    found = open_folder(folder, Limits())
    assert isinstance(found, Opened), [each.message for each in found]
    return found.flying


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("missions", nargs="*", default=MISSIONS)
    parser.add_argument("--flights", type=int, default=25)
    parser.add_argument("--within", type=float, default=3.0)
    parser.add_argument(
        "--clock", type=float, default=None, help="time limit of planning in seconds; default: --within"
    )
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument(
        "--tell", action="store_true", help="print the events of each flight with a violated requirement"
    )
    arguments = parser.parse_args()
    print("mission                   flights  lost beyond  anew | saved: all  others | touched  replan/first")
    rows: list[Row] = []
    with TemporaryDirectory() as place, ProcessPoolExecutor(arguments.workers, get_context("spawn")) as pool:
        pending = []
        for number, file in enumerate(arguments.missions):
            folder = Path(place) / Path(file).stem
            first = pool.submit(compiled, ROOT / file, folder)
            pending.append((number, folder, first))
        flights = []
        for number, folder, first in pending:
            if first.result() is not None:
                asked = (arguments.within, arguments.clock)
                each = [pool.submit(flown, folder, number, flight, *asked) for flight in range(arguments.flights)]
                flights.append((folder, first.result(), each))
            else:
                print(f"{folder.name:25} no plan", flush=True)
        for folder, first, each in flights:
            own = [future.result() for future in each]
            if arguments.tell:
                print("\n".join(row.told for row in own if row.lost or row.lost_anew or row.touched_anew))
            say(folder.name, own, first)
            rows += own
    say("all", rows, None)


def compiled(file: Path, folder: Path) -> float | None:
    """Write the folder of a mission; returns the compilation time in seconds, or None without a plan."""
    began = time.monotonic()
    found = compile(file, vehicle="" if "vehicle" in file.read_text() else VEHICLE, time_limit=Seconds(150))
    if not isinstance(found.outcome, Verified):
        return None
    took = time.monotonic() - began
    for name, content in found.outcome.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return took


def say(name: str, rows: list[Row], first: float | None) -> None:
    lost, beyond, anew = (sum(getattr(row, key) for row in rows) for key in ("lost", "beyond", "lost_anew"))
    kept, before, after = (sum(getattr(row, key) for row in rows) for key in ("kept_anew", "touched", "touched_anew"))
    took = [seconds for row in rows for seconds in row.seconds]
    ratio = f"{statistics.median(took) / first:.3f}" if took and first else ""
    saved = f"{1 - anew / lost:5.2f}" if lost else "    -"
    others = f"{kept / (lost - beyond):5.2f}" if lost > beyond else "    -"
    counts = f"{name:25} {len(rows):7} {lost:5} {beyond:6} {anew:5}"
    print(f"{counts} |      {saved}   {others} |  {before:2} → {after:2}  {ratio}", flush=True)


if __name__ == "__main__":
    main()
