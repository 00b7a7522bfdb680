"""Trajectories of all agents as polynomials, with bounds on positions and speeds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from missionc.base.trace import Array
from missionc.geometry.curves.bernstein_intervals import GROWN, Enclosed, derivative, from_powers, root_above
from missionc.ir import Mission, Obstacle, Path, Still

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
