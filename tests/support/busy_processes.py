"""A mission that keeps processes busy, and a list of the living ones."""

from __future__ import annotations

from pathlib import Path

HARD = """\
mission hard
time step 1 s, horizon 60 s
world (0, 0) to (10, 10)
region base = box (0.5, 0.5) to (4, 4)
region goal = box (6, 6) to (9.5, 9.5)
team drone[12] {
  radius   0.1 m
  dynamics single_integrator(speed <= 2 m/s)
  start    in base
}
graph radio = proximity 1.2 m
solve with smt { nodes = 300 }
require turns: every drone: always[0, 40 s] (eventually[0, 20 s] (goal and count[hops 1..1 on radio] goal >= 2))
require link:  always[0, end] connected(radio)
"""
"""Mission that takes far longer than this test waits."""


def children(process: int) -> list[int]:
    """Living processes that a process has started, directly or indirectly."""
    found = []
    for task in Path(f"/proc/{process}/task").glob("*"):
        for child in (task / "children").read_text().split():
            found += [int(child), *children(int(child))]
    return found


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
