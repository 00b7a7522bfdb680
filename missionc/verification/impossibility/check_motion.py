"""Checks of an impossibility certificate's claims about space and motion: no possible trajectory is excluded.

in   Mission, its kernel, ClaimedCover
out  descriptions of the unproved claims

Every bound includes the tolerances of plan verification. A trajectory is followed from cell to cell: at each time, an
agent is in a cell with volume, or at its start or finish point.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.ir import Agent, Compare, Dynamics, InitialSet, Level, Mission, Speed
from missionc.ir.dynamics import at_most
from missionc.ir.kernel.nodes import Atom, Goal
from missionc.ir.kernel.walk import Conjunct, conjuncts
from missionc.verification.certificate import MOTION
from missionc.verification.impossibility.bodies import blocked
from missionc.verification.impossibility.cover_document import CellsOfKind, ClaimedCover, Unreadable
from missionc.verification.impossibility.intervals import (
    Boxes,
    Interval,
    between,
    length,
    pairwise,
    signed_distances,
)

Numbers = NDArray[np.int64]

MOST_GAPS = 100_000_000
"""Maximum number of grid boxes, between the faces of all cells, for which coverage is checked."""


class MotionLimits(Record, eq=False):
    """Limits of an agent's trajectory that follow from the mission and the conflicting requirements.

    ``dynamics`` has the limits for every step; ``length``, metres, is the maximum path length.
    """

    dynamics: Dynamics
    length: float


def limits_of(mission: Mission, goals: tuple[Goal, ...]) -> tuple[MotionLimits, ...]:
    """Limits of each agent's trajectory, from its dynamics and from the goals that always limit its speed or path
    length.
    """
    speed = [math.inf] * len(mission.agents)
    far = [math.inf] * len(mission.agents)
    for each in conjuncts(goal.formula for goal in goals):
        if each.agent is None or not _always(each, mission) or not isinstance(each.formula, Atom):
            continue
        match each.formula.predicate:
            case Compare(((weight, Speed()),), constant) if weight < 0:
                speed[each.agent] = min(speed[each.agent], max(0.0, -constant / weight))
            case Compare(((weight, Level(resource)),), constant) if weight > 0 and resource.per_metre > 0:
                if each.agent in resource.agents and not resource.refills and resource.per_second >= 0:
                    least = -constant / weight
                    far[each.agent] = min(far[each.agent], max(0.0, (resource.start - least) / resource.per_metre))
            case _:
                pass
    return tuple(
        MotionLimits(at_most(agent.dynamics, speed[agent.index], math.inf), far[agent.index])
        for agent in mission.agents
    )


def _always(each: Conjunct, mission: Mission) -> bool:
    steps = each.steps
    return steps is not None and steps.start == 0 and (steps.stop is None or steps.stop > mission.steps)


def inflated(kind: CellsOfKind) -> Boxes:
    """Corners of the cells, (cells, dim) twice, metres, with single points enlarged by the tolerance of exact
    positions.
    """
    low, high = (corner.copy() for corner in kind.boxes)
    first = len(kind) - kind.points
    low[first:] -= MOTION
    high[first:] += MOTION
    return low, high


def check_space(mission: Mission, cover: ClaimedCover, kind: CellsOfKind) -> Iterator[str]:
    """Yield a message for each part of the world outside all cells and excluded boxes.

    Also report each excluded box in which a body's centre may be clear of obstacles.
    """
    agents = [mission.agents[agent] for agent in kind.agents]
    first = agents[0]
    if any(
        (each.dynamics, each.radius, each.altitude) != (first.dynamics, first.radius, first.altitude) for each in agents
    ):
        yield "its agents are not of one kind"
    room = np.zeros(len(kind.left_out[0]), dtype=np.bool_)
    for number, obstacle in enumerate(mission.obstacles):
        if obstacle.constant:
            room |= blocked(mission, cover, number, float(first.radius), 0, kind.left_out)
    for box in np.flatnonzero(~room).tolist():
        begin, end = (_at(corners[box]) for corners in kind.left_out)
        yield f"a centre may be free in the excluded box from {begin} to {end}"
    cells = len(kind) - kind.points
    boxes = tuple(np.concatenate([kind.boxes[side][:cells], kind.left_out[side]]) for side in (0, 1))
    hole = _hole(np.array(mission.world.low) - MOTION, np.array(mission.world.high) + MOTION, (boxes[0], boxes[1]))
    if hole is not None:
        yield f"no cell contains {_at(hole)}"


def _hole(low: Array, high: Array, boxes: Boxes) -> Array | None:
    """Some point between two corners that no box contains, (dim,), metres; None if the boxes cover everything.

    Raises:
        Unreadable: there are too many boxes.
    """
    lines = [
        np.unique(
            np.clip(
                np.concatenate([[low[axis], high[axis]], boxes[0][:, axis], boxes[1][:, axis]]), low[axis], high[axis]
            )
        )
        for axis in range(len(low))
    ]
    if math.prod(map(len, lines)) > MOST_GAPS:
        raise Unreadable("its cells have too many sides to check")
    held = np.zeros([len(each) - 1 for each in lines], dtype=np.bool_)
    for begin, end in zip(*boxes, strict=True):
        held[tuple(slice(*np.searchsorted(each, (begin[axis], end[axis]))) for axis, each in enumerate(lines))] = True
    if held.all():
        return None
    gap = np.argwhere(~held)[0]
    return np.array([(each[number] + each[number + 1]) / 2 for each, number in zip(lines, gap, strict=True)])


def check_absent(mission: Mission, cover: ClaimedCover, agent: Agent, limits: MotionLimits) -> Iterator[str]:
    """Yield a message for each cell and step at which an agent is claimed absent without proof.

    The proof uses obstacles, start and finish first, then distances.
    """
    absent = cover.absent[agent.index]
    boxes = inflated(cover.kind_of(agent.index))
    shown = _shown_at_once(mission, cover, agent)
    steps = np.arange(mission.steps + 1)
    ends = [~(absent[row] & shown[row]) for row in (0, mission.steps)]
    for able, away in zip(ends, (steps, steps[::-1]), strict=True):
        reach = np.array([reached(limits.dynamics, mission.step, each) for each in away.tolist()])
        shown |= _from(boxes, able)[None, :] > reach[:, None]
    for step, cell in np.argwhere(absent & ~shown)[:1].tolist():
        yield f"{agent.name} may be in cell {cell} at step {step}"


def _shown_at_once(mission: Mission, cover: ClaimedCover, agent: Agent) -> Flags:
    """Flags of cells from which an agent is absent by obstacles, start or finish, or which another cell represents.

    Shape: (steps + 1, cells), boolean.
    """
    kind, absent = cover.kind_of(agent.index), cover.absent[agent.index]
    boxes = inflated(kind)
    shown: Flags = np.zeros(absent.shape, dtype=np.bool_)
    shown[:, len(kind) - kind.points :] = True  # the cells around a point represent it
    for place, row in ((agent.start, 0), (agent.finish, mission.steps)):
        if place is not None:
            shown[row] |= _away(place, boxes).low > 3 * MOTION
        if place is not None and place.point is not None:
            low, high = np.array(place.point) - MOTION, np.array(place.point) + MOTION
            holds = np.all((boxes[0] <= low) & (boxes[1] >= high), axis=1)
            shown[row] |= bool((holds & ~absent[row]).any())
    for number, obstacle in enumerate(mission.obstacles):
        for step in range(mission.steps + 1) if not obstacle.constant else (0,):
            within = blocked(mission, cover, number, float(agent.radius), step, boxes)
            shown[slice(None) if obstacle.constant else step] |= within
    return shown


def _away(place: InitialSet, boxes: Boxes) -> Interval:
    """Interval of the distance between points of boxes and the agent's start or finish, metres."""
    if place.point is None:
        return signed_distances(place.shape, boxes)
    at = np.array(place.point)
    return length(between((at, at), boxes))


