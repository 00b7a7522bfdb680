"""Claims about all trajectories in continuous time: the world, clearance of bodies, separation and downwash.

A distance has two values. *Asked* is the distance between bodies that the mission requires. *Needed* is the minimum
safe distance: the extent of the bodies, or the pair distance of their vehicles, with tracking error and start skew.

The lower bound on the distance of a part of a curve from a body is the better of two. The first is the distance at the
middle of the curve minus the maximum distance of a control point from the middle. The second is the distance of the
control points from a plane with the body behind it, which is exact along a straight wall for parts of any length.

Trajectories of all agents as polynomials, with bounds on positions and speeds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import isfinite, sqrt
from typing import assert_never

import numpy as np

from missionc.base.trace import Array, Indices
from missionc.geometry.curves.bernstein_intervals import (
    GROWN,
    Enclosed,
    derivative,
    from_powers,
    lowered,
    raised,
    root_above,
)
from missionc.ir import (
    Ball,
    Box,
    Difference,
    Disc,
    Intersection,
    Mission,
    Obstacle,
    Path,
    Polygon,
    Prism,
    Shape,
    Still,
    Union,
)
from missionc.verification.certificate import CERTAIN, ROUNDING
from missionc.verification.plan.obstacle_bodies import solid
from missionc.verification.proof.branch_and_bound import Bounds, Claim, Judge, everyone, of_agents
from missionc.verification.proof.proof_boxes import at_least_in_box, between_bounds, far_from_origin

HALVINGS = 3
"""Number of halvings of a piece before its control points bound the speed."""

ALLOWANCE = 2.0**-40
"""Relative error bound for the arithmetic on shapes and trajectories; more than a thousand roundings."""


@dataclass(frozen=True, eq=False)
class Flight:
    """Polynomial trajectories of all agents, with common joints.

    Args:
        durations: (pieces,), seconds; float32 values.
        coefficients: (agents, pieces, 4, 8) of x, y, z and yaw; float32 values.
        astray: (pieces,), metres: additional deviation of every agent, besides tracking error and start skew; 0 if left
            out.
    """

    durations: Array
    coefficients: Array
    astray: Array | None = None

    @cached_property
    def times(self) -> Array:
        """Times of the joints: (pieces + 1,), seconds."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    @cached_property
    def position(self) -> Enclosed:
        """Enclosures of the positions: (agents, pieces, 3), metres."""
        return self.derived(0)

    def derived(self, order: int, axes: tuple[int, ...] = (0, 1, 2)) -> Enclosed:
        """Enclosures of a time derivative along some axes: (agents, pieces, axes).

        Args:
            order: 0 for the position, 1 for the velocity, and so on.
        """
        own = self.coefficients[:, :, list(axes)]
        for _ in range(order):
            own = derivative(own)
        return from_powers(own, self.durations[:, None])

    @cached_property
    def extent(self) -> tuple[Array, Array]:
        """Lower and upper corner of the bounding box of each agent's trajectory: (agents, 3) twice, metres."""
        return extent(self.position)

    @cached_property
    def speed(self) -> Array:
        """Upper bounds on the speed within each piece: (agents, pieces), m/s."""
        parts = [self.derived(1)]
        for _ in range(HALVINGS):
            parts = [half for part in parts for half in part.halves()]
        return np.asarray(np.max([root_above(part.squares().high()) for part in parts], axis=0))

    def drift(self, skew: Array) -> Array:
        """Upper bound on the position deviation of each agent that starts up to ``skew`` late or early.

        Shape: (agents, pieces), metres.

        Args:
            skew: (agents,), seconds.
        """
        begin, end = self.times[:-1], self.times[1:]
        off = np.zeros_like(self.speed)
        for agent in np.flatnonzero(skew > 0).tolist():
            reach = skew[agent] * (1 + ALLOWANCE)
            # (pieces, pieces): the second is flown at a time of the first.
            meets = (begin[None] <= end[:, None] + reach) & (end[None] >= begin[:, None] - reach)
            crossed = (self.times[1:-1] <= end[:, None] + reach) & (self.times[1:-1] >= begin[:, None] - reach)
            jumps = np.where(crossed, self.jumps[agent], 0.0).sum(axis=1)
            off[agent] = (np.where(meets, self.speed[agent], 0.0).max(axis=1) * reach + jumps) * GROWN
        return off

    @property
    def off(self) -> Array:
        """Additional deviation of every agent, or zeros if none is given: (pieces,), metres."""
        return np.zeros(self.durations.size) if self.astray is None else self.astray

    @cached_property
    def jumps(self) -> Array:
        """Upper bounds on the gap between consecutive pieces: (agents, pieces - 1), metres."""
        before, after = self.position[:, :-1], self.position[:, 1:]
        apart = np.abs(after.points[..., 0] - before.points[..., -1]) + before.radius + after.radius
        return np.asarray(np.linalg.norm(apart, axis=-1) * GROWN)


