"""Clearance of every body to every obstacle, at every moment."""

from __future__ import annotations

from typing import assert_never

import numpy as np

from missionc.base.trace import Array
from missionc.curves.piecewise_polynomials import Curves, Indices, refined, speed_bounds, values
from missionc.ir import Mission, Obstacle, Path, Still
from missionc.verify.certificate import Check
from missionc.verify.plan.conservative_advancement import Least, least
from missionc.verify.plan.obstacle_bodies import solid
from missionc.verify.tolerances import CERTAIN, CONTACT


def check_obstacles(mission: Mission, curves: Curves, tolerance: float = CONTACT) -> list[Check]:
    """One check for each obstacle, for the agent that comes nearest."""
    return [_check(mission, curves, obstacle, tolerance) for obstacle in mission.obstacles]


def seen_from(curves: Curves, obstacle: Obstacle) -> Curves:
    """The motion as the obstacle sees it: with its shape at rest."""
    match obstacle.motion:
        case Still():
            return curves
        case Path(times, offsets):
            finer = refined(curves, np.array(times))
            knots = np.array(offsets)
            at = np.stack([np.interp(finer.times, times, knots[:, axis]) for axis in range(knots.shape[1])], axis=-1)
            coefficients = finer.coefficients.copy()
            coefficients[..., 0] -= at[:-1]
            coefficients[..., 1] -= np.diff(at, axis=0) / finer.durations[:, None]
            return Curves(finer.times, coefficients)
        case _:
            assert_never(obstacle.motion)


def margins(mission: Mission, seen: Curves, obstacle: Obstacle, gap: float, ceiling: float | None) -> Least:
    """Bounds on every agent's margin in every piece of its motion as the obstacle sees it: (agents * pieces,)."""
    agents, pieces, _, size = seen.coefficients.shape
    flat = seen.coefficients.reshape(agents * pieces, -1, size)
    need = np.repeat([agent.radius + mission.clearance for agent in mission.agents], pieces)
    distance = solid(obstacle.shape, mission.dimension)

    def margin(item: Indices, local: Array) -> Array:
        return np.asarray(distance(values(flat[item], local)) - need[item])

    return least(margin, speed_bounds(seen).ravel(), np.tile(seen.durations, agents), gap, ceiling)


def _check(mission: Mission, curves: Curves, obstacle: Obstacle, tolerance: float) -> Check:
    seen = seen_from(curves, obstacle)
    pieces = seen.times.size - 1
    bounds = margins(mission, seen, obstacle, CERTAIN, None)
    item = int(bounds.upper.argmin())
    lower, upper = float(bounds.lower.min()), float(bounds.upper[item])
    return Check(
        name="obstacle",
        subject=obstacle.name,
        margin=lower,
        unit="m",
        tolerance=tolerance + CERTAIN,
        # A witness below the tolerance refutes; between witnesses the proof may be short by `CERTAIN`.
        passed=lower >= -tolerance - CERTAIN and upper >= -tolerance,
        at=float(seen.times[item % pieces] + bounds.at[item]),
        agents=(mission.agents[item // pieces].name,),
        detail=f"every body stays {mission.clearance:g} m clear of it throughout",
    )
