"""Resources and flags along motions: levels from step to step, and margins of flags.

Both are functions of an agent's own positions at the steps.
"""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Flag, Region, Resource
from missionc.world.signed_distance import signed_distance

BORDER = 5e-324
"""Less than anything measured: whoever is at the border of the region that clears a flag is in it."""


def levels(resource: Resource, trace: Trace) -> Array:
    """What every agent has left at every step: (agents, steps + 1); of one that has none of it, the start."""
    position = trace.position
    change = changes(resource, trace.step, position[:, :-1], position[:, 1:])
    found = np.full(position.shape[:2], resource.start)
    mine = list(resource.agents)
    for step in range(change.shape[1]):
        found[mine, step + 1] = np.minimum(resource.capacity, found[mine, step] + change[mine, step])
    return found


def changes(resource: Resource, step: float, begin: Array, end: Array) -> Array:
    """What motions within a step change it by, where its capacity does not stop them: (..., dim) twice -> (...).

    Args:
        step: seconds.
    """
    metres = np.linalg.norm(end - begin, axis=-1)
    change = np.asarray(-resource.per_second * step - resource.per_metre * metres)
    for refill in resource.refills:
        change = change + refill.per_second * step * (within(refill.region, begin) & within(refill.region, end))
    return change


def flag_margins(flag: Flag, trace: Trace) -> Array:
    """The margin of a flag at every step, (agents, steps + 1), metres; of agents that do not have it, ``-inf``.

    At a step it is the larger of how deep the agent is in the region that sets it, and the smaller of what the flag
    was worth a step before and of how far the agent is from the region that clears it.
    """
    position = trace.position
    found = np.full(position.shape[:2], -np.inf)
    mine = list(flag.agents)
    sets = -signed_distance(np, flag.set_in.shape, position[mine])
    cleared = flag.cleared_in
    stays = np.full_like(sets, np.inf)
    if cleared is not None:
        away = signed_distance(np, cleared.shape, position[mine])
        stays = np.where(away == 0, -BORDER, away)
    before = np.full(len(mine), -np.inf)
    for step in range(position.shape[1]):
        before = found[mine, step] = np.maximum(sets[:, step], np.minimum(before, stays[:, step]))
    return found


def flag_truths(flag: Flag, trace: Trace) -> Flags:
    """Whether every agent has the flag set at every step, (agents, steps + 1)."""
    return np.asarray(flag_margins(flag, trace) >= 0)


def within(region: Region, position: Array) -> Flags:
    """Whether places are in a region, whose border is in it: (..., dim) -> (...)."""
    return np.asarray(signed_distance(np, region.shape, position) <= 0)
