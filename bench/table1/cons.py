"""CONS: a linear consensus law that tracks a reference from the start through the regions to the finish.

    velocity of i = velocity of r + TRACK ((r + d_i) - x_i) + AGREE sum over neighbours j of ((x_j - d_j) - (x_i - d_i))

Neighbours are the agents with a current link, d_i is the position of i in the team at the start. The law supports
neither formulas nor obstacles. The reference r therefore moves at constant speed, with a short rest in each region,
along the shortest path of a disc that contains the team, or, if there is none, of one robot. Velocities are clipped to
the limit. Bodies are separated only by their positions in the team.

Source:
    Olfati-Saber, Fax and Murray, "Consensus and Cooperation in Networked Multi-Agent Systems" (2007);
    [clot] Table I, CONS.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.spatial.distance import cdist

from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.base.trace import Array, Trace
from missionc.geometry.polylines import at_shares
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from table1.scene import Unsupported, box, legs, speed, stand, trace

TRACK, AGREE = 2.0, 1.0
"""Gains, 1/s."""

REST = 3
"""Steps of rest of the reference in each region."""

ROOM = 0.05
"""Extra distance of its path from obstacles, metres."""


def plan(mission: Mission, kernel: Kernel, seed: int, limit: float) -> Trace | str:
    generator = np.random.default_rng(seed)
    fastest, count = speed(mission), len(mission.agents)
    if not mission.graphs:
        raise Unsupported("there is no graph to agree over")
    position = np.empty((count, mission.steps + 1, mission.dimension))
    position[:, 0] = stand(mission, box(mission.agents[0].start), generator)
    middle = position[:, 0].mean(axis=0)
    place = position[:, 0] - middle
    reference = _reference(mission, kernel, middle, float(np.linalg.norm(place, axis=1).max()))
    for step in range(mission.steps):
        here = position[:, step]
        apart = (here - place)[None] - (here - place)[:, None]
        linked = cdist(here, here) < mission.graphs[0].radius
        ahead = (reference[step + 1] - reference[step]) / mission.step
        wanted = ahead + TRACK * (reference[step] + place - here) + AGREE * (apart * linked[:, :, None]).sum(axis=1)
        pace = np.linalg.norm(wanted, axis=1, keepdims=True)
        position[:, step + 1] = here + mission.step * wanted * np.minimum(
            1.0, fastest / np.maximum(pace, fastest / 1e3)
        )
    return trace(mission, position)


def _reference(mission: Mission, kernel: Kernel, start: Array, extent: float) -> Array:
    """Position of the team's centre at the steps, (steps + 1, dim), metres."""
    geodesics, body = Geodesics(mission), max(agent.radius for agent in mission.agents) + mission.clearance
    places = [start, *(np.mean([area.low, area.high], axis=0) for area in legs(mission, kernel)[1:])]
    ways = [geodesics.way(one, other, body + extent + ROOM, body + ROOM) for one, other in pairwise(places)]
    found = [way if way is not None else np.stack(pair) for way, pair in zip(ways, pairwise(places), strict=True)]
    lengths = [float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum()) for way in found]
    going = mission.steps - REST * len(found)
    ends = np.round(np.cumsum(lengths) / sum(lengths) * going).astype(int)
    reference = [start[None]]
    for way, first, last in zip(found, [0, *ends[:-1]], ends, strict=True):
        share = np.arange(1, last - first + 1) / max(1, last - first)
        reference += [at_shares(way, share), np.repeat(way[-1:], REST, axis=0)]
    return np.concatenate(reference)
