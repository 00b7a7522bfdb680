"""Claims about all flights at every moment: the world, obstacles, each other, and each other's downwash.

A distance has two needs. *Asked* is what the mission wants between bodies.
*Needed* is what nobody goes below: what bodies take, or the pair distance of
their vehicles, with what a vehicle may miss its trajectory by, and with what
it is off where others start before it or after it.
"""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.curves.bernstein_intervals import Enclosed, lowered, raised
from missionc.curves.piecewise_polynomials import Indices
from missionc.ir import Mission, Obstacle
from missionc.verify.flight.body_clearance import box_clear_of, clear_of, clear_of_growing
from missionc.verify.flight.flight_curves import Flight, extent, growing, seen_from
from missionc.verify.proof.claims import Claim, everyone, of_agents
from missionc.verify.proof.interval_margins import at_least, between, far_from_origin
from missionc.verify.tolerances import CERTAIN, ROUNDING


def world(mission: Mission, flight: Flight) -> Claim:
    """Every centre is in the world, a vehicle's as far in as its fence inset and its tracking margin say."""
    inset = np.array([agent.vehicle.fence_inset + agent.vehicle.tracking for agent in mission.agents])
    inset = (inset[:, None] + flight.off).reshape(-1, 1)
    low = np.where(inset > 0, raised(np.array(mission.world.low) + inset), mission.world.low)
    high = np.where(inset > 0, lowered(np.array(mission.world.high) - inset), mission.world.high)
    detail = "every centre is inside it throughout"
    if inset.any():
        detail += ", by the fence inset and the tracking margin of its vehicle"
    judge = between(low, high)
    level = flight.position[:, :, : mission.dimension]
    curve = of_agents(level)
    return Claim(
        "flown world",
        "world",
        "m",
        ROUNDING,
        detail,
        everyone(len(mission.agents)),
        flight.times,
        curve,
        judge,
        CERTAIN,
    )


def obstacles(mission: Mission, flight: Flight, strict: bool) -> list[Claim]:
    """One for each obstacle: every body keeps its clearance, or only what it needs."""
    return [_obstacle(mission, flight, obstacle, strict) for obstacle in mission.obstacles]


def _obstacle(mission: Mission, flight: Flight, obstacle: Obstacle, strict: bool) -> Claim:
    times, seen = seen_from(mission, flight, obstacle)
    room = np.array([agent.radius + agent.vehicle.tracking for agent in mission.agents])
    piece = np.clip(np.searchsorted(flight.times, times[:-1], side="right") - 1, 0, flight.durations.size - 1)
    need = raised(room[:, None] + flight.off[piece])
    if not obstacle.constant:
        need = raised(need + flight.drift(_skews(mission))[:, piece])
    detail = "no bodies touch throughout"
    if strict:
        wanted = np.array([agent.radius + mission.clearance for agent in mission.agents])
        need = np.maximum(need, wanted[:, None])
        detail = f"every body stays {mission.clearance:g} m clear of it throughout"
    judge = clear_of(obstacle.shape, mission.dimension, need.ravel())
    low, high = (corner[:, : mission.dimension] for corner in flight.extent) if obstacle.constant else extent(seen)
    if obstacle.growth:
        seen = growing(seen, times, obstacle)
        judge = clear_of_growing(judge)
        need = need + seen.high()[..., -1]
    most, of_box = need.max(axis=1), box_clear_of(obstacle.shape, mission.dimension)

    def far(agent: Indices) -> Array:
        return of_box(low[agent], high[agent], most[agent])

    agents, curve = everyone(len(mission.agents)), of_agents(seen)
    return Claim("flown obstacle", obstacle.name, "m", ROUNDING, detail, agents, times, curve, judge, CERTAIN, far)


def separation(mission: Mission, flight: Flight, strict: bool) -> list[Claim]:
    """Every two bodies keep the separation, or only what they need; none where there are not two."""
    pairs = _pairs(mission)
    if not len(pairs):
        return []
    radius = np.array([agent.radius for agent in mission.agents])
    distance = np.array([agent.vehicle.pair_distance for agent in mission.agents])
    bodies = radius[pairs].sum(axis=1)
    apart = np.maximum(bodies, distance[pairs].max(axis=1))
    need = raised(apart[:, None] + _missed(mission, flight, pairs))
    detail = "no bodies touch throughout"
    if strict:
        need = np.maximum(need, (bodies + mission.separation)[:, None])
        detail = f"every two bodies stay {mission.separation:g} m apart throughout"
    level = flight.position[:, :, : mission.dimension]
    return [_of_pairs("separation", "m", detail, pairs, flight, level, need)]


