"""Vehicle limits as gauges of a flight's derivatives: their violations, and cutting planes against them.

The gauge of a limit is 1 at the limit and twice as much for twice the derivative, so a flight that is s times as long
has the gauge over s**order. It is convex: if a control point of a derivative is beyond the limit, the half-space
``slope @ derivative <= 1`` contains the allowed set.

Source:
    Rockafellar, "Convex Analysis" (1970), section 15, of gauges; Kelley, "The Cutting-Plane Method" (1960).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.flight.trajectories.fit_polynomials import Course, Cut
from missionc.geometry.curves.piecewise_polynomials import Curves, speed_bounds, values
from missionc.geometry.curves.smooth_splines import DEGREE, part_of
from missionc.ir import Mission, Vehicle
from missionc.verification.flight.verify_polynomials import GRAVITY
from missionc.verification.plan.conservative_advancement import least

SHARE = 0.98
"""Fraction of a limit that a fit may use: the rest is for rounding, and for errors of the cuts."""
PARTS = 4
"""Number of parts of a piece whose control points are tested; they are nearer to the curve than those of the piece."""
EXACT = 1e-3
"""Relative precision to which the peak of an exceeded limit is computed."""


class Limit(Record):
    """Limit of a vehicle on a derivative of its position, as a convex gauge; vectors (..., 3) in SI units.

    Args:
        most: limit, in its unit.
        gauge: function (..., 3) to (...).
        slope: gradient of the gauge: (..., 3) to (..., 3).
        steepest: largest norm of a gradient.
        reading: actual value for comparison with ``most``: (3,) to a number.
    """

    name: str
    unit: str
    order: int
    most: float
    gauge: Callable[[Array], Array]
    slope: Callable[[Array], Array]
    steepest: float
    reading: Callable[[Array], float]


class Peak(Record):
    """An exceeded limit: its largest gauge, the value there, and the time (seconds)."""

    limit: Limit
    gauge: float
    reading: float
    at: float

    @property
    def stretch(self) -> float:
        """Factor by which the flight must last longer to satisfy the limit."""
        return float(self.gauge ** (1 / self.limit.order))


def limits_of(vehicle: Vehicle) -> list[Limit]:
    """Finite limits of a vehicle's motion, as gauges."""
    level, height, full = np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), np.ones(3)
    limits = [
        _length("speed", "m/s", 1, vehicle.speed, level),
        _length("vertical speed", "m/s", 1, vehicle.vertical_speed, height),
        _length("acceleration", "m/s^2", 2, vehicle.acceleration, full),
        _length("jerk", "m/s^3", 3, vehicle.jerk, full),
    ]
    if vehicle.tilt < math.pi / 2:
        limits.append(_tilt(vehicle.tilt))
    if math.isfinite(vehicle.thrust.high):
        limits.append(_strongest(vehicle.thrust.high))
    if vehicle.thrust.low > 0:
        limits.append(_weakest(vehicle.thrust.low))
    return [limit for limit in limits if math.isfinite(limit.most)]


def _length(name: str, unit: str, order: int, most: float, axes: Array) -> Limit:
    def gauge(vector: Array) -> Array:
        return np.asarray(np.linalg.norm(vector * axes, axis=-1) / most)

    def slope(vector: Array) -> Array:
        return np.asarray(_unit(vector * axes) / most)

    return Limit(name, unit, order, most, gauge, slope, 1 / most, lambda vector: float(gauge(vector)) * most)


