"""Benchmark of larger teams than in [strel]: 30 drones with relays, 100 in a radio network, robots with inertia.

    python bench/large_teams.py [--solver z3|cadical|race] [--limit SECONDS]

Prints the time of each with ``smt``, from the start of ``lower`` to a verified plan, including collisions, and the peak
memory of the solver and of the compiler.
"""

from __future__ import annotations

import argparse
import resource

import missionc
from missionc.backends.api import Impossible, NotFound
from missionc.backends.options import Options
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler.results import Verified

RELAYS = """
mission relays
time   step 1 s, horizon 20 s
world  (0, 0) to (16, 16)
region base  = box (0.5, 0.5) to (5.5, 5.5)
region field = box (7, 7) to (10, 10)
obstacle shelf  = box (2, 8) to (3, 12)
obstacle pillar = box (11, 4) to (12, 7)
team drone[30] { radius 0.1 m  dynamics unicycle(speed 0..2 m/s)  start in base }
graph radio = proximity 2 m
require relay: every drone: always[0, 20 s] (drone reach[hops 0..3 on radio] base)
require visit: some drone: eventually[0, 20 s] field
solve with smt { nodes = 330 }
"""
"""N = 30, T = 20, 330 nodes: a relay for every drone."""

NETWORK = """
mission network
time   step 1 s, horizon 30 s
world  (0, 0) to (16, 16)
region base = box (0.5, 0.5) to (8, 8)
region post = box (5, 5) to (11, 11)
obstacle shelf = box (2, 10) to (3, 14)
team drone[100] { radius 0.1 m  dynamics unicycle(speed 0..2 m/s)  start in base }
graph radio = proximity 2 m
require network: every drone: always[0, 30 s] (drone reach[hops 0..8 on radio] base)
require visits:  every drone: eventually[0, 30 s] post
solve with smt { nodes = 500 }
"""
"""N = 100, T = 30, 500 nodes: every drone visits one region, and always has a radio route to the base."""

MIXED = """
mission mixed
time   step 1 s, horizon 15 s
world  (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (4, 4)
region goal = box (6, 6) to (9, 9)
obstacle tower = box (4.6, 4.6) to (5.4, 5.4)
team heavy[3] { radius 0.1 m  dynamics double_integrator(speed <= 2 m/s, acceleration <= 1 m/s^2)  start in base }
team car[2]   { radius 0.1 m  dynamics unicycle(speed 0..2 m/s, turn <= 60 deg/s)  start in base }
graph radio = proximity 3 m
require visit: some heavy: eventually[0, 15 s] goal
require link:  always[0, 15 s] connected(radio)
"""
"""N = 5, T = 15: bounded acceleration, bounded turning, and all connected throughout."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solver", default="z3", choices=["z3", "cadical", "race"])
    parser.add_argument("--limit", type=float, default=1800.0, help="time limit of each mission in seconds")
    parser.add_argument("--memory", type=int, default=16, help="memory limit of the solver in gigabytes")
    parser.add_argument("--only", choices=["relays", "network", "mixed"])
    arguments = parser.parse_args()
    for name, text in (("relays", RELAYS), ("network", NETWORK), ("mixed", MIXED)):
        if arguments.only not in (None, name):
            continue
        compiled = missionc.compile(
            Source(f"{name}.mission", text),
            time_limit=Seconds(arguments.limit),
            memory_limit=arguments.memory << 30,
            backend="smt",
            options=Options(solver=arguments.solver),
        )
        outcome = compiled.outcome
        stages = dict(compiled.seconds)
        if isinstance(outcome, Impossible | NotFound):
            print(f"{name}: {type(outcome).__name__}: {outcome.statement}")
        elif isinstance(outcome, Verified):
            sizes = dict(outcome.report.sizes)
            total = sum(took for stage, took in outcome.report.seconds if stage != "roadmap") + stages["verify"]
            print(f"{name}: verified, {total:.1f} s from encoding to verification")
            print(f"  {sizes['clauses']} clauses, {sizes['states']} states, {sizes['rounds']} rounds")
            print(f"  solver {sizes['solver bytes'] / 2**20:.0f} MB")
        else:
            print(f"{name}: {type(outcome).__name__}: {[finding.message for finding in compiled.findings]}")
        print("  " + ", ".join(f"{stage} {took:.2f} s" for stage, took in stages.items()), flush=True)
    print(f"peak memory of the compiler: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
