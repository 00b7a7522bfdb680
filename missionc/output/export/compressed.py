"""Compressed trajectories of the Crazyflie firmware: whole millimetres and milliseconds, rounded here, never truncated.

A start point (x, y, z in mm, yaw in 0.1°), then the pieces: two bits for each
axis' degree, milliseconds, and the Bernstein control points but the first,
which is the last one of the piece before. An axis is constant or of degree
seven: with fewer control points the flight would lose its smoothness.

Source:
    crazyflie-firmware, docs/functional-areas/trajectory_formats.md.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from missionc.base.trace import Array
from missionc.curves.crazyflie_csv import Pieces
from missionc.curves.piecewise_polynomials import Curves, Indices, control_points, from_control_points, speed_bounds

CONSTANT, SEVENTH = 0, 3
"""Types of an axis; 1 and 2, linear and cubic, are not used."""
FARTHEST, LONGEST = 32767, 65535
"""Millimetres from the origin, and milliseconds of a piece."""
PADDING = 1e-9
"""Metres: more than float64 loses in a bound."""


@dataclass(frozen=True, slots=True, eq=False)
class Compressed:
    """One vehicle's trajectory.

    Args:
        blob: as it lies in memory.
        points: (pieces, 3, 8), metres: the control points that are in it.
        duration: (pieces,), seconds.
        deviation: metres, proved: at no time is it further from the raw polynomials.
    """

    blob: bytes
    points: Array
    duration: Array
    deviation: float


def compress(own: Pieces) -> Compressed | str:
    """The compressed form of raw pieces, or why there is none."""
    if own.coefficients[:, 3].any():
        return "it turns, and firmware before 2026.08 reads compressed yaw wrongly"
    raw = control_points(own.coefficients[:, :3], own.duration)
    times = own.times
    # The times are rounded, not the durations, whose errors would add up.
    clock = np.rint(times * 1000).astype(np.int64)
    lasting = np.diff(clock)
    if lasting.min() < 1 or lasting.max() > LONGEST:
        return (
            f"a piece lasts {own.duration.min():.3g} s or {own.duration.max():.3g} s; 0.001 s to 65.535 s can be said"
        )
    grid = np.rint(raw * 1000).astype(np.int64)
    grid[1:, :, 0] = grid[:-1, :, 7]
    if np.abs(grid).max() > FARTHEST:
        return f"it is {np.abs(raw).max():.3g} m from the origin; 32.767 m can be said"
    points = grid / 1000
    apart = np.linalg.norm(points - raw, axis=1).max()
    fastest = speed_bounds(Curves(times, own.coefficients[None, :, :3])).max()
    late = np.abs(clock / 1000 - times).max()
    return Compressed(_blob(grid, lasting), points, lasting / 1000, float(apart + fastest * late + PADDING))


def as_polynomials(packed: Compressed) -> Pieces:
    """What the firmware makes of it, to float32."""
    coefficients = np.zeros((packed.duration.size, 4, 8))
    coefficients[:, :3] = from_control_points(packed.points, packed.duration).astype(np.float32)
    return Pieces(packed.duration.astype(np.float32).astype(np.float64), coefficients)


def _blob(grid: Indices, lasting: Indices) -> bytes:
    """(pieces, 3, 8) millimetres and (pieces,) milliseconds as bytes; a piece without duration ends them."""
    parts = [struct.pack("<hhhh", *grid[0, :, 0].tolist(), 0)]
    for piece, duration in zip(grid.tolist(), lasting.tolist(), strict=True):
        types, elements = 0, list[int]()
        for axis, points in enumerate(piece):
            moves = any(point != points[0] for point in points)
            types |= (SEVENTH if moves else CONSTANT) << 2 * axis
            elements += points[1:] if moves else []
        parts.append(struct.pack(f"<BH{len(elements)}h", types, duration, *elements))
    parts.append(struct.pack("<BH", 0, 0))
    return b"".join(parts)
