"""Export for Skybrush: a ``.skyc`` show for its viewer, with every trajectory as cubic Bézier curves.

The show contains the flight from takeoff to landing, with yaw and a light for each drone. Axes are the mission's: x
north, y west, z up. Yaw is in degrees clockwise, and linear between its setpoints.

Cubics approximate the curves of degree seven within a millimetre. Each has the position and the velocity of the curve
at its ends, which are at integer milliseconds. The difference is piecewise polynomial and bounded by its Bernstein
control points.

Source:
    skybrush-io: packages/show-format/src (``trajectory.ts``, ``yaw-control.ts``, ``lights.ts``), the documentation of
    the format, and studio-blender for the sense of yaw.
    Farin, "Curves and Surfaces for CAGD" (2002), chapters 5 and 7.
"""

from __future__ import annotations

import base64
import io
import json
import math
import zipfile
from itertools import combinations

import numpy as np

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.palette import DARK
from missionc.base.trace import Array, Indices
from missionc.geometry.curves.piecewise_polynomials import (
    Curves,
    Pieces,
    control_points,
    curves_of,
    from_control_points,
    hulls,
    refined,
)
from missionc.output.export.export_form import Exported, Format, refused
from missionc.output.export.samples import RATE
from missionc.output.export.takeoff_and_landing import GROUND, PARTS, cannot_rise_or_land, floor_to_floor
from missionc.output.export.verified_flight import Flight, Part
from missionc.verification.plan.clearances import relative_margins

CLOSE = 1e-3
"""Maximum error of a cubic in metres; a cubic with a larger error is split."""
GRAIN = 1e-6
"""Resolution of written coordinates, metres."""
PADDING = 1e-9
"""Margin in metres that covers float64 rounding in a bound."""


class Cubics(Record, eq=False):
    """Trajectory of one agent as cubic Bézier curves.

    Args:
        clock: (cubics + 1,), whole milliseconds.
        points: (cubics, 3, 4), Bézier control points, metres, multiples of ``GRAIN``.
        deviation: proved maximum distance from the curve, metres.
    """

    clock: Indices
    points: Array
    deviation: float

    @property
    def curves(self) -> Curves:
        """The cubics as polynomials in powers of time, (1, cubics, 3, 4)."""
        times = self.clock / 1000
        return Curves(times, from_control_points(self.points, np.diff(times))[None])


