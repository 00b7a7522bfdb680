"""Clearance of bodies from obstacles, and separation of agents, in continuous time over a plan.

The separation includes the extent of bodies and the downwash ellipsoid of vehicles.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias, assert_never

import numpy as np
from scipy.spatial import cKDTree

from missionc.base.trace import Array, Indices
from missionc.geometry.curves.piecewise_polynomials import Curves, extents, refined, speed_bounds, values
from missionc.geometry.required_separation import SpacingTable
from missionc.geometry.vectors import norm
from missionc.ir import PLAIN, Mission, Obstacle, Path, Still
from missionc.verification.certificate import CERTAIN, CONTACT, Check
from missionc.verification.plan.conservative_advancement import Least, least
from missionc.verification.plan.obstacle_bodies import Distance, solid

Extents: TypeAlias = tuple[Array, Array]

NEAREST = 16
"""Number of agents that are evaluated first to find the overall minimum."""


def check_obstacles(mission: Mission, curves: Curves, tolerance: float = CONTACT) -> list[Check]:
    """Checks of the clearance from each obstacle, by the agent nearest to it."""
    around = extents(curves)
    return [_check(mission, curves, around, obstacle, tolerance) for obstacle in mission.obstacles]


def relative_to(curves: Curves, obstacle: Obstacle) -> Curves:
    """The trajectories relative to a moving obstacle, in whose frame its shape is at rest."""
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
    """Displacement of a moving obstacle from its initial position.

    Shape: (moments,), seconds -> (moments, dim), metres.
    """
    return np.stack([np.interp(times, path.times, axis) for axis in np.array(path.offsets).T], axis=-1)


def state_margins(obstacle: Obstacle, distance: Distance, need: Array, times: Array, position: Array) -> Array:
    """Clearance of every agent from an obstacle at given times, minus the required clearance.

    Args:
        distance: distance to the obstacle's body, from ``solid``.
        need: (agents,), metres, from ``needs``.
        times: (moments,), seconds.
        position: (agents, moments, dim), metres.

    Returns:
        (agents, moments), metres.
    """
    seen = position - _offsets(obstacle.motion, times) if isinstance(obstacle.motion, Path) else position
    grown = np.array([obstacle.grown(time) for time in times.tolist()])
    return np.asarray(distance(seen) - need[:, None] - grown)


def needs(mission: Mission) -> Array:
    """Required distance of each agent's centre from any obstacle, its radius plus the clearance: (agents,), metres."""
    return np.array([agent.radius + mission.clearance for agent in mission.agents])


def margins(
    mission: Mission, curves: Curves, around: Extents, obstacle: Obstacle, gap: float, ceiling: float | None
) -> tuple[Curves, Least]:
    """Trajectories relative to the obstacle, and bounds on the clearance margin for every agent and piece.

    Shape: (agents * pieces,).

    Agents that are far away are evaluated by the bounding box of their trajectory.

    Args:
        around: corners of the bounding boxes of the trajectories.
        gap: maximum difference of the bounds, metres.
        ceiling: larger margins are not refined; with None, only the minimum margin of all is refined.
    """
    seen = relative_to(curves, obstacle)
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
        detail=f"every body has a clearance of {mission.clearance:g} m in continuous time",
    )


def check_separation(mission: Mission, curves: Curves, tolerance: float = CONTACT) -> list[Check]:
    """Check of the separation of the two nearest agents; empty for a single agent."""
    if len(mission.agents) < 2:
        return []
    lower = upper = np.inf
    pair, at = (0, 1), 0.0
    for piece, first, second in near_pairs(mission, curves, spare=None):
        low, high, when = pair_margins(mission, curves, piece, first, second, None)
        lower = min(lower, float(low.min()))
        best = int(high.argmin())
        if high[best] < upper:
            upper, pair = float(high[best]), (int(first[best]), int(second[best]))
            at = float(curves.times[piece] + when[best])
    slack = 0.0 if curves.coefficients.shape[-1] == 2 else CERTAIN
    passed = lower >= -tolerance - slack and upper >= -tolerance
    names = (mission.agents[pair[0]].name, mission.agents[pair[1]].name)
    detail = f"every pair of bodies has a separation of {mission.separation:g} m in continuous time"
    if any(agent.vehicle != PLAIN for agent in mission.agents):
        detail += ", or the distance that their vehicles require"
    return [Check("separation", "all pairs", lower, "m", tolerance + slack, passed, at, names, detail)]


