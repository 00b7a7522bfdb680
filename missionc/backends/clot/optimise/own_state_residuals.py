"""Residual groups of own state: resource levels, and the steps that set and clear flags.

A flag implies a choice: to have been in one region at some step, and outside another at every later step. The values
decide the choice, as for any disjunction, and margins of the two regions result. A level depends on every position up
to its step. Nearby trajectories refill at the same steps, so a level changes only with the path length. Only its minima
between refills need residuals.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missionc.backends.clot.optimise.control_points import Splines
from missionc.backends.clot.optimise.dual_numbers import Dual, variables
from missionc.backends.clot.optimise.residuals import Group
from missionc.backends.clot.settings import Spare, Weights
from missionc.base.trace import Array, Flags, Indices, Trace
from missionc.ir import Compare, Flag, Inside, Level, Mission, Predicate, Region, Resource
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.language.margins.predicate_margins import AlongTrace
from missionc.ir.language.margins.resources import changes, levels_along
from missionc.ir.language.margins.view import View


def flag_pieces(flag: Flag, holds: bool, mask: Flags, position: Array) -> Iterator[tuple[Predicate, bool, Flags]]:
    """Yield region predicates that imply a flag to be set (or unset), with the agents and steps at which they must be
    true.

    Args:
        mask: agents and steps at which the flag must be set or unset, (agents, steps).
        position: (agents, steps, dim), metres.
    """
    inside, outside = (np.zeros_like(mask) for _ in range(2))
    first, last = (flag.set_in, flag.cleared_in) if holds else (flag.cleared_in, flag.set_in)
    for agent in set(np.flatnonzero(mask.any(axis=1)).tolist()) & set(flag.agents):
        depth = -_outside(first, position[agent])
        away = _outside(last, position[agent])
        for step in np.flatnonzero(mask[agent]):
            begin, free = _since(depth[: step + 1], away[: step + 1], holds)
            if begin is not None:
                inside[agent, begin] = True
            outside[agent, free : step + 1] = True
    for region, within, where in ((first, True, inside), (last, False, outside)):
        if region is not None and where.any():
            yield Inside(region, False), within, where


def _outside(region: Region | None, position: Array) -> Array:
    """Signed distance of positions to a region: (steps, dim), metres -> (steps,), metres; infinite without a region."""
    if region is None:
        return np.full(len(position), np.inf)
    return np.asarray(signed_distance(np, region.shape, position))


def _since(depth: Array, away: Array, holds: bool) -> tuple[int | None, int]:
    """Best step inside the first region, and first step from which to be outside the second.

    Args:
        depth: depth in the first region at each step so far, (steps,), metres.
        away: distance from the second region, (steps,), metres.
        holds: True if a step in both regions counts for the first, which must have been visited.
    """
    kept = np.minimum.accumulate(away[::-1])[::-1]
    after = np.append(kept[1:], np.inf) if holds else kept
    worth = np.minimum(depth, after)
    best = int(len(worth) - 1 - worth[::-1].argmax())
    if not holds and kept[0] >= worth[best]:
        return None, 0
    return best, best + holds


def level_groups(
    predicate: Compare,
    holds: bool,
    mask: Flags,
    control: Array,
    mission: Mission,
    splines: Splines,
    weights: Weights,
    spare: Spare,
) -> Iterator[Group]:
    """Yield the residual groups of a resource comparison that must be true (or false), at the minima of its margin.

    Args:
        mask: agents and steps of the condition, (agents, steps).
        control: (agents, points, dim), metres.
    """
    sign, dim = 1.0 if holds else -1.0, mission.dimension
    position, velocity = splines.states(control)
    others = sorted(predicate.others)
    metres = np.array([_metres(predicate, mission, agent) for agent in range(len(mask))])
    motion = Trace(mission.step, position, velocity, np.zeros(position.shape[:2]))
    value = sign * predicate.margin(AlongTrace(mission, motion)) * metres[:, None]
    agent, step = np.nonzero(_least(np.where(mask, value, np.inf)))
    if not agent.size:
        return
    row, count = np.arange(len(agent)), int(step.max()) + 1
    read = [agent, *(np.full(len(agent), each) for each in others)]
    arguments = tuple(
        splines.position(who, np.full(len(who), each), np.zeros(len(who))) for who in read for each in range(count)
    )
    here = [number * count + step for number in range(len(read))]
    ahead = np.minimum(step + 1, count - 1)
    behind = np.maximum(ahead - 1, 0)

    def shortfall(*points: Array) -> Dual:
        path = np.stack(points, axis=1)
        levels = [_level(each, mission.step, path[:, :count], step) for each in _resources(predicate)]
        moved = (path[row, ahead] - path[row, behind]) / mission.step
        state = np.concatenate([*(path[row, each] for each in here), moved, *(each[:, None] for each, _ in levels)], 1)
        (known,) = variables([state])
        value = spare.task - sign * predicate.margin(_Moment(mission, agent, others, predicate, known)) * metres[agent]
        slopes = value.partials.T
        gradient = np.zeros(path.shape)
        for number, each in enumerate(here):
            gradient[row, each] += slopes[:, number * dim : (number + 1) * dim]
        of_velocity = slopes[:, len(read) * dim : (len(read) + 1) * dim] / mission.step
        gradient[row, ahead] += of_velocity
        gradient[row, behind] -= of_velocity
        for number, (_, of_path) in enumerate(levels, start=(len(read) + 1) * dim):
            gradient[:, :count] += slopes[:, number, None, None] * of_path
        return Dual(value.value, gradient.reshape(len(row), -1).T)

    names = ", ".join(dict.fromkeys(each.name for each in _resources(predicate)))
    yield Group(f"{'' if holds else 'not '}{names}", arguments, shortfall, weights.task, spare.task, True)


def _level(resource: Resource, step: float, path: Array, at: Indices) -> tuple[Array, Array]:
    """Level of a resource at a step of each path, (rows,), and its gradient by the path, (rows, steps, dim).

    Args:
        step: seconds.
        path: (rows, steps, dim), metres.
        at: (rows,), the step.
    """
    rows, count, dim = path.shape
    ends = variables([path[:, :-1].reshape(-1, dim), path[:, 1:].reshape(-1, dim)])
    change = changes(resource, step, *ends)
    levels = levels_along(np, resource, step, path)
    before = np.arange(count - 1) < at[:, None]
    full = before & (levels[:, :-1] + change.value.reshape(rows, -1) > resource.capacity)
    counts = before & ~np.logical_or.accumulate(full[:, ::-1], axis=1)[:, ::-1]
    begin, end = change.partials.reshape(2, dim, rows, count - 1).transpose(0, 2, 3, 1) * counts[..., None]
    gradient = np.zeros(path.shape)
    gradient[:, :-1] += begin
    gradient[:, 1:] += end
    return levels[np.arange(rows), at], gradient


def _least(value: Array) -> Flags:
    """Return true at each local minimum of a value, (rows, steps), any unit; infinite values are excluded."""
    beside = np.pad(value, ((0, 0), (1, 1)), constant_values=np.inf)
    least: Flags = (value <= beside[:, :-2]) & (value <= beside[:, 2:]) & (value < np.inf)
    return least


def _resources(predicate: Compare) -> list[Resource]:
    return [feature.resource for _, feature in predicate.terms if isinstance(feature, Level)]


def _metres(predicate: Compare, mission: Mission, agent: int) -> float:
    """Metres at top speed that correspond to a unit of the predicate's margin."""
    if predicate.unit == "m":
        return 1.0
    fastest = mission.agents[agent].dynamics.top_speed
    used = max(each.per_metre + each.per_second / fastest for each in _resources(predicate))
    return 1.0 / used if used > 0 else 1.0


class _Moment(View):
    """One step of some agents: own position, others' positions, own velocity, then levels, (rows, variables)."""

    def __init__(self, mission: Mission, agents: Indices, others: list[int], read: Compare, known: Dual) -> None:
        super().__init__(np, mission.dimension)
        self.known, self.others, self.resources = known, others, _resources(read)
        self.altitude_of_each = np.array([mission.agents[agent].altitude for agent in agents.tolist()])

    def own(self) -> Dual:
        return self._part(0)

    def place(self, agent: int) -> Dual:
        return self._part(1 + self.others.index(agent))

    def velocity(self) -> Dual:
        return self._part(1 + len(self.others))

    def plane(self) -> Array:
        return self.altitude_of_each

    def level(self, resource: Resource) -> Dual:
        return self.known[:, self.resources.index(resource) - len(self.resources)]

    def _part(self, number: int) -> Dual:
        return self.known[:, number * self.dimension : (number + 1) * self.dimension]
