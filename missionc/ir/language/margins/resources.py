"""Resource levels and flag margins along trajectories.

Both depend on the agent's own positions at the steps only.
"""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Flag, Region, Resource
from missionc.ir.distances.signed_distance import Array as AnyArray
from missionc.ir.distances.signed_distance import Namespace, distance_between, signed_distance

BORDER = 5e-324
"""Positive number, metres, below any distance: an agent on the border of the clearing region counts as inside."""


def levels(resource: Resource, trace: Trace) -> Array:
    """Level of a resource for every agent at every step, in the resource's unit: (agents, steps + 1).

    Agents without the resource have the initial level.
    """
    found = np.full(trace.position.shape[:2], resource.start)
    mine = list(resource.agents)
    found[mine] = levels_along(np, resource, trace.step, trace.position[mine])
    return found


def levels_along(xp: Namespace, resource: Resource, step: float, position: AnyArray) -> AnyArray:
    """Levels of a resource along trajectories of agents that have the resource.

    Shape: (..., steps + 1, dim), metres -> (..., steps + 1), the resource's unit.

    Args:
        xp: array library of ``position``.
        step: duration of a step, seconds.
    """
    change = changes(resource, step, position[..., :-1, :], position[..., 1:, :], xp=xp)
    left = [0.0 * position[..., 0, 0] + resource.start]
    for number in range(change.shape[-1]):
        left.append(xp.clip(left[-1] + change[..., number], None, resource.capacity))
    return xp.stack(left, -1)


def changes(resource: Resource, step: float, begin: AnyArray, end: AnyArray, *, xp: Namespace = np) -> AnyArray:
    """Change of a resource during motions of one step, before the capacity limits the level.

    Shape: (..., dim) twice, metres -> (...), the resource's unit.

    Args:
        step: duration of a step, seconds.
    """
    change = -resource.per_second * step - resource.per_metre * distance_between(xp, begin, end)
    for refill in resource.refills:
        both = within(refill.region, begin, xp=xp) & within(refill.region, end, xp=xp)
        change = change + refill.per_second * step * both
    return change


def flag_margins(flag: Flag, trace: Trace) -> Array:
    """Margin of a flag for every agent at every step, (agents, steps + 1), metres; ``-inf`` for agents without the
    flag."""
    found = np.full(trace.position.shape[:2], -np.inf)
    mine = list(flag.agents)
    found[mine] = flag_margins_along(np, flag, trace.position[mine])
    return found


def flag_margins_along(xp: Namespace, flag: Flag, position: AnyArray) -> AnyArray:
    """Margin of a flag along trajectories of agents that have the flag.

    Shape: (..., steps + 1, dim), metres -> (..., steps + 1), metres.

    The margin at a step is the maximum of two values: the agent's depth in the setting region, and the minimum of
    previous margin and distance from the clearing region.
    """
    sets = -signed_distance(xp, flag.set_in.shape, position)
    margins = [sets[..., 0]]
    if flag.cleared_in is None:
        for number in range(1, sets.shape[-1]):
            margins.append(xp.maximum(sets[..., number], margins[-1]))
        return xp.stack(margins, -1)
    away = signed_distance(xp, flag.cleared_in.shape, position)
    stays = xp.where(away == 0, -BORDER, away)
    for number in range(1, sets.shape[-1]):
        margins.append(xp.maximum(sets[..., number], xp.minimum(margins[-1], stays[..., number])))
    return xp.stack(margins, -1)


def flag_truths(flag: Flag, trace: Trace) -> Flags:
    """Truth of a flag for every agent at every step, (agents, steps + 1), boolean."""
    return np.asarray(flag_margins(flag, trace) >= 0)


def within(region: Region, position: AnyArray, *, xp: Namespace = np) -> AnyArray:
    """Return true for each point in a closed region: (..., dim), metres -> (...), boolean."""
    return signed_distance(xp, region.shape, position) <= 0
