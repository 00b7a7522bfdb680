"""Tracks of a flight in a closed loop on the report's grid, beside the plan that it was to fly at first.

in   Mission, LoopFlights
out  Simulated, and where everybody was told to be

Who is lost keeps apart from nobody any more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.output.report.sample_tracks import Placed
from missionc.output.report.simulated_tracks import Simulated, fewer, straight
from missionc.verification.certificate import Check


@dataclass(frozen=True, slots=True, eq=False)
class LoopFlights:
    """Flights in a closed loop, of which the first one is drawn.

    Args:
        record: what became of them all, as a value that JSON can hold.
        headline: the verdict on them: ``holds``, ``steps`` or ``fails``, and in words.
        times: (samples,), s, of the first flight; position: (agents, samples, 3), m.
        heard: (moments,), s; told: (agents, moments, 3), m: where everybody was to be then, by what was uploaded.
        allowed: (agents,), m: how far each may be from where it was told to be.
        worlds: the mission as it reads from a time on, s, the first from 0 on.
        lost: by the names of those whose motors stopped, when, s.
        nearest: where bodies came nearest.
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
    """The first flight, and what it was told to be, ``rate`` samples to a step."""
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
