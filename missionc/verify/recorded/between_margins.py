"""Margins of the constraints on places, in continuous time along a motion.

in   Mission, Curves
out  Margins: of the rooms, clearance, separation
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missionc.curves.piecewise_polynomials import Curves, extents
from missionc.ir import Mission
from missionc.verify.plan.agent_separation import near_pairs, pair_margins
from missionc.verify.plan.obstacle_clearance import margins
from missionc.verify.plan.starts_and_finishes import extremes
from missionc.verify.recorded.margins import Margins, Room, Tolerance
from missionc.verify.tolerances import CERTAIN

CEILINGS = (None, 0.0)
"""The least margin of all is found first; then, if it may be negative, every negative one."""


def between_margins(mission: Mission, rooms: list[Room], curves: Curves, tolerance: Tolerance) -> Iterator[Margins]:
    """Margins at every moment of a motion."""
    where, when = extremes(curves)
    everyone = np.arange(len(mission.agents))[:, None]
    flat = (len(everyone), -1)
    for room in rooms:
        low, high = room.low[:, None, :, None], room.high[:, None, :, None]
        found = np.minimum(where - low, high - where)
        yield Margins(room.name, "m", tolerance.contact, everyone, found.reshape(flat), when.reshape(flat))
    around = extents(curves)
    for obstacle in mission.obstacles:
        for ceiling in CEILINGS:
            seen, bounds = margins(mission, curves, around, obstacle, CERTAIN, ceiling)
            time = np.tile(seen.times[:-1], len(everyone)) + bounds.at
            yield Margins(
                "clearance",
                "m",
                tolerance.contact,
                everyone,
                bounds.upper.reshape(flat),
                time.reshape(flat),
                obstacle.name,
                None if ceiling is None else bounds.lower.reshape(flat),
            )
            if bounds.lower.min() >= -tolerance.contact:
                break
    yield from separation_margins(mission, curves, tolerance)


def separation_margins(
    mission: Mission, curves: Curves, tolerance: Tolerance, spare: float | None = None
) -> Iterator[Margins]:
    """Margins of the nearest pair in each piece, of every pair that is too near, or may be by ``spare`` metres."""
    if len(mission.agents) < 2:
        return
    for piece, first, second in near_pairs(mission, curves, spare):
        pairs = np.stack([first, second], axis=1)
        for ceiling in CEILINGS:
            lower, upper, when = pair_margins(mission, curves, piece, first, second, ceiling)
            time, bound = curves.times[piece] + when[:, None], None if ceiling is None else lower[:, None]
            yield Margins("separation", "m", tolerance.apart, pairs, upper[:, None], time, lower=bound)
            if lower.min() >= -tolerance.apart or curves.coefficients.shape[-1] == 2:
                break
