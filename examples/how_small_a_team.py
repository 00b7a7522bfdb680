"""The smallest team that can do a mission: the same file, one parameter, planned again and again.

python examples/how_small_a_team.py
"""

from __future__ import annotations

import missionc

MISSION = """
mission relay
param  N = 2
time   step 1 s, horizon 8 s
world  (0, 0) to (6, 2)
region base = box (0.2, 0.2) to (1.4, 1.8)
region site = box (4.6, 0.4) to (5.8, 1.6)
team drone[N] {
  radius   0.1 m
  dynamics single_integrator(speed <= 1.5 m/s)
  start    in base
}
graph radio = proximity 2 m
solve with smt { nodes = 60 }
require heard: eventually[0, 8 s] some drone: (site and true reach[hops 0..4 on radio] base)
"""


def main() -> int:
    for size in range(2, 7):
        source = missionc.Source("relay.mission", MISSION)
        compiled = missionc.compile(source, overrides={"N": str(size)}, time_limit=60)
        match compiled.outcome:
            case missionc.Verified(plan=plan):
                robustness = min(judgement.robustness for judgement in plan.judgements)
                print(f"{size} drones: planned, robustness {robustness:.2f} m")
                return 0
            case missionc.Impossible(conflict=names):
                print(f"{size} drones: impossible, because of {', '.join(names)}")
            case missionc.NotFound(reason=reason):
                print(f"{size} drones: {reason.value}")
            case missionc.InvalidMission() | missionc.Unverified():
                print(f"{size} drones: {', '.join(finding.message for finding in compiled.findings)}")
    return 1


if __name__ == "__main__":
    raise SystemExit(main())