def seen_from(mission: Mission, flight: Flight, obstacle: Obstacle) -> tuple[Array, Enclosed]:
    """Trajectories relative to an obstacle: joints in seconds, and enclosures (agents, parts, dim), metres.

    Pieces are also split where the obstacle turns. The error radius includes the rounding of the obstacle's motion.
    """
    level = flight.position[:, :, : mission.dimension]
    match obstacle.motion:
        case Still():
            return flight.times, level
        case Path(times, offsets):
            knots = np.array(times)
            joints = np.union1d(flight.times, knots[(knots > flight.times[0]) & (knots < flight.times[-1])])
            parts = cut(level, flight.times, joints)
            ends = np.stack([np.interp(joints, knots, axis) for axis in np.array(offsets).T], axis=-1)
            moves = np.abs(np.diff(np.array(offsets), axis=0)).max(axis=-1, initial=0.0) / np.diff(knots)
            wide = 1 + np.abs(offsets).max() + float(moves.max(initial=0.0)) * (1 + flight.times[-1])
            linear = Enclosed(
                np.stack([ends[:-1], ends[1:]], axis=-1), np.full(ends[1:].shape, ALLOWANCE * wide)
            ).elevated(level.degree)
            return joints, parts - linear


def growing(seen: Enclosed, times: Array, obstacle: Obstacle) -> Enclosed:
    """Trajectories relative to an obstacle, with the obstacle's growth in metres as an additional coordinate.

    Args:
        seen: (agents, parts, dim).
        times: (parts + 1,), seconds.

    Returns:
        (agents, parts, dim + 1). The radius includes the rounding of the growth.
    """
    grown = obstacle.growth * (times + obstacle.age)
    ends = np.stack([grown[:-1], grown[1:]], axis=-1)
    linear = Enclosed(ends, np.full(len(ends), ALLOWANCE * (1 + float(grown[-1])))).elevated(seen.degree)
    shape = (*seen.radius.shape[:2], 1)
    points = np.broadcast_to(linear.points[None, :, None], (*shape, seen.degree + 1))
    radius = np.broadcast_to(linear.radius[None, :, None], shape)
    return Enclosed(np.concatenate([seen.points, points], axis=2), np.concatenate([seen.radius, radius], axis=2))


def extent(curves: Enclosed) -> tuple[Array, Array]:
    """Lower and upper corner of a bounding box around all pieces of each agent.

    Shape: (agents, pieces, dim) -> (agents, dim) twice, metres.
    """
    return curves.low().min(axis=1), curves.high().max(axis=1)


def cut(curves: Enclosed, times: Array, joints: Array) -> Enclosed:
    """Trajectories with their pieces split at ``joints``, which include all ``times``, in seconds: (agents, parts,
    dim).

    Each part begins exactly at the end of the previous part, which differs from the joint only by rounding.
    """
    piece = np.searchsorted(times, joints[:-1], side="right") - 1
    count = np.bincount(piece, minlength=times.size - 1)
    first = np.cumsum(count) - count
    parts = curves[:, piece]
    rest, begin = curves, times[:-1].copy()
    for rank in range(1, int(count.max())):
        chosen = np.flatnonzero(count > rank)
        joint = joints[first[chosen] + rank]
        share = (joint - begin[chosen]) / (times[chosen + 1] - begin[chosen])
        before, after = rest[:, chosen].split(share[:, None])
        rest = Enclosed(rest.points.copy(), rest.radius.copy())
        rest.points[:, chosen], rest.radius[:, chosen] = after.points, after.radius
        for place, part in ((first[chosen] + rank - 1, before), (first[chosen] + rank, after)):
            parts.points[:, place], parts.radius[:, place] = part.points, part.radius
        begin[chosen] = joint
    return parts