def _from(boxes: Boxes, cells: Flags) -> Array:
    """Minimum distance of each box from the boxes selected by ``cells``: (boxes,), metres."""
    some = boxes[0][cells], boxes[1][cells]
    least: Array = length(between(*pairwise(some, boxes))).low.min(axis=0, initial=np.inf)
    return least


def reached(dynamics: Dynamics, step: float, steps: int) -> float:
    """Upper bound on the distance travelled in ``steps`` steps, metres, including the tolerance of each step."""
    return (dynamics.top_speed + MOTION) * steps * step + (steps + 3) * MOTION


def gone(dynamics: Dynamics, step: float, steps: int, dimension: int) -> float:
    """Lower bound on the distance between positions ``steps`` steps apart, metres.

    Agents with a minimum speed have a positive bound; in three dimensions only for one step.
    """
    if dynamics.has_momentum or dynamics.lowest_speed <= 0 or (steps > 1 and dimension > 2):
        return 0.0
    way = (dynamics.lowest_speed - MOTION) * step - 3 * MOTION
    if way <= 0:
        return 0.0
    aside = MOTION / way  # rad, greatest difference between path and heading
    return way * _scaled_turn(steps, dynamics.top_turn * step + MOTION + 3 * aside)


def _scaled_turn(steps: int, turn: float) -> float:
    """Minimum distance between positions ``steps`` steps apart on a path with bounded turns, as a multiple of one step.

    Args:
        turn: bound on the turn between two steps, rad.

    Source:
        Schur's comparison theorem: of two convex polygonal paths, the one with smaller turns has its ends further
        apart.
    """
    if steps == 1:
        return 1.0
    if (steps - 1) * turn >= math.pi:
        return 0.0
    return math.sin(steps * turn / 2) / math.sin(turn / 2)


