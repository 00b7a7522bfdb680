"""Disturbed flights in a closed loop: what is kept of their requirements without planning anew, and with it.

    python bench/closed_loop.py [--flights 25] [--within 3] [--clock SECONDS]

Four missions are compiled once and flown so often each through scenarios that are drawn at random (a lost drone, a slow
one, an obstacle that appears, wind, noise, dropouts, late packets, skewed clocks), every scenario twice: watched, and
planned anew. Printed are the requirements that were kept in either case, the share of what was lost that is kept with
replanning, the flights in which bodies touched, and how long planning anew took beside the first plan.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path

import numpy as np

from missionc.base.limits import Limits
from missionc.base.trace import Trace
from missionc.base.units import Seconds
from missionc.closed_loop.fly_loop import LoopFlight, fly_loop
from missionc.closed_loop.scenario import Event, Scenario
from missionc.ir import Mission
from missionc.output.folder.file_names import flights_in
from missionc.pipeline.driver import compile
from missionc.pipeline.replan.request import Flying
from missionc.pipeline.results import Verified

ROOT = Path(__file__).resolve().parent.parent
MISSIONS = (
    "missions/wildfire_flight.mission",
    "missions/crazyflie_corridor_flight.mission",
    "missions/gallery/museum_guard.mission",
    "missions/gallery/laser_links.mission",
)
VEHICLE = "crazyflie21"
EVADED = 1.0
"""Metres from everybody at which an obstacle appears at least: what appears nearer hits whoever flies at 1 m/s."""


def drawn(mission: Mission, plan: Trace, random: np.random.Generator) -> Scenario:
    """A scenario with one event, some time after the beginning and before the last third of the mission."""
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


def lost(flight: LoopFlight) -> int:
    return sum(not kept for kept in flight.outcome.requirements.values())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--flights", type=int, default=25)
    parser.add_argument("--within", type=float, default=3.0)
    parser.add_argument("--clock", type=float, default=None)
    arguments = parser.parse_args()
    print("mission                      flights lost without  with  saved  touched replan/first")
    totals = np.zeros(4, dtype=int)
    for number, file in enumerate(MISSIONS):
        began = time.monotonic()
        compiled = compile(ROOT / file, vehicle="" if "flight" in file else VEHICLE, time_limit=Seconds(120))
        first = time.monotonic() - began
        if not isinstance(compiled.outcome, Verified) or compiled.checked.mission is None:
            print(f"{Path(file).stem:28} no plan: {[each.message for each in compiled.findings][:1]}")
            continue
        mission = compiled.checked.mission
        files = dict(compiled.outcome.files)
        flying = Flying(compiled.checked, compiled.outcome.plan.trace, flights_in(mission.agents, files))
        counts, took = np.zeros(4, dtype=int), []
        for flight in range(arguments.flights):
            random = np.random.default_rng([number, flight])
            scenario = drawn(mission, flying.trace, random)
            clock = None if arguments.clock is None else Seconds(arguments.clock)
            settings = (flying, scenario, flight, Seconds(arguments.within), Limits())
            alone = fly_loop(*settings, replans=False)
            anew = fly_loop(*settings, clock=clock)
            took += [each.seconds for each in anew.happened if each.seconds]
            counts += [lost(alone), lost(anew), not alone.outcome.untouched, not anew.outcome.untouched]
        ratio = statistics.median(took) / first if took else float("nan")
        saved = 1 - counts[1] / counts[0] if counts[0] else float("nan")
        print(
            f"{Path(file).stem:28} {arguments.flights:7} {counts[0]:12} {counts[1]:5} {saved:6.2f} "
            f"{counts[2]:3} → {counts[3]:2} {ratio:12.3f}",
            flush=True,
        )
        totals += counts
    saved = 1 - totals[1] / totals[0] if totals[0] else float("nan")
    print(f"{'all':28} {'':7} {totals[0]:12} {totals[1]:5} {saved:6.2f} {totals[2]:3} → {totals[3]:2}")


if __name__ == "__main__":
    main()
