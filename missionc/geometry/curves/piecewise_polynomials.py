"""Piecewise polynomials: trajectories of all agents on one grid of times, and the trajectory CSV of a Crazyflie.

The trajectory between two steps is a polynomial of degree one or two, and the flight of a Crazyflie has degree seven.
This module serves both.

The CSV has the uav_trajectories format: a header, then one row for each piece. A row contains the duration, and eight
coefficients each of x, y, z and yaw in ascending powers of the seconds since the piece began. Numbers are read and
written in float32, as in the firmware.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices, Trace
from missionc.geometry.vectors import norm
from missionc.ir import Mission


class Curves(Record, eq=False):
    """Joint trajectory of all agents as piecewise polynomials of time.

    Args:
        times: boundaries of the pieces, (pieces + 1,), seconds, increasing.
        coefficients: (agents, pieces, dim, degree + 1), metres and seconds: coefficients of ascending powers of the
            time since the piece began.
    """

    times: Array
    coefficients: Array

    @property
    def durations(self) -> Array:
        """Durations of the pieces, (pieces,), seconds."""
        return np.diff(self.times)

    def derivative(self) -> Curves:
        """Time derivative of the trajectory: velocities of positions, or accelerations of velocities."""
        power = np.arange(1, self.coefficients.shape[-1])
        return Curves(self.times, self.coefficients[..., 1:] * power)

    def at(self, times: Array) -> Array:
        """Positions of all agents at times (samples,), seconds -> (agents, samples, dim), metres.

        Before the first and after the last piece, the positions are constant.
        """
        piece = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, self.durations.size - 1)
        local = np.clip(times - self.times[piece], 0.0, self.durations[piece])
        return values(self.coefficients[:, piece], np.broadcast_to(local, (len(self.coefficients), local.size)))

    def between(self, first: Indices, second: Indices) -> Curves:
        """Relative trajectories ``first - second`` of pairs of agents (indices (pairs,)), with one curve per pair."""
        return Curves(self.times, self.coefficients[first] - self.coefficients[second])


def derivatives_at(curves: Curves, times: Array, orders: int) -> Array:
    """Positions of all agents and their time derivatives at given times: (agents, samples, orders, dim), metres and
    seconds.

    Args:
        times: (samples,), seconds.
        orders: number of orders; 1 for the position only.

    At a boundary of two pieces, the values belong to the piece that begins there.
    """
    piece = np.clip(np.searchsorted(curves.times, times, side="right") - 1, 0, curves.durations.size - 1)
    local = np.clip(times - curves.times[piece], 0.0, curves.durations[piece])
    own, found = curves.coefficients[:, piece], []
    for _ in range(orders):
        found.append(values(own, np.broadcast_to(local, own.shape[:2])))
        own = own[..., 1:] * np.arange(1, own.shape[-1])
    return np.stack(found, axis=2)


def values(coefficients: Array, local: Array) -> Array:
    """Values of polynomials at local times: (..., dim, degree + 1) and (...), seconds -> (..., dim); 0 for no
    coefficients."""
    if not coefficients.shape[-1]:
        return np.zeros(coefficients.shape[:-1])
    result = coefficients[..., -1]
    for power in range(coefficients.shape[-1] - 2, -1, -1):
        result = result * local[..., None] + coefficients[..., power]
    return result


def control_points(coefficients: Array, duration: Array) -> Array:
    """Bernstein control points of polynomials over [0, duration].

    Shape: (..., dim, degree + 1), (...) seconds -> (..., dim, degree + 1), metres.

    The curve lies in the convex hull of its control points.
    """
    degree = coefficients.shape[-1] - 1
    change = np.array([[comb(j, i) / comb(degree, i) for j in range(degree + 1)] for i in range(degree + 1)])
    scaled: Array = coefficients * duration[..., None, None] ** np.arange(degree + 1)
    return np.asarray(scaled @ change)


def from_control_points(points: Array, duration: Array) -> Array:
    """Power coefficients of polynomials with given Bernstein control points over [0, duration]; inverse of
    ``control_points``.

    Shape: (..., dim, degree + 1), metres, and (...), seconds -> (..., dim, degree + 1), ascending powers of seconds.
    """
    degree, difference, columns = points.shape[-1] - 1, points, []
    for power in range(degree + 1):
        columns.append(difference[..., 0] * comb(degree, power) / duration[..., None] ** power)
        difference = np.diff(difference, axis=-1)
    return np.stack(columns, axis=-1)


def speed_bounds(curves: Curves) -> Array:
    """Upper bounds of the speed of each agent in each piece, (agents, pieces), m/s; exact up to degree two."""
    velocity = curves.derivative()
    if velocity.coefficients.shape[-1] == 0:
        return np.zeros(curves.coefficients.shape[:2])
    return np.asarray(norm(hulls(velocity).swapaxes(-1, -2)).max(axis=-1))


def hulls(curves: Curves, parts: int = 1) -> Array:
    """Bernstein control points of ``parts`` equal parts of each piece.

    Shape: (agents, pieces * parts, dim, degree + 1), metres.

    Each part lies in the convex hull of its points. Twice as many parts reduce the gap between hull and curve to a
    quarter.
    """
    if parts > 1:
        shares = np.arange(1, parts) / parts
        curves = refined(curves, (curves.times[:-1, None] + curves.durations[:, None] * shares).ravel())
    return control_points(curves.coefficients, np.broadcast_to(curves.durations, curves.coefficients.shape[:2]))


def extents(curves: Curves) -> tuple[Array, Array]:
    """Lowest and highest corner of a box around each agent's whole trajectory: (agents, dim) twice, metres."""
    reach = speed_bounds(curves) * curves.durations / 2
    middle = values(curves.coefficients, np.broadcast_to(curves.durations / 2, reach.shape))
    return (middle - reach[..., None]).min(axis=1), (middle + reach[..., None]).max(axis=1)


