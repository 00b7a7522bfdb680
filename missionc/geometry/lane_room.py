"""Room on a roadmap of the user's own: which nodes and lanes an agent fits on, and which node a place is joined to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.geometry.clearance import ROUNDING, clear_of, solids, standing_solids
from missionc.geometry.dynamics import States, steer
from missionc.ir import Agent, Lanes, Mission, Obstacle, Shape, Still, Vector
from missionc.ir.distances.signed_distance import signed_distance

SAME = 1e-6
"""Metres: a place that near to a node is the node."""


def nodes_outside(mission: Mission, lanes: Lanes) -> list[int]:
    """The nodes whose place is not in the world."""
    places = positions(lanes)
    within = np.all((places >= mission.world.low) & (places <= mission.world.high), axis=1)
    return [int(node) for node in np.flatnonzero(~within)]


def nodes_blocked(mission: Mission, agent: Agent, lanes: Lanes) -> list[int]:
    """The nodes at which the agent is too near to an obstacle that stands still."""
    places = positions(lanes)
    return [int(node) for node in np.flatnonzero(~_clear(mission, agent, places, places))]


def lanes_blocked(mission: Mission, agent: Agent, lanes: Lanes) -> list[int]:
    """The lanes on which the agent comes too near to an obstacle that stands still."""
    places = positions(lanes)
    source, target = (np.array([getattr(lane, end) for lane in lanes.lanes], dtype=int) for end in ("source", "target"))
    return [int(lane) for lane in np.flatnonzero(~_clear(mission, agent, places[source], places[target]))]


def in_the_way(mission: Mission, agent: Agent, start: Vector, end: Vector) -> Obstacle:
    """The first obstacle that the agent comes too near to on a straight way that is not clear."""
    segment, margin = (np.array([start]), np.array([end])), np.array([_margin(mission, agent)])
    still = (obstacle for obstacle in mission.obstacles if isinstance(obstacle.motion, Still))
    return next(each for each in still if not clear_of(solids(each.shape), *segment, margin).all())


def nodes_within(lanes: Lanes, shape: Shape) -> list[int]:
    """The nodes in a shape, its border among it."""
    return [int(node) for node in np.flatnonzero(np.asarray(signed_distance(np, shape, positions(lanes))) <= 0)]


def joined_to(mission: Mission, agent: Agent, lanes: Lanes, place: Vector) -> int | None:
    """The nearest node that a straight clear way joins a place to, both ways; None where there is no such node."""
    places, here = positions(lanes), np.asarray(place)
    distance = np.linalg.norm(places - here, axis=1)
    able = _clear(mission, agent, np.broadcast_to(here, places.shape), places)
    still = np.zeros_like(places)
    start = States(np.broadcast_to(here, places.shape).copy(), still)
    count, _ = steer(agent.dynamics, start, States(places, still), mission.step, max(mission.steps, 1))
    able &= (count > 0) | (distance <= SAME)
    return int(np.argmin(np.where(able, distance, np.inf))) if able.any() else None


def positions(lanes: Lanes) -> Array:
    """Where the nodes are, (nodes, dim), metres."""
    return np.array([node.position for node in lanes.nodes], dtype=np.float64)


def _clear(mission: Mission, agent: Agent, start: Array, end: Array) -> Flags:
    return clear_of(standing_solids(mission), start, end, np.full(len(start), _margin(mission, agent)))


def _margin(mission: Mission, agent: Agent) -> float:
    """What its centre keeps from every obstacle, metres."""
    return agent.radius + mission.clearance - ROUNDING


def agents_by_kind(agents: Sequence[Agent]) -> list[Agent]:
    """One agent of each kind that a roadmap is made for: equal dynamics and radius."""
    return list({(agent.dynamics, agent.radius): agent for agent in reversed(agents)}.values())[::-1]
