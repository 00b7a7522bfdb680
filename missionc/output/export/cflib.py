"""Export for cflib, without ROS: trajectories in a Crazyflie's memory, raw or compressed, and a flight script.

Trajectories are raw if they fit. Otherwise they are compressed and verified again in that form, and written only if no
agent comes closer to anything than the mission allows.

The compressed format has integer millimetres and milliseconds, rounded here and never truncated. It has a start point
(x, y, z in mm, yaw in 0.1°), then the pieces: two bits for each axis' degree, milliseconds, and the Bernstein control
points except the first, which is the last one of the previous piece. An axis is constant or of degree seven: with fewer
control points the flight would lose its smoothness.

Source:
    crazyflie-firmware, docs/functional-areas/trajectory_formats.md.
"""

from __future__ import annotations

import struct

import numpy as np

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.geometry.curves.piecewise_polynomials import (
    Curves,
    Pieces,
    control_points,
    from_control_points,
    speed_bounds,
)
from missionc.output.export.export_form import Exported, Format, refused
from missionc.output.export.fill_templates import render
from missionc.output.export.fly_script import for_templates
from missionc.output.export.takeoff_and_landing import cannot_rise_or_land
from missionc.output.export.trajectory_memory import raw
from missionc.output.export.verified_flight import Flight, Part
from missionc.verification.certificate import TUBE

CONSTANT, SEVENTH = 0, 3
"""Types of an axis in a compressed piece: constant, and degree seven; 1 and 2, linear and cubic, are not used."""
FARTHEST, LONGEST = 32767, 65535
"""Limits of the compressed format: distance from the origin in mm, and duration of a piece in ms."""
PADDING = 1e-9
"""Margin in metres that covers float64 rounding in a bound."""


class Compressed(Record, eq=False):
    """Trajectory of one vehicle in the firmware's compressed format.

    Args:
        blob: bytes in memory.
        points: (pieces, 3, 8), control points in it, metres.
        duration: (pieces,), seconds.
        deviation: proved maximum distance from the raw polynomials, metres.
    """

    blob: bytes
    points: Array
    duration: Array
    deviation: float


def compress(own: Pieces) -> Compressed | str:
    """The trajectory in the compressed format, or the reason why compression is impossible."""
    if own.coefficients[:, 3].any():
        return "its yaw changes, and firmware before 2026.08 decodes compressed yaw incorrectly"
    raw = control_points(own.coefficients[:, :3], own.duration)
    times = own.times
    # The times are rounded, not the durations, whose errors would add up.
    clock = np.rint(times * 1000).astype(np.int64)
    lasting = np.diff(clock)
    if lasting.min() < 1 or lasting.max() > LONGEST:
        return (
            f"a piece lasts {own.duration.min():.3g} s or {own.duration.max():.3g} s; the range is 0.001 s to 65.535 s"
        )
    grid = np.rint(raw * 1000).astype(np.int64)
    grid[1:, :, 0] = grid[:-1, :, 7]
    if np.abs(grid).max() > FARTHEST:
        return f"it is {np.abs(raw).max():.3g} m from the origin; the limit is 32.767 m"
    points = grid / 1000
    apart = np.linalg.norm(points - raw, axis=1).max()
    fastest = speed_bounds(Curves(times, own.coefficients[None, :, :3])).max()
    late = np.abs(clock / 1000 - times).max()
    return Compressed(_blob(grid, lasting), points, lasting / 1000, float(apart + fastest * late + PADDING))


def as_polynomials(packed: Compressed) -> Pieces:
    """Polynomials as the firmware decodes them from the compressed format, in float32."""
    coefficients = np.zeros((packed.duration.size, 4, 8))
    coefficients[:, :3] = from_control_points(packed.points, packed.duration).astype(np.float32)
    return Pieces(packed.duration.astype(np.float32).astype(np.float64), coefficients)


def _blob(grid: Indices, lasting: Indices) -> bytes:
    """Bytes of the compressed format; a piece of duration zero ends them.

    Args:
        grid: control points, (pieces, 3, 8), mm.
        lasting: durations, (pieces,), ms.
    """
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


NAME = "cflib"

KINDS = ("raw", "compressed")
"""Names of the trajectory formats, in the order of the firmware's numbers."""


class _Packed(Record):
    """Encoded trajectories of all vehicles, in one format.

    ``within`` is the maximum distance of each vehicle from its raw polynomials, mm.
    """

    blobs: tuple[bytes, ...]
    kind: str
    within: tuple[str, ...]
    notes: tuple[str, ...]


