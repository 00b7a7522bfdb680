"""The smallest complete missions, for tests about something else."""

from __future__ import annotations

SMALL = """\
mission small
time step 1 s, horizon 6 s
world (0, 0) to (4, 4)
region base = box (0.2, 0.2) to (1.8, 1.8)
region goal = box (2.2, 2.2) to (3.8, 3.8)
team drone[2] {
  radius   0.1 m
  dynamics single_integrator(speed <= 2 m/s)
  start    in base
}
solve with smt { nodes = 40 }
require visit: every drone: eventually[0, 6 s] goal
"""
"""Mission that is planned quickly."""

CONFLICT = (
    SMALL.replace("every drone: eventually[0, 6 s] goal", "drone[0]: eventually[0, 6 s] goal")
    + """\
graph radio = proximity 0.5 m
require guard: drone[1]: always[0, 6 s] base
require link: always[0, 6 s] connected(radio)
"""
)
"""Impossible mission: base and goal are further apart than the radio range."""

DASH = """\
mission dash
time step 1 s, horizon 5 s
world (0, 0) to (10, 4)
obstacle low = box (4, 0) to (6, 1.9)
obstacle high = box (4, 2.2) to (6, 4)
region goal = box (8.6, 0.5) to (9.9, 1.5)
team drone[1] { radius 0.1 m  dynamics single_integrator(speed <= 2 m/s)  start at (0.5, 2.05) }
require reach: drone[0]: eventually[5 s, 5 s] goal
solve with smt
"""
"""Possible mission without a plan on the tried roadmaps: its moves are shorter than their steps."""

WRONG = SMALL.replace("eventually[0, 6 s] goal", "eventually[0, 9 s] gaol")
"""Mission with one error, MC101."""

LATE = SMALL.replace("eventually[0, 6 s] goal", "eventually[0, 9 s] goal")
"""Mission with one error, MC301."""


def parked(steps: int = 6) -> str:
    """Trace of ``SMALL`` in CSV: both drones wait at base."""
    rows = [f"drone[{agent}],{step},{0.6 + 0.6 * agent},1" for agent in (0, 1) for step in range(steps + 1)]
    return "agent,t,x,y\n" + "\n".join(rows) + "\n"
