"""Resources and flags along motions: levels from step to step, and margins of flags.

Both are functions of an agent's own positions at the steps.
"""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Flag, Region, Resource
from missionc.ir.distances.signed_distance import Array as AnyArray
from missionc.ir.distances.signed_distance import Namespace, distance_between, signed_distance

BORDER = 5e-324
"""Less than anything measured: whoever is at the border of the region that clears a flag is in it."""


def levels(resource: Resource, trace: Trace) -> Array:
    """What every agent has left at every step: (agents, steps + 1); of one that has none of it, the start."""
    found = np.full(trace.position.shape[:2], resource.start)
    mine = list(resource.agents)
    found[mine] = levels_along(np, resource, trace.step, trace.position[mine])
    return found


def levels_along(xp: Namespace, resource: Resource, step: float, position: AnyArray) -> AnyArray:
    """What is left along motions of agents that have the resource: (..., steps + 1, dim) -> (..., steps + 1).

    Args:
        xp: the array library ``position`` is of.
        step: seconds.
    """
    change = changes(resource, step, position[..., :-1, :], position[..., 1:, :], xp=xp)
    left = [0.0 * position[..., 0, 0] + resource.start]
    for number in range(change.shape[-1]):
        left.append(xp.clip(left[-1] + change[..., number], None, resource.capacity))
    return xp.stack(left, -1)


def changes(resource: Resource, step: float, begin: AnyArray, end: AnyArray, *, xp: Namespace = np) -> AnyArray:
    """What motions within a step change it by, where its capacity does not stop them: (..., dim) twice -> (...).

    Args:
        step: seconds.
    """
    change = -resource.per_second * step - resource.per_metre * distance_between(xp, begin, end)
    for refill in resource.refills:
        both = within(refill.region, begin, xp=xp) & within(refill.region, end, xp=xp)
        change = change + refill.per_second * step * both
    return change


def flag_margins(flag: Flag, trace: Trace) -> Array:
    """The margin of a flag at every step, (agents, steps + 1), metres; of agents that do not have it, ``-inf``."""
    found = np.full(trace.position.shape[:2], -np.inf)
    mine = list(flag.agents)
    found[mine] = flag_margins_along(np, flag, trace.position[mine])
    return found


def flag_margins_along(xp: Namespace, flag: Flag, position: AnyArray) -> AnyArray:
    """The margin of a flag along motions of agents that have it: (..., steps + 1, dim) -> (..., steps + 1), metres.

    At a step it is the larger of how deep the agent is in the region that sets it, and the smaller of what the flag
    was worth a step before and of how far the agent is from the region that clears it.
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
    """Whether every agent has the flag set at every step, (agents, steps + 1)."""
    return np.asarray(flag_margins(flag, trace) >= 0)


def within(region: Region, position: AnyArray, *, xp: Namespace = np) -> AnyArray:
    """Whether places are in a region, whose border is in it: (..., dim) -> (...)."""
    return signed_distance(xp, region.shape, position) <= 0
