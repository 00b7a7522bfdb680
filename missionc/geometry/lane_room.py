"""Clearance on a user's roadmap: nodes and lanes that fit an agent, and the node that a position joins.

Straight runs of a user's roadmap: consecutive lanes in one direction with one speed limit.

    in   Lanes
    out  the indices of the lanes of each run

An agent on such lanes need not be at a node at a step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.geometry.clearance import ROUNDING, clear_of, solids, standing_solids
from missionc.geometry.dynamics import States, steer
from missionc.ir import Agent, Lanes, Mission, Obstacle, Shape, Still, Vector
from missionc.ir.distances.signed_distance import signed_distance

SAME = 1e-6
"""Distance, metres, within which a position counts as a node."""


def nodes_outside(mission: Mission, lanes: Lanes) -> list[int]:
    """Indices of the roadmap nodes outside the world."""
    places = positions(lanes)
    within = np.all((places >= mission.world.low) & (places <= mission.world.high), axis=1)
    return [int(node) for node in np.flatnonzero(~within)]


def nodes_blocked(mission: Mission, agent: Agent, lanes: Lanes) -> list[int]:
    """Indices of the roadmap nodes at which the agent is too close to a static obstacle."""
    places = positions(lanes)
    return [int(node) for node in np.flatnonzero(~_clear(mission, agent, places, places))]


def lanes_blocked(mission: Mission, agent: Agent, lanes: Lanes) -> list[int]:
    """Indices of the lanes on which the agent comes too close to a static obstacle."""
    places = positions(lanes)
    source, target = (np.array([getattr(lane, end) for lane in lanes.lanes], dtype=int) for end in ("source", "target"))
    return [int(lane) for lane in np.flatnonzero(~_clear(mission, agent, places[source], places[target]))]


def in_the_way(mission: Mission, agent: Agent, start: Vector, end: Vector) -> Obstacle:
    """First static obstacle to which the agent comes too close on a blocked straight path."""
    segment, margin = (np.array([start]), np.array([end])), np.array([_margin(mission, agent)])
    still = (obstacle for obstacle in mission.obstacles if isinstance(obstacle.motion, Still))
    return next(each for each in still if not clear_of(solids(each.shape), *segment, margin).all())


def nodes_within(lanes: Lanes, shape: Shape) -> list[int]:
    """Indices of the roadmap nodes in a shape, including its border."""
    return [int(node) for node in np.flatnonzero(np.asarray(signed_distance(np, shape, positions(lanes))) <= 0)]


def joined_to(mission: Mission, agent: Agent, lanes: Lanes, place: Vector) -> int | None:
    """Index of the nearest roadmap node with a clear straight path to and from a position; None without such a node."""
    places, here = positions(lanes), np.asarray(place)
    distance = np.linalg.norm(places - here, axis=1)
    able = _clear(mission, agent, np.broadcast_to(here, places.shape), places)
    still = np.zeros_like(places)
    start = States(np.broadcast_to(here, places.shape).copy(), still)
    count, _ = steer(agent.dynamics, start, States(places, still), mission.step, max(mission.steps, 1))
    able &= (count > 0) | (distance <= SAME)
    return int(np.argmin(np.where(able, distance, np.inf))) if able.any() else None


def positions(lanes: Lanes) -> Array:
    """Positions of the roadmap nodes, (nodes, dim), metres."""
    return np.array([node.position for node in lanes.nodes], dtype=np.float64)


def _clear(mission: Mission, agent: Agent, start: Array, end: Array) -> Flags:
    return clear_of(standing_solids(mission), start, end, np.full(len(start), _margin(mission, agent)))


def _margin(mission: Mission, agent: Agent) -> float:
    """Required distance of the agent's centre from every obstacle, metres."""
    return agent.radius + mission.clearance - ROUNDING


def agents_by_kind(agents: Sequence[Agent]) -> list[Agent]:
    """Agents with distinct dynamics or radius, one for each combination; each needs its own roadmap."""
    return list({(agent.dynamics, agent.radius): agent for agent in reversed(agents)}.values())[::-1]


LONGEST = 8
"""Maximum number of lanes of a run, which bounds the number of runs from each node."""

ASIDE = 1e-9
"""Lateral deviation of a node from its run that counts as rounding error, metres."""


def straight_runs(lanes: Lanes) -> list[tuple[int, ...]]:
    """All runs of two to ``LONGEST`` lanes, as lane indices, with one speed limit and without minimum durations."""
    place = positions(lanes)
    way = [place[lane.target] - place[lane.source] for lane in lanes.lanes]
    leaving: dict[int, list[int]] = {}
    for number, lane in enumerate(lanes.lanes):
        if not lane.duration and lanes.length(lane) > 0:
            leaving.setdefault(lane.source, []).append(number)

    def straight_on(run: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        """Yield the run extended by each lane that continues it straight."""
        first, last = lanes.lanes[run[0]], lanes.lanes[run[-1]]
        ahead = place[last.target] - place[first.source]
        ahead = ahead / float((ahead @ ahead) ** 0.5)
        for number in leaving.get(last.target, []):
            along = float(way[number] @ ahead)
            aside = way[number] - along * ahead
            if lanes.lanes[number].speed == first.speed and along > 0 and float((aside @ aside) ** 0.5) <= ASIDE:
                yield (*run, number)

    runs: list[tuple[int, ...]] = []
    latest: list[tuple[int, ...]] = [(number,) for numbers in leaving.values() for number in numbers]
    for _ in range(LONGEST - 1):
        latest = [longer for run in latest for longer in straight_on(run)]
        runs += latest
    return runs