def write(flight: Flight) -> Exported | Diagnostic:
    """Files of the cflib export, or a diagnostic if no format fits a Crazyflie's memory or vehicles cannot take off at
    once.
    """
    grounded = cannot_rise_or_land(NAME, flight)
    if grounded is not None:
        return grounded
    packed = _packed(flight)
    if isinstance(packed, Diagnostic):
        return packed
    given = for_templates(flight) | {
        "kind": packed.kind,
        "kind_number": KINDS.index(packed.kind),
        "pieces": int(flight.parts[0].pieces.duration.size),
        "bytes": max(map(len, packed.blobs)),
        "memory": min(each.agent.vehicle.memory for each in flight.parts),
        "within": dict(zip((each.file for each in flight.parts), packed.within, strict=True)),
    }
    files = {f"{each.file}.bin": blob for each, blob in zip(flight.parts, packed.blobs, strict=True)}
    for name in ("fly.py", "README.md"):
        files[name] = render(f"cflib/{name}.j2", **given)
    return Exported(files, packed.notes)


def _packed(flight: Flight) -> _Packed | Diagnostic:
    plain = tuple(raw(each.pieces) for each in flight.parts)
    most, memory = max(map(len, plain)), min(each.agent.vehicle.memory for each in flight.parts)
    if most <= memory:
        note = f"cflib: raw, {most} of {memory} bytes of a Crazyflie's memory"
        return _Packed(plain, "raw", ("0",) * len(plain), (note,))
    compressed: list[Compressed] = []
    for each in flight.parts:
        packed = compress(each.pieces)
        if isinstance(packed, str):
            return _no_room(each, most, memory, f"`{each.agent.name}` cannot be compressed: {packed}")
        compressed.append(packed)
    blobs = tuple(packed.blob for packed in compressed)
    least = max(map(len, blobs))
    if least > memory:
        worst = flight.parts[[len(blob) for blob in blobs].index(least)]
        return _no_room(worst, most, memory, f"compressed it takes {least} bytes")
    notes = _judged(flight, compressed)
    if isinstance(notes, Diagnostic):
        return notes
    used = f"cflib: compressed, {least} of {memory} bytes of a Crazyflie's memory; the raw form needs {most}"
    return _Packed(blobs, "compressed", tuple(_millimetres(packed.deviation) for packed in compressed), (used, *notes))


def _judged(flight: Flight, compressed: list[Compressed]) -> tuple[str, ...] | Diagnostic:
    """Notes on the rounding error of compression.

    A diagnostic if a body comes too close to another body, an obstacle or the world's border.
    """
    exact = flight.judged({each.agent.name: each.pieces for each in flight.parts})
    rounded = flight.judged(
        {each.agent.name: as_polynomials(packed) for each, packed in zip(flight.parts, compressed, strict=True)}
    )
    judged = [check for check in rounded.checks if "flown " in check.name]
    assert len(judged) == sum("flown " in check.name for check in exact.checks), "a part was not evaluated"
    failed = [check for check in judged if not check.passed]
    if failed:
        worst = min(failed, key=lambda check: check.margin)
        when = f" at {worst.at:.2f} s" if worst.at is not None else ""
        return refused(
            NAME,
            f"raw it does not fit a Crazyflie's memory, and compressed `{worst.name}` fails{when}",
            f"{worst.detail}; violated by {-worst.margin:.3g} {worst.unit}",
            help="plan with a larger `step`, so that the raw pieces fit",
        )
    tubes = {check.subject: check.margin for check in exact.checks if check.name == "tube"}
    lines = []
    for each, packed in zip(flight.parts, compressed, strict=True):
        name = each.agent.name
        line = f"cflib: `{name}` deviates at most {_millimetres(packed.deviation)} mm from its raw polynomials"
        over = packed.deviation - tubes.get(name, 0.0)
        if over > 0:
            line += f", and may leave the tube of {TUBE:g} m around the plan by {_millimetres(over)} mm"
        lines.append(line)
    lines += [f"cflib: compressed, {warning}" for warning in rounded.warnings if warning not in exact.warnings]
    return tuple(lines)


def _millimetres(metres: float) -> str:
    """Text of a length in millimetres, rounded up to a hundredth, so that an upper bound stays valid."""
    return f"{-(-metres * 1e5 // 1) / 100:.2f}"


def _no_room(each: Part, most: int, memory: int, why: str) -> Diagnostic:
    return refused(
        NAME,
        f"the polynomials of `{each.agent.name}` need {most} bytes; the memory has {memory}",
        why,
        help="plan with a larger `step`",
    )


FORMAT = Format(NAME, "trajectories in the memory format of a Crazyflie, and a start script for cflib", write)
