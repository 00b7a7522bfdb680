"""Separating planes for polynomials that come too close: each curve is constrained to its side of the plane.

The verified motion of two agents within a step is straight, so there is a plane at its closest approach that it never
crosses. If the control points respect it, the polynomials satisfy the separation too. The same holds for a convex
obstacle. Only necessary planes are added.

Source:
    Hönig, Preiss, Kumar, Sukhatme, Ayanian, "Trajectory Planning for Quadrotor Swarms" (2018), section V.
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import TypeAlias

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.flight.trajectories.fit_polynomials import Course, Plane
from missionc.geometry.curves.piecewise_polynomials import Curves, extents, refined, values
from missionc.geometry.curves.smooth_splines import DEGREE
from missionc.geometry.displacement import displaced
from missionc.ir import Mission, Obstacle, Shape, Union
from missionc.verification.certificate import ROUNDING
from missionc.verification.plan.clearances import margins, near_pairs, pair_margins
from missionc.verification.plan.obstacle_bodies import Distance, solid

LENIENT = 2e-6
"""Distance in metres by which a plane is looser than the verified motion, so that bodies initially in contact
can move.
"""


NARROWEST = 1e-3
"""Minimum radius to which a tube is halved, metres."""
SMALLEST = 1 / 8
"""Smallest fraction of a leg with a plane of its own for a moving obstacle, except between the obstacle's own turns."""


class Near(Record):
    """Conflict: two agents, or an agent and an obstacle, too close in a leg, from ``begin`` to ``end`` (seconds)."""

    leg: int
    begin: float
    end: float
    first: int
    other: int | Obstacle
    short: float = field(compare=False)
    """Lower bound on the missing distance, metres."""

    @property
    def agents(self) -> tuple[int, ...]:
        return (self.first, self.other) if isinstance(self.other, int) else (self.first,)

    @property
    def moving(self) -> bool:
        return isinstance(self.other, Obstacle) and not self.other.constant


Held: TypeAlias = dict[Near, list[Plane]]
"""Separating planes of each conflict."""


def conflicts(mission: Mission, level: Curves, held: Held) -> list[Near]:
    """All conflicts in which the curves violate the mission's separation or clearance.

    Beside moving or growing obstacles, the tested parts of legs are those with planes.

    Args:
        level: curves cut at the joints of the legs.
    """
    near_misses: list[Near] = []
    for leg, first, second in near_pairs(mission, level, spare=0.0):
        lower, upper, _ = pair_margins(mission, level, leg, first, second, 0.0)
        begin, end = level.times[leg : leg + 2].tolist()
        near_misses += [
            Near(leg, begin, end, int(first[index]), int(second[index]), -float(upper[index]))
            for index in np.flatnonzero(_close(lower, upper)).tolist()
        ]
    around = extents(level)
    cuts = np.array([time for near in held if near.moving for time in (near.begin, near.end)])
    for obstacle in mission.obstacles:
        flown = level if obstacle.constant else refined(level, cuts)
        seen, bounds = margins(mission, flown, around, obstacle, ROUNDING, 0.0)
        parts = seen.times.size - 1
        for index in np.flatnonzero(_close(bounds.lower, bounds.upper)).tolist():
            agent, part = divmod(index, parts)
            begin, end = seen.times[part : part + 2].tolist()
            leg = int(np.searchsorted(level.times, begin, side="right")) - 1
            near_misses.append(Near(leg, begin, end, agent, obstacle, -float(bounds.upper[index])))
    return near_misses


def _close(lower: Array, upper: Array) -> Flags:
    return np.asarray((upper < -ROUNDING / 2) | (lower < -2 * ROUNDING))


def held_apart(mission: Mission, course: Course, held: Held, near_misses: list[Near], level: Curves) -> Held:
    """Separating planes, including new ones for the conflicts.

    They come from the verified motion. If these do not help beside a moving obstacle, their time intervals are halved;
    the shortest ones use the fitted curve instead.
    """
    more = dict(held)
    for near in near_misses:
        if near not in held:
            for wider in [each for each in more if each.moving and _contains(each, near)]:
                del more[wider]
            more[near] = _planes(mission, course, near, None)
        elif near.moving and near.end - near.begin > SMALLEST * (course.times[near.leg + 1] - course.times[near.leg]):
            del more[near]
            middle = (near.begin + near.end) / 2
            for half in (replace(near, end=middle), replace(near, begin=middle)):
                more[half] = _planes(mission, course, half, None)
        elif near.moving:
            more[near] = _planes(mission, course, near, level)
    return more


def _contains(wide: Near, near: Near) -> bool:
    same = (wide.leg, wide.first, wide.other) == (near.leg, near.first, near.other)
    return same and wide.begin <= near.begin and near.end <= wide.end


