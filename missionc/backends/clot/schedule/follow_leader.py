"""Follow the leader: agents in single file move along one route, each at a fixed distance behind the first.

in   Schedule, the agents' positions, the targets of some agents
out  route of every agent
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.visits import Schedule
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.geometry.polylines import at_lengths, length, lengths_to, part
from missionc.ir import FormationEdge
from missionc.ir.kernel.nodes import Atom


class File(Record):
    """Agents in single file, with each agent's distance from the previous agent, metres (for the first: 0)."""

    agents: tuple[int, ...]
    gaps: tuple[float, ...]

    @property
    def behind(self) -> Array:
        """Distance of each agent behind the first along the route, (agents,), metres."""
        total: Array = np.cumsum(self.gaps)
        return total

    @property
    def turned(self) -> File:
        """Same single file in reverse order."""
        return File(self.agents[::-1], (0.0, *self.gaps[:0:-1]))


class FormationSlot(Record):
    """Target of some agents of a single file.

    Args:
        holds: function from points, (points, dim), metres, to flags of the points in the target, (points,).
        nearest: function from a point to the point of the target with the shortest path to it, (dim,), metres.
        cells: flags of the geodesics' grid cells in the target, (cells,).
    """

    holds: Callable[[Array], Flags]
    nearest: Callable[[Array], Array]
    cells: Flags


def files(schedule: Schedule, low: int, high: int) -> list[File]:
    """Files of agents that formations require at every step from ``low`` to ``high``; no agent is in two of them."""
    found: list[File] = []
    for hold in schedule.holds:
        node = hold.node
        if isinstance(node, Atom) and node.predicate.formation and hold.low <= low and hold.high >= high:
            file = as_file(node.predicate.formation.edges)
            if file is not None and all(set(file.agents).isdisjoint(other.agents) for other in found):
                found.append(file)
    return found


def as_file(edges: Sequence[FormationEdge]) -> File | None:
    """File of agents whose formation edges are distances between consecutive agents; None for other edges."""
    beside: dict[int, dict[int, float]] = {}
    for edge in edges:
        if isinstance(edge.target, tuple):
            return None
        beside.setdefault(edge.first, {})[edge.second] = edge.target
        beside.setdefault(edge.second, {})[edge.first] = edge.target
    ends = [agent for agent, others in beside.items() if len(others) == 1]
    if len(ends) != 2 or len(beside) != len(edges) + 1:
        return None
    agents, gaps = [ends[0]], [0.0]
    while len(agents) < len(beside):
        onward = [(other, gap) for other, gap in beside[agents[-1]].items() if other not in agents[-2:]]
        if len(onward) != 1:
            return None
        agents.append(onward[0][0])
        gaps.append(onward[0][1])
    return File(tuple(agents), tuple(gaps))


def led(
    file: File,
    position: Array,
    asked: Sequence[int],
    place: FormationSlot,
    geodesics: Geodesics,
    room: float,
) -> dict[int, Array] | None:
    """Route of each agent of a single file, (corners, dim), metres, on which the last target agent reaches a target.

    The leader is the end of the file that is already at the target, or else the end with the shorter path. If it must
    continue beyond the target for the agents behind it, it turns as little as the clearance allows.

    Args:
        position: positions of all agents, (agents, dim), metres.
        asked: agents of the file that must reach the target.
        room: clearance of the route from static obstacles, metres.
    """
    best: tuple[tuple[bool, float], File, Array] | None = None
    for each in (file, file.turned):
        route = _leaders(each, position, asked, place, geodesics, room)
        if route is None:
            continue
        leader = position[each.agents[0]]
        rank = not place.holds(leader[None])[0], length(route)
        if best is None or rank < best[0]:
            best = rank, each, route
    if best is None:
        return None
    _, file, route = best
    trail = np.concatenate([position[list(file.agents[::-1])], route[1:]])
    reached = lengths_to(trail)
    now = reached[: len(file.agents)][::-1]
    later = reached[-1] - file.behind
    return {
        agent: part(trail, begin, max(begin, end)) for agent, begin, end in zip(file.agents, now, later, strict=True)
    }


def _leaders(
    file: File, position: Array, asked: Sequence[int], place: FormationSlot, geodesics: Geodesics, room: float
) -> Array | None:
    """Leader's route, (corners, dim), metres, on which the last target agent reaches the target; None without such a
    route."""
    count = 200  # points evaluated on the path from the last agent to the leader
    behind = dict(zip(file.agents, file.behind.tolist(), strict=True))
    last = max(asked, key=lambda agent: behind[agent])
    ahead = position[list(file.agents[: file.agents.index(last) + 1])][::-1]
    trail = lengths_to(ahead)
    samples = np.linspace(0.0, trail[-1], count)
    inside = np.flatnonzero(place.holds(at_lengths(ahead, trail, samples)))
    way = ahead[-2:]  # the file is already on its path there
    metres = float(samples[inside[0]]) if len(inside) else behind[last]
    if not len(inside):
        found = geodesics.way(ahead[-1], place.nearest(ahead[-1]), room, room)
        if found is None:
            return None
        way = found
    onward = _onward(way, metres, geodesics, room, place.cells if len(asked) > 1 else None) if metres else way[-1:]
    if onward is None:
        return None
    return onward if len(inside) else np.concatenate([way, onward[1:]])


def _onward(way: Array, metres: float, geodesics: Geodesics, room: float, within: Flags | None) -> Array | None:
    """Path of length ``metres`` that continues the path ``way``, (corners, dim), metres; None without such a path."""
    # Cost of a radian of the leader's turn beyond its goal, relative to a metre too far or too near; each as a share of
    # the additional path.
    turns = 0.5
    end = way[-1]
    before = way[-2] if len(way) > 1 else end
    heading = (end - before) / max(float(np.linalg.norm(end - before)), 1e-9)
    points = geodesics.points.reshape(-1, len(end))
    free = geodesics.room.ravel() >= room
    if within is not None:
        free &= within
    far = np.linalg.norm(points - end, axis=1)
    cosine = (points - end) @ heading / np.maximum(far, 1e-9)
    cost = np.where(free, np.abs(far - metres) / metres + turns * np.arccos(np.clip(cosine, -1.0, 1.0)), np.inf)
    target = int(cost.argmin())
    if not np.isfinite(cost[target]):
        return None
    onward = geodesics.way(end, points[target], room, room)
    if onward is None or length(onward) == 0:
        return None
    reached = lengths_to(onward)[-1]
    if reached >= metres:
        return part(onward, 0.0, metres)
    direction = (onward[-1] - onward[-2]) / float(np.linalg.norm(onward[-1] - onward[-2]))
    return np.concatenate([onward, (onward[-1] + direction * (metres - reached))[None]])  # straight continuation
