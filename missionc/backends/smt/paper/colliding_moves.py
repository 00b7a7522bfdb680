"""Colliding moves: the moves of two agents that bring their centres too near each other."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from missionc.backends.smt.refine.collisions import CUSHION, metric, needed
from missionc.backends.smt.roadmap.roadmap import Indices, Roadmap
from missionc.geometry.clearance import Motions
from missionc.geometry.dynamics import States, motion_of
from missionc.geometry.relative_motion import closest_approach
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission


def colliding_moves(mission: Mission, one: Roadmap, other: Roadmap) -> Indices:
    """Pairs of moves, (pairs, 2), one of each roadmap, that two agents cannot make in one step.

    The roadmaps are of one agent each, with dynamics of first order. Too near is what it is to ``collisions``.
    """
    agents = np.array([one.agents[0], other.agents[0]])
    first, second = (_motions(mission, roadmap) for roadmap in (one, other))
    fastest = sum(mission.agents[agent].dynamics.top_speed for agent in agents.tolist())
    reach = SpacingTable.of(mission).widest + CUSHION + fastest * mission.step
    near = cKDTree(first.position).sparse_distance_matrix(cKDTree(second.position), reach, output_type="coo_matrix")
    row, column = near.row, near.col
    still = np.zeros((len(row), mission.dimension))
    nearest = closest_approach(
        first.position[row],
        first.velocity[row],
        still,
        second.position[column],
        second.velocity[column],
        still,
        mission.step,
        metric(agents[0], agents[1], mission),
    )
    closer = nearest < needed(agents[0], agents[1], mission)
    return np.stack([row[closer], column[closer]], axis=1)


def _motions(mission: Mission, roadmap: Roadmap) -> Motions:
    states, dynamics = States(roadmap.position, roadmap.velocity), mission.agents[roadmap.agents[0]].dynamics
    source, target = roadmap.moves.T
    return Motions(*motion_of(dynamics, states.take(source), states.take(target), mission.step))