def refined(curves: Curves, extra: Array) -> Curves:
    """Same trajectory with additional piece boundaries at the times ``extra``, (moments,), seconds, inside its time
    range."""
    inside = extra[(extra > curves.times[0]) & (extra < curves.times[-1])]
    times = np.union1d(curves.times, inside)
    if times.size == curves.times.size:
        return curves
    piece = np.searchsorted(curves.times, times[:-1], side="right") - 1
    return Curves(times, shifted(curves.coefficients[:, piece], times[:-1] - curves.times[piece]))


def shifted(coefficients: Array, start: Array) -> Array:
    """Polynomials reparametrised so that local time 0 is at ``start``, (pieces,), seconds.

    Shape: (agents, pieces, dim, degree + 1), metres.
    """
    size = coefficients.shape[-1]
    change = np.zeros((start.size, size, size))
    for old in range(size):
        for new in range(old + 1):
            change[:, old, new] = comb(old, new) * start ** (old - new)
    return np.asarray(np.einsum("apdo,pon->apdn", coefficients, change))


def motion(mission: Mission, trace: Trace) -> Curves:
    """Joint trajectory of a trace between its steps, as piecewise polynomials.

    First-order agents move straight at constant velocity between positions. A double integrator starts with the
    velocity of the step and reaches the next position under constant acceleration.
    """
    steps = trace.position.shape[1] - 1
    start, move = trace.position[:, :-1], np.diff(trace.position, axis=1)
    second_order = [agent.dynamics.has_momentum for agent in mission.agents]
    linear, bend = move / trace.step, np.zeros_like(move)
    if any(second_order):
        chosen = np.array(second_order)
        velocity = trace.velocity[chosen, :-1]
        linear[chosen] = velocity
        bend[chosen] = (move[chosen] - velocity * trace.step) / trace.step**2
        return Curves(trace.step * np.arange(steps + 1), np.stack([start, linear, bend], axis=-1))
    return Curves(trace.step * np.arange(steps + 1), np.stack([start, linear], axis=-1))


COLUMNS = ("duration", *(f"{axis}^{power}" for axis in ("x", "y", "z", "yaw") for power in range(8)))


class Pieces(Record, eq=False):
    """Contents of one trajectory file, in float32 numbers.

    Args:
        duration: durations of the pieces, (pieces,), seconds.
        coefficients: (pieces, 4, 8), coefficients of x, y, z (metres) and yaw (rad), ascending powers of seconds.
    """

    duration: Array
    coefficients: Array

    @property
    def times(self) -> Array:
        """Boundaries of the pieces: (pieces + 1,), seconds."""
        return np.concatenate([[0.0], np.cumsum(self.duration)])


def curves_of(files: Sequence[Pieces], rows: slice) -> Curves:
    """Joint trajectory of agents from their trajectory files, which have equal piece durations.

    Args:
        rows: selection of the coordinates x, y, z and yaw.
    """
    return Curves(files[0].times, np.stack([own.coefficients[:, rows] for own in files]))


def read(text: str) -> Pieces | str:
    """Pieces of a trajectory file, as the firmware reads them, or a message about the error in the file."""
    lines = text.split("\n")
    if lines[0] != ",".join(COLUMNS):
        return "the first line is not the header"
    if lines[-1] != "" or len(lines) < 4:
        return "fewer than two complete rows"
    rows = []
    for number, line in enumerate(lines[1:-1], start=2):
        try:
            row = [float(word) for word in line.split(",")]
        except ValueError:
            return f"line {number} has a value that is not a number"
        if len(row) != len(COLUMNS):
            return f"line {number} has {len(row)} columns, not {len(COLUMNS)}"
        rows.append(row)
    with np.errstate(over="ignore"):
        numbers = np.array(rows).astype(np.float32).astype(np.float64)
    if not np.isfinite(numbers).all() or (numbers[:, 0] <= 0).any():
        return "a number is not finite, or a duration is not positive"
    return Pieces(numbers[:, 0], numbers[:, 1:].reshape(-1, 4, 8))


def polynomials(text: str) -> Pieces:
    """Pieces of a trajectory file that has been verified before.

    Raises:
        ValueError: the text is invalid; the message describes the error.
    """
    pieces = read(text)
    if isinstance(pieces, str):
        raise ValueError(pieces)
    return pieces


def written(pieces: Pieces) -> str:
    """Text of a trajectory file; nine significant digits identify every float32 number."""
    table = np.concatenate([pieces.duration[:, None], pieces.coefficients.reshape(len(pieces.duration), -1)], axis=1)
    # Adding zero turns -0 into 0.
    rows = (",".join(f"{number + 0.0:.9g}" for number in row) for row in table.tolist())
    return "\n".join((",".join(COLUMNS), *rows)) + "\n"