def check_moves(mission: Mission, kind: CellsOfKind, limits: MotionLimits) -> Iterator[str]:
    """Yield a message for each move between cells that is claimed impossible although some trajectory may make it."""
    boxes = inflated(kind)
    distance = length(between(*pairwise(boxes, boxes)))
    touching = distance.low <= 0.0
    for steps, never in kind.no_move.items():
        most = reached(limits.dynamics, mission.step, steps)
        least = gone(limits.dynamics, mission.step, steps, mission.dimension)
        doubtful = never & (distance.low <= most) & (distance.high >= least)
        for source in np.flatnonzero(doubtful.any(axis=1)).tolist():
            targets = np.flatnonzero(doubtful[source])
            joined = _joined(distance.low, touching, source, targets, most)
            for target in targets[joined][:1].tolist():
                yield f"cell {target} may be reached from cell {source} in {steps} steps"
                return


def _joined(distance: Array, touching: Flags, source: int, targets: Numbers, most: float) -> Flags:
    """Flags of targets that a chain of touching cells connects to the source within the distance limit.

    Shape: (targets,), boolean.

    Args:
        distance: minimum distances between cells, (cells, cells), metres.
        most: limit of the distance from the source over a cell of the chain to the target, metres.
    """
    allowed = distance[source][None, :] + distance[targets] <= most
    found: Flags = np.zeros(len(targets), dtype=np.bool_)
    for number, (target, able) in enumerate(zip(targets.tolist(), allowed, strict=True)):
        new, seen = np.zeros(len(able), dtype=np.bool_), np.zeros(len(able), dtype=np.bool_)
        new[source] = True
        while new.any() and not seen[target]:
            seen |= new
            new = touching[new].any(axis=0) & able & ~seen
        found[number] = seen[target]
    return found


def check_turns(mission: Mission, kind: CellsOfKind, limits: MotionLimits) -> Iterator[str]:
    """Yield a message for each turn, a triple of cells, that is claimed impossible although the acceleration bound
    allows it.
    """
    boxes = inflated(kind)
    low, high = boxes
    top = limits.dynamics.top_acceleration
    for steps, never in kind.no_turn.items():
        bend = (top + MOTION) * (steps * mission.step) ** 2 + (2 * steps + 2) * MOTION
        bent = []
        for axis in range(mission.dimension):
            side = Interval(low[:, axis], high[:, axis])
            once = Interval(side.low[:, None, None], side.high[:, None, None])
            twice = Interval(-2 * side.high[None, :, None], -2 * side.low[None, :, None])
            bent.append(once + twice + Interval(side.low[None, None, :], side.high[None, None, :]))
        for cells in np.argwhere(never & (length(bent).low <= bend))[:1].tolist():
            yield f"cells {cells} may be visited in order, {steps} steps apart"


def check_visits(mission: Mission, cover: ClaimedCover, agent: Agent, limits: MotionLimits) -> Iterator[str]:
    """Yield a message for each pair of cells claimed never visited by one agent although a path over both is short
    enough.
    """
    never = cover.not_both[agent.index]
    boxes = inflated(cover.kind_of(agent.index))
    first = _from(boxes, ~cover.absent[agent.index][0])
    most = min(reached(limits.dynamics, mission.step, mission.steps), limits.length + mission.steps * 3 * MOTION)
    way = np.minimum(first[:, None], first[None, :]) + length(between(*pairwise(boxes, boxes))).low
    for one, other in np.argwhere(never & (way <= most))[:1].tolist():
        yield f"{agent.name} may be both in cell {one} and in cell {other}"


def _at(point: Array) -> str:
    return f"({', '.join(f'{value:.6g}' for value in point)})"