def near_pairs(mission: Mission, curves: Curves, spare: float | None) -> Iterator[tuple[int, Indices, Indices]]:
    """For each piece, the pairs, (pairs,) twice, that may come within ``spare`` metres of their required separation.

    If ``spare`` is None, a set of pairs that includes the nearest pair of the piece.
    """
    spacing = SpacingTable.of(mission)
    widest, flattest = float(spacing.sideways.max()), min(1.0, float(spacing.flatness.min()))
    reach = speed_bounds(curves) * curves.durations / 2
    middles = values(curves.coefficients, np.broadcast_to(curves.durations / 2, reach.shape))
    for piece in range(reach.shape[1]):
        middle = middles[:, piece]
        tree = cKDTree(middle)
        if spare is None:
            # Some pair is no further apart than this, so no pair beyond it can be the nearest.
            one, other = np.arange(len(middle)), np.asarray(tree.query(middle, k=2)[1])[:, 1]
            between, metric = middle[one] - middle[other], spacing.metric(one, other)
            apart = norm(between if metric is None else between * metric) - spacing.between(one, other)
            within = (max(0.0, float(apart.min())) + widest) / flattest + 2 * float(reach[:, piece].max())
        else:
            within = (spare + widest) / flattest + 2 * float(reach[:, piece].max())
        pairs = tree.query_pairs(within * (1 + 1e-12), output_type="ndarray").astype(np.int64)
        if pairs.size:
            pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
            yield piece, pairs[:, 0], pairs[:, 1]


def pair_margins(
    mission: Mission, curves: Curves, piece: int, first: Indices, second: Indices, ceiling: float | None
) -> tuple[Array, Array, Array]:
    """Lower and upper bounds on the separation margins of pairs within a piece, and the time of the upper bound.

    Shape: (pairs,) each.

    Margins are horizontal metres: if the vertical separation is larger, altitudes have a smaller weight.

    Args:
        ceiling: larger margins are not refined; with None, only the minimum margin of all is refined.
    """
    spacing = SpacingTable.of(mission)
    metric = spacing.metric(first, second)
    relative = Curves(curves.times[piece : piece + 2], curves.coefficients[:, piece : piece + 1]).between(first, second)
    if metric is not None:
        relative = Curves(relative.times, relative.coefficients * metric[:, None, :, None])
    return relative_margins(relative, spacing.between(first, second), ceiling)


def relative_margins(relative: Curves, need: Array, ceiling: float | None) -> tuple[Array, Array, Array]:
    """Bounds on the separation margins of relative trajectories in each piece, and times of the upper bounds.

    Args:
        need: (pairs,), required separation, metres.
        ceiling: larger margins are not refined; with None, only the minimum margin of all is refined.

    Returns:
        Lower bounds and upper bounds, metres, and the times of the latter, seconds: (pairs * pieces,) each.
    """
    pairs, pieces, *shape = relative.coefficients.shape
    flat = relative.coefficients.reshape(pairs * pieces, *shape)
    needed, duration = np.repeat(need, pieces), np.tile(relative.durations, pairs)
    if flat.shape[-1] == 2:
        closest, when = _straight(flat, duration)
        return closest - needed, closest - needed, when

    def margin(item: Indices, local: Array) -> Array:
        return np.asarray(norm(values(flat[item], local)) - needed[item])

    bounds = least(margin, speed_bounds(relative).ravel(), duration, CERTAIN, ceiling)
    return bounds.lower, bounds.upper, bounds.at


def _straight(relative: Array, duration: Array) -> tuple[Array, Array]:
    """Minimum distance of agents in straight relative motion, and its time, in closed form.

    Shape: (pairs, dim, 2) -> (pairs,) twice, metres, seconds.
    """
    offset, velocity = relative[..., 0], relative[..., 1]
    square = (velocity**2).sum(axis=-1)
    toward = -(offset * velocity).sum(axis=-1)
    when = np.clip(np.divide(toward, square, out=np.zeros_like(square), where=square > 0), 0.0, duration)
    return norm(offset + velocity * when[:, None]), when