def _tilt(most: float) -> Limit:
    """Limit of the thrust's tilt, rad: ``|a sideways| - tan(angle) a_z <= tan(angle) g``."""
    level, up = np.array([1.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    tangent = math.tan(most)

    def gauge(vector: Array) -> Array:
        sideways = np.linalg.norm(vector * level, axis=-1)
        return np.asarray(np.maximum(sideways / tangent - vector[..., 2], 0.0) / GRAVITY)

    def slope(vector: Array) -> Array:
        return np.asarray((_unit(vector * level) / tangent - up) / GRAVITY)

    def reading(vector: Array) -> float:
        return math.degrees(math.atan2(float(np.linalg.norm(vector[:2])), float(vector[2]) + GRAVITY))

    steepest = 1 / (GRAVITY * math.sin(most))
    return Limit("tilt", "deg", 2, math.degrees(most), gauge, slope, steepest, reading)


def _strongest(most: float) -> Limit:
    """Upper limit of the thrust, ``|a + g| <= most * g``: the gauge u solves ``|a / u + g| = most * g``."""
    up, room = np.array([0.0, 0.0, 1.0]), most**2 - 1

    def root(vector: Array) -> Array:
        return np.asarray(np.sqrt(vector[..., 2] ** 2 + room * (vector**2).sum(axis=-1)))

    def gauge(vector: Array) -> Array:
        return np.asarray((vector[..., 2] + root(vector)) / (GRAVITY * room))

    def slope(vector: Array) -> Array:
        bend = vector[..., 2:] * up + room * vector
        return np.asarray((up + bend / np.maximum(root(vector), 1e-300)[..., None]) / (GRAVITY * room))

    return Limit("thrust", "times the weight", 2, most, gauge, slope, 1 / (GRAVITY * (most - 1)), _thrust)


def _weakest(least: float) -> Limit:
    """Lower limit of the thrust's upward component, which implies the lower limit of the thrust."""
    down, room = np.array([0.0, 0.0, -1.0]), GRAVITY * (1 - least)

    def gauge(vector: Array) -> Array:
        return np.asarray(np.maximum(-vector[..., 2], 0.0) / room)

    def slope(vector: Array) -> Array:
        return np.broadcast_to(down / room, vector.shape)

    def reading(vector: Array) -> float:
        return 1 + float(vector[2]) / GRAVITY

    return Limit("least thrust", "times the weight", 2, least, gauge, slope, 1 / room, reading)


def _thrust(vector: Array) -> float:
    return float(np.linalg.norm(vector + np.array([0.0, 0.0, GRAVITY]))) / GRAVITY


def _unit(vector: Array) -> Array:
    return np.asarray(vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-300))


def peaks(limits: list[Limit], flight: Curves) -> list[Peak]:
    """Limits that one agent's trajectory exceeds, each with its largest gauge.

    Args:
        flight: trajectory of one agent: (1, pieces, dim, 8).
    """
    maxima = []
    for limit in limits:
        derived = flight
        for _ in range(limit.order):
            derived = derived.derivative()
        coefficients = derived.coefficients[0]

        def margin(item: Indices, local: Array, limit: Limit = limit, own: Array = coefficients) -> Array:
            return -limit.gauge(_in_space(values(own[item], local)))

        changes = speed_bounds(derived)[0] * limit.steepest
        bounds = least(margin, changes, derived.durations, EXACT, ceiling=EXACT - 1)
        worst = int(bounds.lower.argmin())
        if bounds.lower[worst] < -1:
            local = bounds.at[[worst]]
            vector = _in_space(values(coefficients[[worst]], local))[0]
            when = float(derived.times[worst] + local[0])
            maxima.append(Peak(limit, -float(bounds.lower[worst]), limit.reading(vector), when))
    return maxima


def cuts(limits: list[Limit], agent: int, points: Array, durations: Array) -> list[Cut]:
    """Cutting planes, one for each control point of a derivative, in a part of a piece, that is beyond a limit.

    Args:
        points: (pieces, dim, 8), metres.
        durations: (pieces,), seconds.
    """
    dim = points.shape[1]
    constraints = []
    for limit in limits:
        form = in_parts(limit.order)
        scale = durations ** -float(limit.order)
        hull = _in_space(np.swapaxes(points @ form.T, 1, 2) * scale[:, None, None])
        for piece, which in np.argwhere(limit.gauge(hull) > SHARE).tolist():
            slope = limit.slope(hull[piece, which])[:dim]
            constraints.append(Cut(agent, piece, np.outer(slope, form[which]) * (scale[piece] / SHARE)))
    return constraints


def in_parts(order: int) -> Array:
    """Matrix from a piece's control points to those of a derivative in all parts, dimensionless weights.

    Shape: (PARTS * (8 - order), 8).
    """
    difference = np.diff(np.eye(DEGREE + 1), n=order, axis=0) * math.perm(DEGREE, order)
    borders = [(part / PARTS, (part + 1) / PARTS) for part in range(PARTS)]
    return np.concatenate([difference @ part_of(*border) * PARTS**order for border in borders])


def _in_space(vectors: Array) -> Array:
    """Vectors padded to three dimensions, (..., dim) to (..., 3), in the same unit, with 0 for the vertical
    component.
    """
    missing = 3 - vectors.shape[-1]
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, missing)]) if missing else vectors


def spare_performance(mission: Mission, course: Course, group: list[int]) -> tuple[Array, Array]:
    """Opposite corners of the box in which each leg must stay, (agents, legs, dim), metres.

    If the plan itself exceeds a vehicle's fence, the flight goes no further than the plan, and never out of the world.
    """
    corners = np.array([mission.room(index) for index in group])
    low, high = corners[:, 0], corners[:, 1]
    least, most = np.minimum(course.start, course.end), np.maximum(course.start, course.end)
    return (
        np.maximum(np.minimum(low[:, None], least), mission.world.low),
        np.minimum(np.maximum(high[:, None], most), mission.world.high),
    )
