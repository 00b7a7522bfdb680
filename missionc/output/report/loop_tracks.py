"""Trajectories of a flight in a closed loop on the report's grid, with its initial plan.

in   Mission, LoopFlights
out  Simulated, and the commanded positions

Lost agents need no separation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.output.report.sample_tracks import Placed
from missionc.output.report.simulated_tracks import Simulated, fewer, straight
from missionc.verification.certificate import Check


class LoopFlights(Record, eq=False):
    """Results of flights in a closed loop, and the trajectory of the first flight.

    Args:
        record: results of all flights, as a value for JSON.
        headline: their verdict: ``holds``, ``steps`` or ``fails``, and in words.
        times: (samples,), s, of the first flight; position: (agents, samples, 3), m.
        heard: (moments,), s; told: (agents, moments, 3), m: positions commanded by the uploads.
        allowed: (agents,), m: maximum distance of each from its commanded position.
        worlds: the mission from a time on, s, the first from 0 on.
        lost: time of the motor stop by agent name, s.
        nearest: check of the smallest distance between bodies.
    """

    record: Mapping[str, Any]
    headline: tuple[str, str]
    times: Array
    position: Array
    heard: Array
    told: Array
    allowed: Array
    worlds: tuple[tuple[float, Mission], ...]
    lost: Mapping[str, float]
    nearest: Check | None


def loop_tracks(mission: Mission, loop: LoopFlights, rate: int) -> tuple[Simulated, Placed]:
    """Trajectories of the first flight and of its commands, with ``rate`` samples per step."""
    grid = np.asarray(np.arange(rate * mission.steps + 1) * (mission.step / rate), dtype=np.float64)
    gone = np.array([loop.lost.get(agent.name, np.inf) for agent in mission.agents])
    there = grid < gone[:, None]
    level = slice(mission.dimension)
    flown, told = (
        Placed(rate, grid, straight(grid, times, places)[..., level], there=there)
        for times, places in ((loop.times, loop.position), (loop.heard, loop.told))
    )
    error = np.linalg.norm(straight(loop.heard, loop.times, loop.position) - loop.told, axis=-1)
    error[loop.heard >= gone[:, None]] = 0.0
    checks = () if loop.nearest is None else (_shown(loop.nearest),)
    return Simulated("fly", flown, fewer(error), loop.allowed, checks), told


def _shown(check: Check) -> Check:
    name = "simulated separation" if check.name == "separation" else "simulated obstacle"
    return replace(check, name=name, detail="smallest distance between bodies in the first flight")