def downwash(mission: Mission, flight: Flight) -> list[Claim]:
    """No vehicle is in another's downwash: the difference of their centres over its half axes is at least 1 long.

    The ellipsoid is grown by what both may miss. Every ``p > 0`` gives an ellipsoid that holds the sum of another one
    and of a ball, with the squared half axes ``(1 + 1 / p) * axis**2 + (1 + p) * radius**2``; here ``p`` is such that
    sideways it is exactly the sum.

    Source:
        Kurzhanski, Vályi, "Ellipsoidal Calculus for Estimation and Control" (1997), section 2.1.
    """
    sideways = np.array([agent.vehicle.downwash_radius for agent in mission.agents])
    height = np.array([agent.vehicle.downwash_height for agent in mission.agents])
    pairs = _pairs(mission)
    pairs = pairs[(sideways[pairs].sum(axis=1) > 0) & (height[pairs].sum(axis=1) > 0)]
    if not len(pairs):
        return []
    missed = _missed(mission, flight, pairs)
    wide, high = sideways[pairs].sum(axis=1)[:, None], height[pairs].sum(axis=1)[:, None]
    share = missed / wide
    tall = np.sqrt(raised(high**2 * (1 + share) + missed**2 + missed * wide))
    axes = np.stack([raised(wide + missed)] * 2 + [raised(raised(tall))], axis=-1)
    # Dividing is multiplying by an inverse that is not too large: rounding makes vehicles nearer, not farther.
    shrink = lowered(lowered(1.0 / raised(axes)))
    detail = "no vehicle is in the downwash of another throughout"
    return [_of_pairs("downwash", "", detail, pairs, flight, flight.position, np.ones((len(pairs), 1)), shrink)]


def _of_pairs(
    name: str,
    unit: str,
    detail: str,
    pairs: Indices,
    flight: Flight,
    curves: Enclosed,
    need: Array,
    scale: Array | None = None,
) -> Claim:
    """``need``, (pairs, 1 or pieces); the difference of both is multiplied by ``scale``, (pairs, 1 or pieces, dim)."""
    pieces, size = flight.durations.size, curves.points.shape[2]
    factor = None if scale is None else np.broadcast_to(scale, (len(pairs), pieces, size))
    low, high = (corner[:, :size] for corner in flight.extent)
    most = need.max(axis=1)

    def curve(item: Indices) -> Enclosed:
        pair, piece = np.divmod(item, pieces)
        between = curves[pairs[pair, 0], piece] - curves[pairs[pair, 1], piece]
        return between if factor is None else between.scaled(factor[pair, piece])

    def far(pair: Indices) -> Array:
        first, second = pairs[pair].T
        least, greatest = lowered(low[first] - high[second]), raised(high[first] - low[second])
        if scale is not None:  # the smallest factor makes the vector shortest
            shortest = scale.min(axis=1)[pair]
            least, greatest = lowered(least * shortest), raised(greatest * shortest)
        return far_from_origin(least, greatest, most[pair])

    judge, times = at_least(need.ravel(), pieces // need.shape[1]), flight.times
    return Claim(f"flown {name}", "all pairs", unit, ROUNDING, detail, pairs, times, curve, judge, CERTAIN, far)


def _pairs(mission: Mission) -> Indices:
    """(pairs, 2)."""
    return np.stack(np.triu_indices(len(mission.agents), k=1), axis=-1).astype(np.int64)


def _skews(mission: Mission) -> Array:
    return np.array([agent.vehicle.start_skew for agent in mission.agents])


def _missed(mission: Mission, flight: Flight, pairs: Indices) -> Array:
    """(pairs, pieces), metres: by how much two vehicles may be nearer than their trajectories are; (pairs, 1) where
    nobody misses its own."""
    tracking = np.array([agent.vehicle.tracking for agent in mission.agents])
    if not (tracking.any() or _skews(mission).any() or flight.off.any()):
        return np.zeros((len(pairs), 1))
    off = raised(tracking[:, None] + flight.off + flight.drift(_skews(mission)))
    return raised(off[pairs[:, 0]] + off[pairs[:, 1]])
