"""Colliding moves: pairs of roadmap moves that bring two agents' centres too close to each other."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from missionc.backends.smt.refine.collisions import CUSHION, metric, needed
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.trace import Indices
from missionc.geometry.relative_motion import closest_approach
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission


def colliding_moves(mission: Mission, one: Roadmap, other: Roadmap) -> Indices:
    """Pairs of moves, (pairs, 2), one of each roadmap, that two agents cannot make in one step.

    Each roadmap has one agent with first-order dynamics. The required distance is the same as in ``collisions``.
    """
    agents = np.array([one.agents[0], other.agents[0]])
    first, second = (roadmap.motions(mission) for roadmap in (one, other))
    fastest = sum(mission.agents[agent].dynamics.top_speed for agent in agents.tolist())
    reach = SpacingTable.of(mission).widest + CUSHION + fastest * mission.step
    near = cKDTree(first.position).sparse_distance_matrix(cKDTree(second.position), reach, output_type="coo_matrix")
    row, column = near.row.astype(np.int64), near.col.astype(np.int64)
    factors = metric(agents[0], agents[1], mission)
    nearest = closest_approach(first.take(row), second.take(column), mission.step, factors)
    closer = nearest < needed(agents[0], agents[1], mission)
    return np.stack([row[closer], column[closer]], axis=1)
