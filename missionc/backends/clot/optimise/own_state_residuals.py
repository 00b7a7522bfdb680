"""Residual groups of own state: resource levels, and the steps that set and clear flags.

A flag is a choice: to have been in one region at some step, and outside another at every step since. The motion decides
it, like any disjunction, and it leaves margins of the two regions. A level depends on every position up to its step.
Nearby motions refill at the same steps, so a level changes only with the path length. Only its minima between refills
need residuals.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.cost_graph.motion_batch import velocities
from missionc.backends.clot.optimise.control_points import Splines
from missionc.backends.clot.optimise.residuals import Group
from missionc.backends.clot.settings import Spare, Weights
from missionc.base.trace import Array, Flags, Indices
from missionc.ir import Compare, Flag, Inside, Level, Mission, Predicate, Region, Resource
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.language.margins.resources import levels_along
from missionc.ir.language.margins.view import View


def flag_pieces(flag: Flag, holds: bool, mask: Flags, position: Array) -> Iterator[tuple[Predicate, bool, Flags]]:
    """Margins of regions, with agents and steps, (agents, steps), for a flag to be set, or unset.

    Args:
        mask: agents and steps of the condition, (agents, steps).
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
    """Distance outside a region for each place, (steps, dim) -> (steps,), metres.

    Infinite without a region.
    """
    if region is None:
        return np.full(len(position), np.inf)
    return np.asarray(signed_distance(np, region.shape, position))


def _since(depth: Array, away: Array, holds: bool) -> tuple[int | None, int]:
    """Best step inside the first region, and first step from which to be outside the second.

    Args:
        depth: depth in the first at each step so far, (steps,); ``away``: distance from the second, (steps,); metres.
        holds: True if a step in both counts for the first, which must have been visited.
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
    """Groups of a resource comparison at its minima, where it must hold or fail.

    Args:
        mask: agents and steps of the condition, (agents, steps).
        control: (agents, points, dim), metres.
    """
    sign = 1.0 if holds else -1.0
    position, _ = splines.states(control)
    everyone = np.flatnonzero(mask.any(axis=1))
    others = sorted(predicate.others)
    metres = torch.from_numpy(np.array([_metres(predicate, mission, agent) for agent in range(len(mask))]))

    def margins(agents: Indices, points: Tensor) -> Tensor:
        """Margins, (agents, steps), metres, along motions of agents and of others.

        Shape: (1 + others, agents, steps, dim).
        """
        measured = predicate.margin(_Histories(mission, agents, points, others))
        value: Tensor = sign * measured * metres[torch.from_numpy(agents)][:, None]
        return value

    whole = torch.from_numpy(position)
    with torch.no_grad():
        value = margins(
            everyone, torch.stack([whole[everyone], *(whole[each].expand(len(everyone), -1, -1) for each in others)])
        )
    row, step = np.nonzero(_least(np.where(mask[everyone], value.numpy(), np.inf)))
    if not row.size:
        return
    agent, count = everyone[row], int(step.max()) + 1
    read = [agent, *(np.full(len(agent), each) for each in others)]
    arguments = tuple(
        splines.position(who, np.full(len(who), each), np.zeros(len(who))) for who in read for each in range(count)
    )

    def shortfall(*points: Tensor) -> Tensor:
        stacked = torch.stack(points, dim=1).unflatten(1, (len(read), count)).transpose(0, 1)
        lacking: Tensor = spare.task - margins(agent, stacked)[torch.arange(len(agent)), torch.from_numpy(step)]
        return lacking

    names = ", ".join(dict.fromkeys(each.name for each in _resources(predicate)))
    yield Group(f"{'' if holds else 'not '}{names}", arguments, shortfall, weights.task, spare.task)


def _least(value: Array) -> Flags:
    """Flags of local minima of a value, (rows, steps), any unit; infinite values are excluded."""
    beside = np.pad(value, ((0, 0), (1, 1)), constant_values=np.inf)
    least: Flags = (value <= beside[:, :-2]) & (value <= beside[:, 2:]) & (value < np.inf)
    return least


def _resources(predicate: Compare) -> list[Resource]:
    return [feature.resource for _, feature in predicate.terms if isinstance(feature, Level)]


def _metres(predicate: Compare, mission: Mission, agent: int) -> float:
    """Metres at top speed that correspond to a unit of its margin."""
    if predicate.unit == "m":
        return 1.0
    fastest = mission.agents[agent].dynamics.top_speed
    used = max(each.per_metre + each.per_second / fastest for each in _resources(predicate))
    return 1.0 / used if used > 0 else 1.0


class _Histories(View):
    """Motions from the first step on, (agents, steps, dim), metres, each with the same others."""

    def __init__(self, mission: Mission, agents: Indices, points: Tensor, others: list[int]) -> None:
        super().__init__(torch, points.shape[-1])
        self.mission, self.agents, self.points, self.others = mission, agents.tolist(), points, others

    def own(self) -> Tensor:
        return self.points[0]

    def place(self, agent: int) -> Tensor:
        return self.points[1 + self.others.index(agent)]

    def velocity(self) -> Tensor:
        return velocities(self.points[0], self.mission.step)

    def plane(self) -> Tensor:
        altitude = [self.mission.agents[agent].altitude for agent in self.agents]
        return self.points.new_tensor(altitude)[:, None]

    def level(self, resource: Resource) -> Tensor:
        found: Tensor = levels_along(torch, resource, self.mission.step, self.points[0])
        return found
