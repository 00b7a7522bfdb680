"""Dynamics of agents within one step, and steering from one state to another in a whole number of steps.

Source:
    [strel] Algorithm 1, STEER, and Experiment Setup; [clot] II-A.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.vectors import norm
from missionc.ir import Dynamics

SLACK = 1e-9
"""Fraction by which a motion may exceed a bound on speed or acceleration because of rounding errors."""


class States(Record, eq=False):
    """Positions and velocities of agents, one state per row.

    Args:
        position: (states, dim), metres.
        velocity: (states, dim), m/s; zero for first-order dynamics.
    """

    position: Array
    velocity: Array

    def take(self, which: Indices | Flags | slice) -> States:
        return States(self.position[which], self.velocity[which])

    def __len__(self) -> int:
        return len(self.position)


class Motions(Record, eq=False):
    """Motions of agents during one step each, with constant acceleration.

    Args:
        position: position at the start of the step, (..., dim), metres.
        velocity: velocity at the start of the step, (..., dim), m/s.
        acceleration: (..., dim), m/s²; zero for straight motion.
    """

    position: Array
    velocity: Array
    acceleration: Array

    def take(self, *which: Indices | Flags | slice | int) -> Motions:
        """Motions selected by an index of the leading axes."""
        return Motions(self.position[which], self.velocity[which], self.acceleration[which])

    def put(self, row: int, motions: Motions) -> None:
        """Replace the motions of row ``row`` of the first axis, in place."""
        self.position[row], self.velocity[row] = motions.position, motions.velocity
        self.acceleration[row] = motions.acceleration

    @staticmethod
    def stacked(rows: Sequence[Motions]) -> Motions:
        """Motions of equal shapes, stacked along a new first axis."""
        parts = zip(*((each.position, each.velocity, each.acceleration) for each in rows), strict=True)
        return Motions(*(np.stack(part) for part in parts))

    def at(self, time: float | Array) -> Array:
        """Positions ``time`` seconds after the start of the motions: (..., dim), metres."""
        return self.position + self.velocity * time + self.acceleration * (0.5 * time * time)

    def bulge(self, duration: float) -> Array:
        """Greatest deviation of the motions from their chords over ``duration`` seconds: (...), metres."""
        bulge: Array = np.linalg.norm(self.acceleration, axis=-1) * (duration * duration / 8)
        return bulge

    def lengths(self, step: float) -> Array:
        """Path lengths of motions of ``step`` seconds: (...), metres."""
        chords = 16  # number of straight pieces between points of a curved motion
        moments = np.linspace(0.0, step, chords + 1).reshape(-1, *(1,) * self.position.ndim)
        return np.asarray(norm(np.diff(self.at(moments), axis=0)).sum(axis=0))


def can_wait(dynamics: Dynamics) -> bool:
    """Return true if an agent at rest may stay at its position."""
    return dynamics.lowest_speed == 0


def speeds(dynamics: Dynamics) -> tuple[float, float]:
    """Minimum and maximum speed of an agent, m/s."""
    return dynamics.lowest_speed, dynamics.top_speed


def turn_in_step(dynamics: Dynamics, step: float) -> float:
    """Greatest change of heading between two steps, rad; infinite without a bound."""
    turn = dynamics.top_turn * step
    return math.inf if turn >= math.pi else turn


def steer(
    dynamics: Dynamics, start: States, end: States, step: float, most: int, side: int = 0
) -> tuple[Indices, Array]:
    """Least number of whole steps from each state to its partner, and the bend of the path (first half of STEER).

    First-order motions use equal steps, straight or along an arc that turns as much as the turning rate allows. Without
    a bound on turning, an arc leads to positions closer than one step at minimum speed, in at least two steps.
    Second-order motions use the accelerations of least effort. Obstacles, the world and the headings at both ends are
    ignored.

    Args:
        start: states at the start, (pairs); ``end`` likewise.
        step: duration of a step, seconds.
        most: maximum number of steps.
        side: 0 for straight, 1 or -1 for an arc that turns left or right; first order only.

    Returns:
        numbers of steps, (pairs,), 0 if no such motion takes at most ``most`` steps; and bends, (pairs,), rad: the left
        turn from one step to the next.
    """
    if dynamics.has_momentum:
        count = _steps_with_momentum(dynamics, start, end, step, most)
        return count, np.zeros(len(count))
    slowest_leg, fastest_leg = (speed * step for speed in speeds(dynamics))
    shortest, longest = slowest_leg * (1 - SLACK), fastest_leg * (1 + SLACK)
    way = end.position - start.position
    length = norm(way)
    if side == 0:
        count = np.maximum(np.ceil(length / longest), 1).astype(np.int64)
        return np.where((count <= most) & (count * shortest <= length), count, 0), np.zeros(len(count))
    flat, climb = norm(way[:, :2]), np.linalg.norm(way[:, 2:], axis=-1)
    limit = turn_in_step(dynamics, step)
    if math.isinf(limit):
        level = np.sqrt(np.maximum(slowest_leg**2 - (climb / 2) ** 2, 0.0))
        able = (flat < 2 * level) & (flat > 0) & (most >= 2)
        bend = 2 * np.arccos(np.clip(flat / np.where(able, 2 * level, 1.0), 0.0, 1.0))
        return np.where(able, 2, 0), side * bend
    count = np.zeros(len(way), dtype=np.int64)
    for steps in range(2, min(most, math.ceil(2 * math.pi / limit) - 1) + 1):
        leg = np.hypot(flat / _chord(steps, np.array(limit)), climb / steps)
        count[(count == 0) & (leg >= shortest) & (leg <= longest)] = steps
    return count, np.full(len(way), side * limit)


def path_between(
    dynamics: Dynamics, start: States, end: States, step: float, count: int, bend: Array
) -> tuple[Array, Array]:
    """States at the steps of motions that take ``count`` steps each (second half of STEER).

    Args:
        bend: (pairs,), rad, from ``steer``.

    Returns:
        positions, (pairs, count + 1, dim), metres, and velocities, (pairs, count + 1, dim), m/s (zero for first order);
        the first and the last state are exactly ``start`` and ``end``.
    """
    if not dynamics.has_momentum:
        position = _arc(start.position, end.position, count, bend)
        return position, np.zeros_like(position)
    mean, ramp = _least_effort(start, end, step, count)
    acceleration = mean[:, None] + ramp[:, None] * ((count - 1) / 2 - np.arange(count))[None, :, None]
    velocity = np.concatenate([start.velocity[:, None], acceleration], axis=1)
    velocity[:, 1:] = start.velocity[:, None] + step * np.cumsum(acceleration, axis=1)
    position = np.concatenate([start.position[:, None], np.zeros_like(acceleration)], axis=1)
    position[:, 1:] = start.position[:, None] + step * np.cumsum((velocity[:, 1:] + velocity[:, :-1]) / 2, axis=1)
    position[:, -1], velocity[:, -1] = end.position, end.velocity
    return position, velocity


def headings_along(start: States, end: States, count: int, bend: Array) -> Array:
    """Headings at each step of first-order motions of ``count`` steps: (pairs, count), rad."""
    way = end.position - start.position
    middle = np.arctan2(way[:, 1], way[:, 0])
    headings: Array = middle[:, None] + bend[:, None] * (np.arange(count) - (count - 1) / 2)
    return headings


def motions_between(dynamics: Dynamics, start: States, end: States, step: float) -> Motions:
    """Motions of one step from each state ``start`` to its partner ``end``, (pairs)."""
    if dynamics.has_momentum:
        return Motions(start.position, start.velocity, (end.velocity - start.velocity) / step)
    velocity = (end.position - start.position) / step
    return Motions(start.position, velocity, np.zeros_like(velocity))


SPEED, ACCELERATION, DRIFT = "its speed", "its acceleration", "its velocity"
"""Parts of the dynamics that a step may violate. DRIFT means that the positions disagree with the velocities."""

UNIT_OF = {SPEED: "m/s", ACCELERATION: "m/s^2", DRIFT: "m"}
"""Unit of the margin of each part of the dynamics."""


def check_step(
    dynamics: Dynamics, position: Array, next_position: Array, velocity: Array, next_velocity: Array, step: float
) -> dict[str, Array]:
    """Margins of one step for each part of the dynamics except the turning rate; negative if violated.

    Args:
        position: (..., dim), metres, at the start of the step, ``next_position`` at its end.
        velocity: (..., dim), m/s, at the start of the step, ``next_velocity`` at its end; read for second order only.

    Returns:
        (...) each: the margin of speed, m/s; for second order also that of acceleration, m/s², and minus the
            disagreement of positions and velocities, metres.
    """
    if not dynamics.has_momentum:
        slowest, fastest = speeds(dynamics)
        speed = norm(next_position - position) / step
        return {SPEED: np.minimum(fastest - speed, speed - slowest)}
    quickest = np.maximum(norm(velocity), norm(next_velocity))
    acceleration = norm(next_velocity - velocity) / step
    drift = norm(next_position - position - (velocity + next_velocity) * (step / 2))
    margin = dynamics.top_acceleration - acceleration
    return {SPEED: dynamics.top_speed - quickest, ACCELERATION: margin, DRIFT: -drift}


def _chord(count: int, bend: Array) -> Array:
    """Length of the chord of ``count`` unit steps with a turn of ``bend`` rad between steps: (pairs,),
    dimensionless."""
    half = np.where(bend == 0, 1.0, np.abs(bend)) / 2
    chord: Array = np.where(bend == 0, count, np.sin(count * half) / np.sin(half))
    return chord


def _arc(start: Array, end: Array, count: int, bend: Array) -> Array:
    """Positions of equal steps from ``start`` to ``end`` with a turn of ``bend`` rad between steps: (pairs, count + 1,
    dim), metres."""
    part = np.linspace(0.0, 1.0, count + 1)[None, :, None]
    position: Array = start[:, None] * (1 - part) + end[:, None] * part
    if count == 1 or not np.any(bend):
        return position
    way = end - start
    turn = bend[:, None] * (np.arange(count) - (count - 1) / 2)
    chord = _chord(count, bend)[:, None, None]
    ahead = np.cumsum(np.cos(turn), axis=1)[:, :-1, None] / chord
    aside = np.cumsum(np.sin(turn), axis=1)[:, :-1, None] / chord
    left = np.stack([-way[:, 1], way[:, 0]], axis=1)
    position[:, 1:-1, :2] = start[:, None, :2] + ahead * way[:, None, :2] + aside * left[:, None]
    return position


def _least_effort(start: States, end: States, step: float, count: int) -> tuple[Array, Array]:
    """Accelerations of least norm between two states, as ``mean`` and ``ramp``: ``mean + ramp * ((count - 1) / 2 - i)``
    in step i.

    Both results are (pairs, dim), m/s². The accelerations solve x_k = x_0 + k h v_0 + h² Σ (k - i - ½) a_i and v_k =
    v_0 + h Σ a_i.
    """
    mean = (end.velocity - start.velocity) / (count * step)
    missing = (end.position - start.position) / step**2 - start.velocity * (count / step) - mean * (count**2 / 2)
    return mean, missing * (12.0 / (count * (count**2 - 1)))


def _steps_with_momentum(dynamics: Dynamics, start: States, end: States, step: float, most: int) -> Indices:
    length = norm(end.position - start.position)
    soonest = length / dynamics.top_speed
    latest = 2 * soonest + 4 * dynamics.top_speed / dynamics.top_acceleration  # twice a stop, the whole path and a stop
    fewest = np.zeros(len(start), dtype=np.int64)
    for count in range(2, most + 1):  # one step has a single acceleration, which cannot meet two conditions
        time = count * step
        if not np.any(missing := (fewest == 0) & (latest >= time - step)):
            break
        some = np.flatnonzero(missing & (soonest <= time))
        mean, ramp = _least_effort(start.take(some), end.take(some), step, count)
        reach = ramp * ((count - 1) / 2)
        strongest = np.maximum(norm(mean + reach), norm(mean - reach))
        half = count // 2
        midway = start.velocity[some] + step * (half * mean + ramp * (half * (count - half) / 2))
        gentle = (strongest <= dynamics.top_acceleration) & (norm(midway) <= dynamics.top_speed)
        some = some[gentle]
        _, velocity = path_between(dynamics, start.take(some), end.take(some), step, count, np.zeros(len(some)))
        within = norm(velocity).max(axis=-1, initial=0.0) <= dynamics.top_speed
        fewest[some[within]] = count
    return fewest