def clear_of(shape: Shape, dimension: int, need: Array) -> Judge:
    """Function that bounds the distance to a body minus ``need`` on parts of a trajectory.

    Args:
        need: required distance of each item, (items,), metres.
    """
    bounds = _distance_bounds(shape, dimension)

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        off = curve.radius.max(axis=-1) * sqrt(dimension)
        lower, there, err = bounds(curve.middle().points[..., 0], curve.points, off)
        return lowered(lower - err - need[item]), there + 2 * err - need[item], np.full(item.size, 0.5)

    return judge


def clear_of_growing(judge: Judge) -> Judge:
    """Function that bounds the distance to a growing body; the last coordinate of a curve is the growth in metres.

    Args:
        judge: the same function for a body that does not grow.
    """

    def grown(item: Indices, curve: Enclosed) -> Bounds:
        growth = curve[:, -1]
        lower, seen, share = judge(item, curve[:, :-1])
        half = growth.middle()
        return lowered(lower - growth.high()), seen - half.points[..., 0] + half.radius, share

    return grown


def box_clear_of(shape: Shape, dimension: int) -> Callable[[Array, Array, Array], Array]:
    """Function for a lower bound on the distance of axis-aligned boxes to a body, minus the required distance, metres.

    The function maps two corners (parts, dim) and the required distances (parts,) to (parts,).
    """
    bounds = _distance_bounds(shape, dimension)

    def far(low: Array, high: Array, need: Array) -> Array:
        at_high = np.array(list(product((False, True), repeat=dimension)))
        corners = np.where(at_high, high[:, None], low[:, None]).swapaxes(1, 2)
        lower, _, err = bounds((low + high) / 2, corners, np.zeros(len(low)))
        return lowered(lower - err - need)

    return far


def _distance_bounds(shape: Shape, dimension: int) -> Callable[[Array, Array, Array], tuple[Array, Array, Array]]:
    """Function that bounds the distance of point sets to a body, metres.

    Its arguments are a known point, (parts, dim), the points around it, (parts, dim, points), and their position error,
    (parts,). It returns the minimum distance to the body, the distance of the known point, and the error bound of both:
    (parts,) each.
    """
    distance, size = solid(shape, dimension), _size(shape)

    def bounds(centre: Array, around: Array, off: Array) -> tuple[Array, Array, Array]:
        away = np.sqrt(((around - centre[..., None]) ** 2).sum(axis=-2)).max(axis=-1)
        err = ALLOWANCE * (size + np.abs(centre).max(axis=-1) + away) + off * GROWN
        there = distance(centre)
        return np.fmax(there - away, _beyond_plane(shape, centre, around)), there, err

    return bounds


def _beyond_plane(shape: Shape, centre: Array, points: Array) -> Array:
    """Lower bound on the distance of point sets to a body, from separating planes: (parts,), metres.

    The bound is -inf without a separating plane.

    Args:
        centre: (parts, dim), metres.
        points: (parts, dim, points), metres.
    """
    match shape:
        case Union(left, right):
            return np.minimum(_beyond_plane(left, centre, points), _beyond_plane(right, centre, points))
        case Intersection(left, right):
            return np.maximum(_beyond_plane(left, centre, points), _beyond_plane(right, centre, points))
        case Difference(left, _):
            return _beyond_plane(left, centre, points)
        case Box() | Disc() | Ball() | Polygon():
            normal = centre - _nearest(shape, centre)
            length = np.linalg.norm(normal, axis=-1)
            separate = length > 0
            normal = normal / np.where(separate, length, 1.0)[:, None]
            along = (normal[..., None] * points).sum(axis=-2).min(axis=-1)
            return np.where(separate, along - _support(shape, normal), -np.inf)
        case _:
            assert_never(shape)


def _nearest(shape: Box | Disc | Ball | Polygon, centre: Array) -> Array:
    """Approximately nearest point of the shape to each centre: (parts, dim), metres.

    An approximation suffices because the plane through the point is verified separately.
    """
    near = centre.copy()
    match shape:
        case Box(low, high):
            return np.clip(centre, low, high)
        case Ball(middle, radius):
            return _in_ball(np.array(middle), radius, centre)
        case Disc(middle, radius, band):
            near[:, :2] = _in_ball(np.array(middle), radius, centre[:, :2])
        case Polygon(corners, band):
            near[:, :2] = _in_polygon(np.array(corners), centre[:, :2])
    if band is not None:
        near[:, 2] = np.clip(centre[:, 2], band.low, band.high)
    return near