def cubics(curve: Curves) -> Cubics:
    """Cubic approximation of one agent's trajectory, (1, pieces, 3, 8), which ends at rest.

    Cubics are split until each is within ``CLOSE`` of the trajectory.
    """
    curve = _held(curve)
    clock = np.unique(np.rint(curve.times * 1000).astype(np.int64))
    clock[-1] = round(curve.times[-1] * 1000)
    while True:
        points = _through(curve, clock / 1000)
        apart = _apart(curve, clock / 1000, points)
        far = np.flatnonzero((apart > CLOSE) & (np.diff(clock) > 1))
        if not far.size:
            return Cubics(clock, points, float(apart.max()))
        clock = np.union1d(clock, (clock[far] + clock[far + 1]) // 2)


def _held(curve: Curves) -> Curves:
    """The trajectory extended by rest to the next integer millisecond."""
    end = math.ceil(curve.times[-1] * 1000 - 1e-3) / 1000
    if end <= curve.times[-1]:
        return curve
    hold = np.zeros((1, 1, 3, 8))
    hold[..., 0] = curve.at(curve.times[-1:])
    return Curves(np.append(curve.times, end), np.concatenate([curve.coefficients, hold], axis=1))


def _through(curve: Curves, times: Array) -> Array:
    """Control points of cubics with the trajectory's positions and velocities at these times, (cubics, 3, 4),
    metres.
    """
    place, velocity = curve.at(times)[0], curve.derivative().at(times)[0]
    third = np.diff(times)[:, None] / 3
    points = np.stack(
        [place[:-1], place[:-1] + velocity[:-1] * third, place[1:] - velocity[1:] * third, place[1:]], axis=-1
    )
    return np.asarray(np.rint(points / GRAIN) * GRAIN)


def _apart(curve: Curves, times: Array, points: Array) -> Array:
    """Upper bound on the distance of each cubic from the trajectory, (cubics,), metres."""
    own = Curves(times, from_control_points(points, np.diff(times))[None])
    # On one grid of times: the joints of both.
    fine, course = refined(curve, times), refined(own, curve.times)
    last = min(fine.times[-1], course.times[-1])
    both = np.union1d(fine.times, course.times)
    both = both[both <= last]
    fine, course = refined(fine, both), refined(course, both)
    size = both.size - 1
    gap = fine.coefficients[0, :size].copy()
    gap[..., :4] -= course.coefficients[0, :size]
    far = np.linalg.norm(control_points(gap, np.diff(both)), axis=1).max(axis=-1) + PADDING
    result = np.zeros(len(points))
    cubic = np.clip(np.searchsorted(times, (both[:-1] + both[1:]) / 2, side="right") - 1, 0, len(points) - 1)
    np.maximum.at(result, cubic, far)
    return result


NAME = "skybrush"
SET_COLOUR, END, FRAMES = 4, 0, 50
"""Codes of two commands in a light program, and the number of its time units per second."""
STRAIGHT = 0.05
"""Tolerance in degrees: a yaw setpoint closer to the line through adjacent setpoints is omitted."""
EPOCH = (1980, 1, 1, 0, 0, 0)
"""Fixed date of every entry in the archive, since zip files require a date."""


def write(flight: Flight) -> Exported | Diagnostic:
    """File ``show.skyc``, with a note on the error of its curves, or a diagnostic.

    The export fails if the vehicles cannot take off and land at once.
    """
    if flight.in_flight:
        return refused(
            NAME,
            "it begins in the air, after an earlier flight",
            "a show starts on the floor",
            help="use another export, such as `cflib`",
        )
    grounded = cannot_rise_or_land(NAME, flight, GROUND)
    if grounded is not None:
        return grounded
    whole = floor_to_floor(flight)
    splines = [cubics(curves_of([own], slice(0, 3))) for own in whole]
    far = max(own.deviation for own in splines)
    if far > CLOSE:
        return refused(
            NAME,
            f"between whole milliseconds, cubic curves deviate {far * 1e3:.3g} mm from it",
            f"the limit is {CLOSE * 1e3:g} mm",
            help="use a larger `step`",
        )
    show = {
        "version": 1,
        "environment": {"type": "indoor"},
        "settings": {"validation": _validation(flight, _nearest(curves_of(whole, slice(0, 3))) - 2 * far, splines)},
        "swarm": {"drones": [_drone(*each) for each in zip(flight.parts, whole, splines, strict=True)]},
        "meta": {"title": flight.mission.name},
    }
    text = json.dumps(show, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    note = f"skybrush: the cubics deviate at most {math.ceil(far * 1e5) / 100:.2f} mm from the polynomials"
    return Exported({"show.skyc": _zipped({"show.json": text.encode()})}, (note,))


def _drone(each: Part, whole: Pieces, own: Cubics) -> dict[str, object]:
    points = np.round(own.points, 6) + 0.0
    rows: list[list[object]] = [[0.0, points[0, :, 0].tolist(), []]]
    for piece, end in zip(points, own.clock[1:].tolist(), strict=True):
        still = not (piece != piece[:, :1]).any()
        rows.append([end / 1000, piece[:, 3].tolist(), [] if still else piece[:, 1:3].T.tolist()])
    settings = {
        "name": each.agent.name,
        "home": points[0, :, 0].tolist(),
        "landAt": points[-1, :, 3].tolist(),
        "trajectory": {"version": 1, "takeoffTime": 0.0, "points": rows},
        "yawControl": {"version": 1, "setpoints": _yaw(whole)},
        "lights": {"version": 1, "data": _light(each.agent.index, float(whole.times[-1]))},
    }
    return {"type": "generic", "settings": settings}


def _yaw(whole: Pieces) -> list[list[float]]:
    """Yaw setpoints of a vehicle: seconds and degrees clockwise, ``RATE`` per second during turns.

    Collinear setpoints are omitted.
    """
    turn = curves_of([whole], slice(3, 4))
    last = float(turn.times[-1])
    times = np.append(np.arange(math.ceil(last * RATE - 1e-3)) / RATE, last)
    degrees = -np.degrees(turn.at(times)[0, :, 0]) + 0.0
    kept, begin = [0], 0
    for index in range(2, times.size):
        inside = slice(begin + 1, index)
        share = (times[inside] - times[begin]) / (times[index] - times[begin])
        line = degrees[begin] + share * (degrees[index] - degrees[begin])
        if np.abs(line - degrees[inside]).max() > STRAIGHT:
            begin = index - 1
            kept.append(begin)
    kept.append(times.size - 1)
    return [[round(float(times[index]), 3), round(float(degrees[index]), 3) + 0.0] for index in kept]


def _light(index: int, seconds: float) -> str:
    """Light program in Base64 that shows the agent's colour during the flight."""
    colours = DARK["agents"]
    colour = bytes.fromhex(colours[index % len(colours)].removeprefix("#"))
    lasting, duration = math.ceil(seconds * FRAMES), bytearray()
    while lasting > 0x7F:
        duration.append(lasting & 0x7F | 0x80)
        lasting >>= 7
    program = bytes([SET_COLOUR]) + colour + bytes(duration) + bytes([lasting, END])
    return base64.b64encode(program).decode("ascii")


def _validation(flight: Flight, kept: float, splines: list[Cubics]) -> dict[str, float]:
    """Limits that this show satisfies, so that the viewer marks only violations.

    The altitude and the speeds are the largest of the show's cubics. The distance is the smallest required one, or
    ``kept`` if vehicles come closer, as on the floor.

    Args:
        kept: smallest distance between vehicles in the show, metres.
    """
    heights = [hulls(own.curves, PARTS)[:, :, 2] for own in splines]
    velocities = [hulls(own.curves.derivative(), PARTS) for own in splines]
    required = [flight.mission.spacing(*pair).sideways for pair in combinations(range(len(splines)), 2)]
    return {
        "maxAltitude": _raised(max(own.max() for own in heights)),
        "maxVelocityXY": _raised(max(np.linalg.norm(own[:, :, :2], axis=-2).max() for own in velocities)),
        "maxVelocityZ": _raised(max(np.abs(own[:, :, 2]).max() for own in velocities)),
        "minDistance": math.floor(min([*required, kept]) * 1000 + 1e-6) / 1000 if required else 0.0,
    }


def _raised(value: float) -> float:
    """The value rounded up to centimetres, at least 0.01."""
    return max(1, math.ceil(value * 100 - 1e-9)) / 100


def _nearest(curves: Curves) -> float:
    """Lower bound on the distance between any two vehicles, within 0.1 %, metres; infinite for one vehicle."""
    first, second = np.triu_indices(len(curves.coefficients), 1)
    least = math.inf
    for piece in range(curves.durations.size):
        own = Curves(curves.times[piece : piece + 2], curves.coefficients[:, piece : piece + 1])
        lower, _, _ = relative_margins(own.between(first, second), np.zeros(first.size), None)
        least = min(least, float(lower.min(initial=math.inf)))
    return least


def _zipped(files: dict[str, bytes]) -> bytes:
    """Zip archive with reproducible bytes: fixed date, order and system."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.create_system = 3
            entry.external_attr = 0o644 << 16
            # Stored without compression: the result of deflate depends on the installed zlib.
            archive.writestr(entry, content, zipfile.ZIP_STORED)
    return buffer.getvalue()


FORMAT = Format(NAME, "Skybrush show (.skyc) from takeoff to landing, as cubic curves within 1 mm", write)
