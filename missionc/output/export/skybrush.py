"""Export for Skybrush: a ``.skyc`` show that its viewer opens, with every flight as cubic Bézier curves.

Only the flight is in it, from the first points in the air to the last; Skybrush
adds what comes before and after. Axes are the mission's: x north, y west, z up.

Source:
    skybrush-io: packages/show-format/src/trajectory.ts, and the documentation of the format.
"""

from __future__ import annotations

import io
import json
import math
import zipfile
from itertools import combinations

import numpy as np

from missionc.curves.piecewise_polynomials import Curves, control_points
from missionc.diagnostics.model import Diagnostic
from missionc.output.export.cubics import CLOSE, Cubics, cubics
from missionc.output.export.export_form import Exported, Format, refused
from missionc.output.export.verified_flight import Flight, Part

NAME = "skybrush"
EPOCH = (1980, 1, 1, 0, 0, 0)
"""The one date of every entry: zip files have to have one."""


def write(flight: Flight) -> Exported | Diagnostic:
    """``show.skyc``, and how far its curves are from the verified ones: never more than ``CLOSE``."""
    curves = flight.curves
    splines = [cubics(Curves(curves.times, curves.coefficients[[index]])) for index in range(len(curves.coefficients))]
    far = max(own.deviation for own in splines)
    if far > CLOSE:
        return refused(
            NAME,
            f"between whole milliseconds cubics stray {far * 1e3:.3g} mm from it",
            f"{CLOSE * 1e3:g} mm are allowed",
            help="fly it slower: a larger `step`, or slower `dynamics`",
        )
    show = {
        "version": 1,
        "environment": {"type": "indoor"},
        "settings": {"validation": _validation(flight)},
        "swarm": {"drones": [_drone(each, own) for each, own in zip(flight.parts, splines, strict=True)]},
        "meta": {"title": flight.mission.name},
    }
    text = json.dumps(show, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    note = f"skybrush: its cubics are never further than {math.ceil(far * 1e5) / 100:.2f} mm from the polynomials"
    return Exported({"show.skyc": _zipped({"show.json": text.encode()})}, (note,))


def _drone(each: Part, own: Cubics) -> dict[str, object]:
    points = np.round(own.points, 6) + 0.0
    rows: list[list[object]] = [[0.0, points[0, :, 0].tolist(), []]]
    for piece, end in zip(points, own.clock[1:].tolist(), strict=True):
        still = not (piece != piece[:, :1]).any()
        rows.append([end / 1000, piece[:, 3].tolist(), [] if still else piece[:, 1:3].T.tolist()])
    x, y, _ = points[0, :, 0].tolist()
    settings = {
        "name": each.agent.name,
        "home": [x, y, 0.0],
        "landAt": [*points[-1, :2, 3].tolist(), 0.0],
        "trajectory": {"version": 1, "takeoffTime": 0.0, "points": rows},
    }
    return {"type": "generic", "settings": settings}


def _validation(flight: Flight) -> dict[str, float]:
    """What this flight keeps, rounded up to tenths, so that the viewer marks what does not belong to it."""
    curves = flight.curves
    velocity = curves.derivative()
    points = control_points(velocity.coefficients, np.broadcast_to(velocity.durations, velocity.coefficients.shape[:2]))
    places = control_points(curves.coefficients, np.broadcast_to(curves.durations, curves.coefficients.shape[:2]))
    pairs = combinations(range(len(flight.parts)), 2)
    return {
        "maxAltitude": _tenths(float(places[:, :, 2].max())),
        "maxVelocityXY": _tenths(float(np.linalg.norm(points[:, :, :2], axis=-2).max())),
        "maxVelocityZ": _tenths(float(np.abs(points[:, :, 2]).max())),
        "minDistance": round(min((flight.mission.spacing(*pair).sideways for pair in pairs), default=0.0), 6),
    }


def _tenths(value: float) -> float:
    return math.ceil(value * 10 - 1e-9) / 10 if value > 0 else 0.1


def _zipped(files: dict[str, bytes]) -> bytes:
    """The same bytes each time: one date, one order, one system."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.create_system = 3
            entry.external_attr = 0o644 << 16
            # Stored: what deflate makes of it would depend on the zlib that is there.
            archive.writestr(entry, content, zipfile.ZIP_STORED)
    return buffer.getvalue()


FORMAT = Format(NAME, "a .skyc show for the viewer of Skybrush, as cubics within 1 mm", write)