def _in_ball(middle: Array, radius: float, points: Array) -> Array:
    offset = points - middle
    length = np.linalg.norm(offset, axis=-1, keepdims=True)
    return np.asarray(middle + offset * np.minimum(1.0, radius / np.where(length > 0, length, 1.0)))


def _in_polygon(corners: Array, points: Array) -> Array:
    """Nearest point of a polygon to each point, (points, 2), metres; points inside stay unchanged."""
    start, along = corners, np.roll(corners, -1, axis=0) - corners
    offset = points[:, None] - start
    square = (along**2).sum(axis=-1)
    share = np.clip((offset * along).sum(axis=-1) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    feet = start + share[..., None] * along
    best = ((points[:, None] - feet) ** 2).sum(axis=-1).argmin(axis=-1)
    above = start[:, 1] > points[:, None, 1]
    crosses = above != np.roll(above, -1, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = start[:, 0] + along[:, 0] * (points[:, None, 1] - start[:, 1]) / along[:, 1]
    inside = (crosses & (points[:, None, 0] < at)).sum(axis=-1) % 2 == 1
    return np.where(inside[:, None], points, feet[np.arange(len(points)), best])


def _support(shape: Box | Disc | Ball | Polygon, normal: Array) -> Array:
    """Support function of the body: its extent along unit vectors, (parts, dim) -> (parts,), metres."""
    match shape:
        case Box(low, high):
            return np.asarray(sum(_farthest(normal[:, axis], low[axis], high[axis]) for axis in range(len(low))))
        case Ball(middle, radius):
            return np.asarray(normal @ np.array(middle) + radius)
        case Disc(middle, radius, band):
            flat = normal[:, :2]
            reach = flat @ np.array(middle) + radius * np.linalg.norm(flat, axis=-1)
        case Polygon(corners, band):
            reach = (normal[:, :2] @ np.array(corners).T).max(axis=-1)
    return np.asarray(reach if band is None else reach + _farthest(normal[:, 2], band.low, band.high))


def _farthest(slope: Array, low: float, high: float) -> Array:
    """Largest ``slope * x`` for x from ``low`` to ``high``, (parts,), metres; it may be infinite."""
    end = np.where(slope > 0, high, low)
    return np.where(slope == 0, 0.0, slope * np.where(slope == 0, 0.0, end))


def _size(shape: Shape) -> float:
    """Upper bound on the magnitudes of the numbers that define the shape, metres, at least 1."""
    match shape:
        case Union(left, right) | Intersection(left, right) | Difference(left, right):
            return max(_size(left), _size(right))
        case Box(low, high):
            numbers = (*low, *high)
        case Ball(middle, radius):
            numbers = (*middle, radius)
        case Disc(middle, radius, band):
            numbers = (*middle, radius, *_heights(band))
        case Polygon(corners, band):
            numbers = (*(value for corner in corners for value in corner), *_heights(band))
        case _:
            assert_never(shape)
    return 1.0 + max(abs(number) for number in numbers if isfinite(number))


def _heights(band: Prism | None) -> tuple[float, ...]:
    return () if band is None else (band.low, band.high)


def world(mission: Mission, flight: Flight) -> Claim:
    """Claim that every agent's centre stays in the world, inset by the vehicle's fence inset and tracking error."""
    inset = np.array([agent.vehicle.fence_inset + agent.vehicle.tracking for agent in mission.agents])
    inset = (inset[:, None] + flight.off).reshape(-1, 1)
    low = np.where(inset > 0, raised(np.array(mission.world.low) + inset), mission.world.low)
    high = np.where(inset > 0, lowered(np.array(mission.world.high) - inset), mission.world.high)
    detail = "every centre is inside the world in continuous time"
    if inset.any():
        detail += ", with the fence inset and the tracking margin of its vehicle"
    judge = between_bounds(low, high)
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
    """Claims that every body keeps its distance from each obstacle.

    Args:
        strict: True for the required clearance, False for the minimum safe distance.
    """
    return [_obstacle(mission, flight, obstacle, strict) for obstacle in mission.obstacles]


def _obstacle(mission: Mission, flight: Flight, obstacle: Obstacle, strict: bool) -> Claim:
    times, seen = seen_from(mission, flight, obstacle)
    room = np.array([agent.radius + agent.vehicle.tracking for agent in mission.agents])
    piece = np.clip(np.searchsorted(flight.times, times[:-1], side="right") - 1, 0, flight.durations.size - 1)
    need = raised(room[:, None] + flight.off[piece])
    if not obstacle.constant:
        need = raised(need + flight.drift(_skews(mission))[:, piece])
    detail = "no bodies touch in continuous time"
    if strict:
        wanted = np.array([agent.radius + mission.clearance for agent in mission.agents])
        need = np.maximum(need, wanted[:, None])
        detail = f"every body has a clearance of {mission.clearance:g} m in continuous time"
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
    """Claim that every two bodies keep their distance; empty for a single agent.

    Args:
        strict: True for the required separation, False for the minimum safe distance.
    """
    pairs = _pairs(mission)
    if not len(pairs):
        return []
    radius = np.array([agent.radius for agent in mission.agents])
    distance = np.array([agent.vehicle.pair_distance for agent in mission.agents])
    bodies = radius[pairs].sum(axis=1)
    apart = np.maximum(bodies, distance[pairs].max(axis=1))
    need = raised(apart[:, None] + _missed(mission, flight, pairs))
    detail = "no bodies touch in continuous time"
    if strict:
        need = np.maximum(need, (bodies + mission.separation)[:, None])
        detail = f"every pair of bodies has a separation of {mission.separation:g} m in continuous time"
    level = flight.position[:, :, : mission.dimension]
    return [_of_pairs("separation", "m", detail, pairs, flight, level, need)]


def downwash(mission: Mission, flight: Flight) -> list[Claim]:
    """Claims that no vehicle is in the downwash of another one.

    The difference of two positions, divided by the half axes of the downwash ellipsoid, must have length at least 1.
    The ellipsoid is grown by both tracking errors. Every ``p > 0`` gives an ellipsoid that contains the sum of another
    ellipsoid and a ball, with the squared half axes ``(1 + 1 / p) * axis**2 + (1 + p) * radius**2``; here ``p`` makes
    the horizontal axis exact.

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
    # Division is multiplication by an inverse that is not too large: rounding brings vehicles nearer, not farther.
    shrink = lowered(lowered(1.0 / raised(axes)))
    detail = "no vehicle is in the downwash of another in continuous time"
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
    """Claim that the agents of each pair keep the distance ``need``.

    Args:
        need: (pairs, 1 or pieces), metres.
        scale: weights of the coordinate differences, (pairs, 1 or pieces, dim); None for the plain distance.
    """
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
        if scale is not None:  # the smallest factor gives the shortest vector
            shortest = scale.min(axis=1)[pair]
            least, greatest = lowered(least * shortest), raised(greatest * shortest)
        return far_from_origin(least, greatest, most[pair])

    judge, times = at_least_in_box(need.ravel(), pieces // need.shape[1]), flight.times
    return Claim(f"flown {name}", "all pairs", unit, ROUNDING, detail, pairs, times, curve, judge, CERTAIN, far)


def _pairs(mission: Mission) -> Indices:
    """Index pairs of different agents, each pair once: (pairs, 2)."""
    return np.stack(np.triu_indices(len(mission.agents), k=1), axis=-1).astype(np.int64)


def _skews(mission: Mission) -> Array:
    return np.array([agent.vehicle.start_skew for agent in mission.agents])


def _missed(mission: Mission, flight: Flight, pairs: Indices) -> Array:
    """Upper bound on the reduction of each pair's distance by tracking errors and start skew.

    Shape: (pairs, pieces), metres, or (pairs, 1) if constant.
    """
    tracking = np.array([agent.vehicle.tracking for agent in mission.agents])
    if not (tracking.any() or _skews(mission).any() or flight.off.any()):
        return np.zeros((len(pairs), 1))
    off = raised(tracking[:, None] + flight.off + flight.drift(_skews(mission)))
    return raised(off[pairs[:, 0]] + off[pairs[:, 1]])
