"""Margins of the constraints on positions, in continuous time along trajectories, and their tolerances.

    in   Mission, Curves
    out  Margins of world, fence and altitude band, of clearance and of separation

A ``Margins`` value belongs to one constraint, with several subjects (agents or pairs of agents) at several times.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.geometry.curves.piecewise_polynomials import Curves, extents
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission
from missionc.verification.certificate import CERTAIN, CONTACT, MOTION
from missionc.verification.plan.clearances import margins, near_pairs, pair_margins
from missionc.verification.plan.starts_and_finishes import extremes


class Margins(Record, eq=False):
    """Margins of one constraint for several agents or pairs of agents, at several times.

    Args:
        name, unit: as in ``Constraint``.
        tolerance: in ``unit``; (subjects, moments) if it differs.
        agents: (subjects, 1 or 2), mission indices.
        margin: (subjects, moments), a value that occurs; infinite if none is known.
        time: (moments,) or (subjects, moments), seconds.
        obstacle: name of the obstacle, for a clearance.
        lower: (subjects, moments), proved lower bounds of the margins; None: ``margin`` itself.
    """

    name: str
    unit: str
    tolerance: float | Array
    agents: Indices
    margin: Array
    time: Array
    obstacle: str = ""
    lower: Array | None = None


def as_flown(mission: Mission) -> Mission:
    """The mission without tracking margins and start skews: allowances for a plan that a real flight may use up."""
    return replace(
        mission,
        agents=tuple(
            replace(each, vehicle=replace(each.vehicle, tracking=0.0, start_skew=0.0)) for each in mission.agents
        ),
    )


class Room(Record, eq=False):
    """Boxes that must contain the agents' centres: opposite corners, (agents, dim), metres."""

    name: str
    low: Array
    high: Array

    @staticmethod
    def all_of(mission: Mission) -> list[Room]:
        """Boxes of the world, and of the vehicles' fences and altitude bands if there are any."""
        low, high = (np.tile(corner, (len(mission.agents), 1)) for corner in (mission.world.low, mission.world.high))
        inset = np.array([[agent.vehicle.fence_inset] for agent in mission.agents])
        rooms = [Room("world", low, high), *([Room("fence", low + inset, high - inset)] if inset.any() else [])]
        bands = [agent.vehicle.height for agent in mission.agents]
        if mission.dimension == 3 and any(np.isfinite([edge for band in bands for edge in (band.low, band.high)])):
            below, above = np.full_like(low, -np.inf), np.full_like(high, np.inf)
            below[:, 2], above[:, 2] = [band.low for band in bands], [band.high for band in bands]
            rooms.append(Room("height", below, above))
        return rooms


class Tolerance(Record):
    """Tolerances of the constraints on a recorded flight.

    Args:
        position: error of recorded positions, metres. Each tolerance is the resulting change of margins, in addition to
            the verifier's rounding.
        step: duration of a step, seconds.
        tallest: maximum weight of altitudes in the separation.
    """

    position: float
    step: float
    tallest: float

    @staticmethod
    def of(mission: Mission, position: float) -> Tolerance:
        return Tolerance(
            position, float(mission.step), max(1.0, float(SpacingTable.of(mission).flatness.max(initial=1.0)))
        )

    @property
    def contact(self) -> float:
        """Tolerance of the margins to world, fence, altitude band and obstacles, metres."""
        return CONTACT + self.position

    @property
    def apart(self) -> float:
        """Tolerance of the separation margin, metres."""
        return CONTACT + 2 * self.tallest * self.position

    @property
    def move(self) -> float:
        """Tolerance of one move between two steps, metres."""
        return MOTION + 2 * self.position

    @property
    def speed(self) -> float:
        """Tolerance of a speed, m/s."""
        return MOTION + 2 * self.position / self.step

    @property
    def acceleration(self) -> float:
        """Tolerance of an acceleration, m/s²."""
        return MOTION + 4 * self.position / self.step**2

    def direction(self, length: Array) -> Array:
        """Tolerance of the direction of moves with the given lengths: (...), metres -> (...), rad."""
        share = np.divide(2 * self.position, length, out=np.ones_like(length), where=length > 2 * self.position)
        return np.asarray(np.where(length > 2 * self.position, np.arcsin(share), np.pi))


CEILINGS = (None, 0.0)
"""Ceilings for two searches: the first finds the minimum margin, the second every negative margin if there may
be one.
"""


def between_margins(mission: Mission, rooms: list[Room], curves: Curves, tolerance: Tolerance) -> Iterator[Margins]:
    """Margins of the constraints on positions, in continuous time along trajectories."""
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
    """Separation margins in each piece: of the nearest pair, and of every pair that is, or may be, too near.

    Args:
        spare: only consider pairs that may come within this distance of the required separation, metres.
    """
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
