"""Flying on: what comes of a plan where all who are left fly their polynomials on, the slow ones behind their time.

in   Flying, the states seen, who is left, who is late and how fast
out  FlyOn: everybody's polynomials from then on, and the states at the steps that are left
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.curves.crazyflie_csv import Pieces, curves_of
from missionc.flight.behind import flown_late
from missionc.ir import Mission
from missionc.monitoring.read_flown import FlownSoFar
from missionc.pipeline.replan.cut_flights import between


@dataclass(frozen=True, slots=True, eq=False)
class FlyOn:
    """Everybody flies on.

    Args:
        pieces: of those that are left, from when they were seen last to the end of the plan.
        late: the indices among them of those who are behind their time.
        told: (agents, steps that are over): the states that a past has, everybody's.
        ahead: (agents that are left, steps that are left): the states from the last of those on.
    """

    pieces: list[Pieces]
    late: tuple[int, ...]
    told: Trace
    ahead: Trace


def fly_on(
    mission: Mission,
    plan: Trace,
    flights: Sequence[Pieces],
    so_far: FlownSoFar,
    left: Sequence[int],
    late: Mapping[int, float],
) -> FlyOn:
    """What everybody does who is left.

    Args:
        mission: that of the plan.
        flights: what each agent flies, the lost too.
        left: the indices of those that are left.
        late: by their indices, those who are behind on their way, and the most that they go, m/s.
    """
    until, end = so_far.until, float(flights[0].duration.sum())
    steps = so_far.trace.position.shape[1] - 1
    position, velocity, heading = (each[:, steps:].copy() for each in arrays(plan))
    pieces = []
    for agent in left:
        if agent not in late:
            pieces.append(between(flights[agent], until))
            continue
        own = flown_late(flights[agent], so_far.last[agent], until, late[agent], end - until)
        pieces.append(own)
        times = mission.step * np.arange(steps + 1, steps + position.shape[1]) - until
        position[agent, 0] = so_far.trace.position[agent, -1]
        position[agent, 1:] = curves_of([own], slice(mission.dimension)).at(times)[0]
        velocity[agent, :-1] = np.diff(position[agent], axis=0) / mission.step
        velocity[agent, -1] = 0.0
        ways = velocity[agent, :-1]
        moves = np.linalg.norm(ways, axis=-1) > 0
        heading[agent, :-1][moves] = np.arctan2(ways[moves, 1], ways[moves, 0])
        heading[agent, -1] = heading[agent, -2]
    told = [
        np.concatenate([old[:, :-1], new[:, :1]], axis=1)
        for old, new in zip(arrays(so_far.trace), (position, velocity, heading), strict=True)
    ]
    ahead = Trace(plan.step, position, velocity, heading).part(left, 0, position.shape[1] - 1)
    return FlyOn(
        pieces,
        tuple(number for number, agent in enumerate(left) if agent in late),
        Trace(plan.step, *told),
        ahead,
    )


def arrays(trace: Trace) -> tuple[Array, Array, Array]:
    """Its positions, velocities and headings."""
    return trace.position, trace.velocity, trace.heading