def _planes(mission: Mission, course: Course, near: Near, level: Curves | None) -> list[Plane]:
    """Planes of a conflict, from the verified motion if it respects them, or else from the fitted curve."""
    match near.other:
        case int(second):
            ends = np.stack([course.start[:, near.leg], course.end[:, near.leg]], axis=1)
            return _between(mission, near, second, ends[near.first] - ends[second], course.safe)
        case Obstacle(constant=True) as obstacle:
            ends = np.stack([course.start[near.first, near.leg], course.end[near.first, near.leg]])
            return _beside(mission, near, obstacle, (0.0, 1.0), ends, np.zeros(2), True, course.safe)
        case Obstacle() as obstacle:
            begin, end = course.times[near.leg : near.leg + 2]
            when = np.array([near.begin, near.end])
            share = np.clip((when - begin) / (end - begin), 0.0, 1.0)
            if level is None:
                first, last = course.joint[near.first, near.leg : near.leg + 2]
                ends = first + share[:, None] * (last - first)
            else:
                ends = values(level.coefficients[near.first, [near.leg] * 2], when - begin)
            part = (float(share[0]), float(share[1]))
            return _beside(mission, near, obstacle, part, ends, when, level is None, course.safe)
        case _:
            raise AssertionError(near)


def _between(mission: Mission, near: Near, second: int, relative: Array, safe: float) -> list[Plane]:
    """Planes between two agents in a leg.

    Args:
        relative: (2, dim), metres, their difference at both ends of straight motion.
        safe: margin for rounding, metres.
    """
    spacing = mission.spacing(near.first, second)
    # If two agents have a separation ellipsoid, it is a ball in this metric, and the plane touches it.
    metric = np.array([1.0, 1.0, spacing.flatness])[: relative.shape[1]]
    start, along = relative[0] * metric, (relative[1] - relative[0]) * metric
    square = float(along @ along)
    share = float(np.clip(-float(start @ along) / square, 0.0, 1.0)) if square > 0 else 0.0
    closest = start + share * along
    distance = float(np.linalg.norm(closest))
    if distance <= LENIENT:
        return []
    offset = np.full(DEGREE + 1, min(spacing.sideways + safe, distance - LENIENT))
    return [Plane(near.leg, (0.0, 1.0), near.first, second, closest / distance * metric, offset)]


def _beside(
    mission: Mission,
    near: Near,
    obstacle: Obstacle,
    share: tuple[float, float],
    ends: Array,
    when: Array,
    relax: bool,
    safe: float,
) -> list[Plane]:
    """Planes between an agent and an obstacle, one for each part of the obstacle's shape.

    Args:
        ends: positions of the agent at two times, (2, dim), metres.
        when: the two times, (2,), seconds.
    """
    need = mission.agents[near.first].radius + mission.clearance
    shift = np.array([displaced(obstacle, time, mission.dimension) for time in when])
    grown = np.array([obstacle.grown(time) for time in when])
    seen, share_of = ends - shift, np.linspace(0.0, 1.0, DEGREE + 1)
    drift = shift[0] + share_of[:, None] * (shift[1] - shift[0])
    swelling = grown[0] + share_of * (grown[1] - grown[0])
    planes = []
    for part in _parts(obstacle.shape):
        distance = solid(part, mission.dimension)
        point = _closest(distance, seen, grown)
        normal = _gradient(distance, point)
        level = float(normal @ point) - float(distance(point)) + need + safe
        if relax:
            # The verified motion itself must be on this side, or the problem is infeasible.
            level = min(level, float((seen @ normal - grown).min()) - LENIENT)
        planes.append(Plane(near.leg, share, near.first, near.first, normal, level + swelling + drift @ normal))
    return planes


def _parts(shape: Shape) -> list[Shape]:
    match shape:
        case Union(left, right):
            return _parts(left) + _parts(right)
        case _:
            return [shape]


def _closest(distance: Distance, seen: Array, grown: Array) -> Array:
    """Point of a segment that is nearest to a growing shape, (dim,), to a ten-thousandth of the segment's length.

    Args:
        seen: end points of the segment, (2, dim), metres.
        grown: growth of the shape at both ends, (2,), metres.
    """
    low, high = 0.0, 1.0
    for _ in range(2):
        share = np.linspace(low, high, 201)
        points = seen[0] + share[:, None] * (seen[1] - seen[0])
        best = int((distance(points) - grown[0] - share * (grown[1] - grown[0])).argmin())
        low, high = float(share[max(0, best - 1)]), float(share[min(200, best + 1)])
    return np.asarray(points[best])


def _gradient(distance: Distance, point: Array) -> Array:
    """Unit vector away from a shape at a point, (dim,), metres."""
    small = 1e-6 * np.eye(point.size)
    slope = distance(point + small) - distance(point - small)
    return np.asarray(slope / max(float(np.linalg.norm(slope)), 1e-300))


def groups(planes: list[Plane], stale: set[int]) -> list[list[int]]:
    """Groups of agents to fit together: each agent of ``stale`` with all agents that planes connect to it."""
    root = {index: index for index in stale}
    for plane in planes:
        for index in (plane.first, plane.second):
            root.setdefault(index, index)

    def find(index: int) -> int:
        while root[index] != index:
            root[index] = root[root[index]]
            index = root[index]
        return index

    for plane in planes:
        first, second = sorted((find(plane.first), find(plane.second)))
        root[second] = first
    groups: dict[int, list[int]] = {}
    for index in sorted(root):
        groups.setdefault(find(index), []).append(index)
    return [group for group in groups.values() if stale.intersection(group)]


def narrowed(radius: Array, again: list[Near]) -> Array:
    """Tube radii, (agents, legs), metres, halved at conflicts that planes did not remove (nonconvex shapes)."""
    radius = radius.copy()
    for near in again:
        for index in (near.first, near.other):
            if isinstance(index, int):
                radius[index, near.leg] = max(NARROWEST, radius[index, near.leg] / 2)
    return radius
