"""Where polynomials come too close, and the planes that keep them on their sides.

The verified motion of two agents within a step is straight, so at its closest
approach there is a plane between them that it never crosses: if the control
points respect it, the polynomials keep the distance too. The same holds for a
convex obstacle. Only planes that are needed are made.

Source:
    Hönig, Preiss, Kumar, Sukhatme, Ayanian, "Trajectory Planning for Quadrotor Swarms" (2018), section V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missionc.emit.fit import DEGREE, SAFE, Course, Plane
from missionc.ir import Mission, Obstacle, Path, Shape, Still, Union
from missionc.plan import Array
from missionc.verify.curves import Curves
from missionc.verify.obstacles import margins, seen_from
from missionc.verify.separation import near_pairs, pair_margins
from missionc.verify.solids import Distance, solid
from missionc.verify.tolerances import ROUNDING

LENIENT = 2e-6
"""Metres: a plane is never tighter than the verified motion by this, or bodies that start in touch had no room."""


@dataclass(frozen=True, slots=True)
class Near:
    """Two agents, or one agent and an obstacle, too close in a piece."""

    piece: int
    first: int
    other: int | Obstacle


def conflicts(mission: Mission, level: Curves) -> list[Near]:
    """All places where the curves keep less than the mission's separation or clearance."""
    found: list[Near] = []
    for piece, first, second in near_pairs(mission, level, spare=0.0):
        lower, upper, _ = pair_margins(mission, level, piece, first, second, 0.0)
        close = (upper < -ROUNDING / 2) | (lower < -2 * ROUNDING)
        found += [Near(piece, int(one), int(two)) for one, two in zip(first[close], second[close], strict=True)]
    for obstacle in mission.obstacles:
        seen = seen_from(level, obstacle)
        bounds = margins(mission, seen, obstacle, ROUNDING, 0.0)
        touched = np.flatnonzero((bounds.upper < -ROUNDING / 2) | (bounds.lower < -2 * ROUNDING))
        agent, part = np.divmod(touched, seen.times.size - 1)
        piece_of = np.clip(np.searchsorted(level.times, seen.times[part], side="right") - 1, 0, None)
        found += [Near(p, a, obstacle) for a, p in sorted(set(zip(agent.tolist(), piece_of.tolist(), strict=True)))]
    return found


def planes_for(mission: Mission, course: Course, times: Array, near: Near) -> list[Plane]:
    """The planes that end a conflict, as far as the verified motion respects them."""
    match near.other:
        case int(second):
            ends = np.stack([course.start[:, near.piece], course.end[:, near.piece]], axis=1)
            return _between(mission, near, second, ends[near.first] - ends[second])
        case Obstacle(motion=Still()) as obstacle:
            ends = np.stack([course.start[near.first, near.piece], course.end[near.first, near.piece]])
            return _beside(mission, near, obstacle, ends, np.zeros_like(ends))
        case Obstacle(motion=Path(knots, offsets)) as obstacle:
            ends = course.joint[near.first, near.piece : near.piece + 2]
            when = times[near.piece : near.piece + 2]
            shift = np.stack([np.interp(when, knots, axis) for axis in np.array(offsets).T], axis=-1)
            return _beside(mission, near, obstacle, ends, shift)
        case _:
            raise AssertionError(near)


def _between(mission: Mission, near: Near, second: int, relative: Array) -> list[Plane]:
    """``relative``: (2, dim), the first agent as the second sees it, at both ends of its straight motion."""
    need = mission.agents[near.first].radius + mission.agents[second].radius + mission.separation
    start, along = relative[0], relative[1] - relative[0]
    square = float(along @ along)
    share = float(np.clip(-float(start @ along) / square, 0.0, 1.0)) if square > 0 else 0.0
    closest = start + share * along
    distance = float(np.linalg.norm(closest))
    if distance <= LENIENT:
        return []
    offset = np.full(DEGREE + 1, min(need + SAFE, distance - LENIENT))
    return [Plane(near.piece, near.first, second, closest / distance, offset)]


def _beside(mission: Mission, near: Near, obstacle: Obstacle, ends: Array, shift: Array) -> list[Plane]:
    """One plane for each part of the shape; ``ends`` and ``shift`` (of the obstacle) at both ends: (2, dim)."""
    need = mission.agents[near.first].radius + mission.clearance
    seen = ends - shift
    drift = shift[0] + np.linspace(0.0, 1.0, DEGREE + 1)[:, None] * (shift[1] - shift[0])
    planes = []
    for part in _parts(obstacle.shape):
        distance = solid(part, mission.dimension)
        point = _closest(distance, seen)
        normal = _gradient(distance, point)
        level = float(normal @ point) - float(distance(point)) + need + SAFE
        # The verified motion itself must be on this side, or nothing could be.
        level = min(level, float((seen @ normal).min()) - LENIENT)
        planes.append(Plane(near.piece, near.first, near.first, normal, level + drift @ normal))
    return planes


def _parts(shape: Shape) -> list[Shape]:
    match shape:
        case Union(left, right):
            return _parts(left) + _parts(right)
        case _:
            return [shape]


def _closest(distance: Distance, seen: Array) -> Array:
    """The point of the segment nearest to the shape, to a ten-thousandth of the segment's length."""
    low, high = 0.0, 1.0
    for _ in range(2):
        share = np.linspace(low, high, 201)
        points = seen[0] + share[:, None] * (seen[1] - seen[0])
        best = int(distance(points).argmin())
        low, high = float(share[max(0, best - 1)]), float(share[min(200, best + 1)])
    return np.asarray(points[best])


def _gradient(distance: Distance, point: Array) -> Array:
    """The direction away from the shape."""
    small = 1e-6 * np.eye(point.size)
    slope = distance(point + small) - distance(point - small)
    return np.asarray(slope / max(float(np.linalg.norm(slope)), 1e-300))
