"""Clearance of every body to every obstacle, at every moment."""

from __future__ import annotations

from typing import TypeAlias, assert_never

import numpy as np

from missionc.base.trace import Array
from missionc.curves.piecewise_polynomials import Curves, Indices, extents, refined, speed_bounds, values
from missionc.ir import Mission, Obstacle, Path, Still
from missionc.verify.certificate import Check
from missionc.verify.plan.conservative_advancement import Least, least
from missionc.verify.plan.obstacle_bodies import Distance, solid
from missionc.verify.tolerances import CERTAIN, CONTACT
from missionc.world.vectors import norm

Extents: TypeAlias = tuple[Array, Array]

NEAREST = 16
"""Agents that are looked at first, for the least of all."""


def check_obstacles(mission: Mission, curves: Curves, tolerance: float = CONTACT) -> list[Check]:
    """One check for each obstacle, for the agent that comes nearest."""
    around = extents(curves)
    return [_check(mission, curves, around, obstacle, tolerance) for obstacle in mission.obstacles]


def seen_from(curves: Curves, obstacle: Obstacle) -> Curves:
    """The motion as the obstacle sees it: with its shape at rest."""
    match obstacle.motion:
        case Still():
            return curves
        case Path(times):
            finer = refined(curves, np.array(times))
            at = _offsets(obstacle.motion, finer.times)
            coefficients = finer.coefficients.copy()
            coefficients[..., 0] -= at[:-1]
            coefficients[..., 1] -= np.diff(at, axis=0) / finer.durations[:, None]
            return Curves(finer.times, coefficients)
        case _:
            assert_never(obstacle.motion)


def _offsets(path: Path, times: Array) -> Array:
    """Offset of a moving obstacle from its place in the text: (moments,), seconds -> (moments, dim), metres."""
    return np.stack([np.interp(times, path.times, axis) for axis in np.array(path.offsets).T], axis=-1)


def state_margins(obstacle: Obstacle, distance: Distance, need: Array, times: Array, position: Array) -> Array:
    """The clearance margin of every agent at some moments.

    Args:
        distance: to the obstacle's body, as ``solid`` makes it.
        need: (agents,), metres, as of ``needs``.
        times: (moments,), seconds.
        position: (agents, moments, dim), metres.

    Returns:
        (agents, moments), metres.
    """
    seen = position - _offsets(obstacle.motion, times) if isinstance(obstacle.motion, Path) else position
    grown = np.array([obstacle.grown(time) for time in times.tolist()])
    return np.asarray(distance(seen) - need[:, None] - grown)


def needs(mission: Mission) -> Array:
    """The distance from each agent's centre to any obstacle, at least: (agents,), metres."""
    return np.array([agent.radius + mission.clearance for agent in mission.agents])


def margins(
    mission: Mission, curves: Curves, around: Extents, obstacle: Obstacle, gap: float, ceiling: float | None
) -> tuple[Curves, Least]:
    """The motion as the obstacle sees it, and bounds on every agent's margin in every piece: (agents * pieces,).

    Who is further away than matters is judged by the box around its whole motion.

    Args:
        around: the corners of the boxes around the motions.
        ceiling: margins above it are of no interest; absent: only the least of all is.
    """
    seen = seen_from(curves, obstacle)
    low, high = around if seen is curves else extents(seen)
    agents, pieces, *shape = seen.coefficients.shape
    distance = solid(obstacle.shape, mission.dimension)
    need = needs(mission)
    largest = obstacle.grown(float(seen.times[-1]))
    far = np.asarray(distance((low + high) / 2) - norm(high - low) / 2 - need - largest)
    lower, upper, at = np.repeat(far, pieces), np.full(agents * pieces, np.inf), np.zeros(agents * pieces)

    def look(chosen: Indices, ceiling: float | None) -> None:
        item = (chosen[:, None] * pieces + np.arange(pieces)).ravel()
        motions = Curves(seen.times, seen.coefficients[chosen])
        flat, needed = motions.coefficients.reshape(item.size, *shape), np.repeat(need[chosen], pieces)

        def margin(motion: Indices, local: Array) -> Array:
            grown = obstacle.growth * (begun[motion] + local + obstacle.age)
            return np.asarray(distance(values(flat[motion], local)) - needed[motion] - grown)

        begun = np.tile(seen.times[:-1], chosen.size)
        duration = np.tile(seen.durations, chosen.size)
        fastest = speed_bounds(motions).ravel() + obstacle.growth
        bounds = least(margin, fastest, duration, gap, ceiling)
        lower[item], upper[item], at[item] = bounds.lower, bounds.upper, bounds.at

    if ceiling is None:
        nearest = np.sort(np.argsort(far, kind="stable")[:NEAREST])
        look(nearest, None)
        ceiling = float(upper.min())
        far[nearest] = np.inf
    near = np.flatnonzero(~(far >= ceiling))
    if near.size:
        look(near, ceiling)
    return seen, Least(lower, upper, at)


def _check(mission: Mission, curves: Curves, around: Extents, obstacle: Obstacle, tolerance: float) -> Check:
    seen, bounds = margins(mission, curves, around, obstacle, CERTAIN, None)
    pieces = seen.times.size - 1
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
