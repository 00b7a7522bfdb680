"""Time scaling of a plan: the same paths in more steps of the same duration.

in   the Mission with a later horizon, the Trace of a plan up to an earlier horizon
out  Trace over the whole mission, not verified
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import block_diag, csc_array, eye_array, hstack, vstack
from scipy.sparse.linalg import splu

from missionc.base.trace import Array, Trace
from missionc.ir import Mission

STILL = 1e-9
"""Distance (metres) or speed (m/s) below which the heading of an agent does not change."""
ON_STEP = 1e-9
"""Fraction of a step within which a time counts as a step of the plan."""


def slowed(mission: Mission, trace: Trace) -> Trace:
    """Time-scaled trace: at each time ``t``, the position of the plan at ``t / s``, with ``s`` the ratio of durations.

    First-order agents move straight in between: along the plan's own segments if ``s`` is an integer, otherwise across
    its corners. Double integrators follow the plan's velocities, divided by ``s``, as closely as constant accelerations
    in between allow.
    """
    fewer = trace.position.shape[1] - 1
    place = np.arange(mission.steps + 1) * (fewer / mission.steps)
    before = np.minimum(np.floor(place + ON_STEP), fewer - 1).astype(np.int64)
    share = np.clip(place - before, 0.0, 1.0)
    share[np.abs(share - np.rint(share)) <= ON_STEP] = np.rint(share)[np.abs(share - np.rint(share)) <= ON_STEP]
    position, velocity = _between(trace.position, before, share), _between(trace.velocity, before, share)
    flown = np.diff(position, axis=1) / trace.step
    flown = np.concatenate([flown, flown[:, -1:]], axis=1)
    for agent in mission.agents:
        if agent.dynamics.has_momentum:
            own = velocity[agent.index] * (fewer / mission.steps)
            bend = trace.velocity[agent.index, before + 1] - trace.velocity[agent.index, before]
            # Its place under the step's constant acceleration, and not on the chord.
            bulge = bend * (share * (share - 1) / 2 * trace.step)[:, None]
            position[agent.index], flown[agent.index] = _pushed(position[agent.index] + bulge, own, trace.step)
    return Trace(trace.step, position, flown, _headings(trace, before, flown))


def _between(states: Array, before: Array, share: Array) -> Array:
    """Linear interpolation between consecutive states, exact at fractions 0 and 1: (agents, steps + 1, dim), metres.

    Args:
        before: index of the earlier state, (steps + 1,); ``share``: fraction of the time from the earlier to the later
            state.
    """
    start, end = states[:, before], states[:, before + 1]
    return np.where(share[:, None] == 1, end, start + share[:, None] * (end - start))


def _pushed(position: Array, velocity: Array, step: float) -> tuple[Array, Array]:
    """Nearest states that constant accelerations connect, with the same first and last state.

    Shape: (steps + 1, dim) twice, metres and m/s.

    One sparse linear system gives the least corrections ``q`` of the positions and ``w`` of the velocities; the size of
    ``w`` is that of its accelerations.
    """
    last = len(position) - 1
    drift = np.diff(position, axis=0) - (velocity[1:] + velocity[:-1]) * (step / 2)
    if last < 2 or np.abs(drift).max() <= STILL * step:
        return position, velocity
    # q: (last - 1) inner positions, w: (last - 1) inner velocities times the step; both are 0 at the ends.
    inner = last - 1
    ahead, behind = eye_array(last, inner), eye_array(last, inner, k=-1)
    rise = csc_array(ahead - behind)
    join = csc_array(hstack([rise, (ahead + behind) * -0.5]))
    cost = csc_array(block_diag([eye_array(inner), rise.T @ rise]))
    system = csc_array(vstack([hstack([cost, join.T]), hstack([join, csc_array((last, last))])]))
    solved = splu(system).solve(np.concatenate([np.zeros((2 * inner, drift.shape[1])), -drift]))
    position, velocity = position.copy(), velocity.copy()
    velocity[1:-1] += solved[inner : 2 * inner] / step
    # Integrate again, so that only rounding remains of the drift.
    position[1:-1] = position[0] + np.cumsum((velocity[1:] + velocity[:-1]) * (step / 2), axis=0)[:-1]
    return position, velocity


def _headings(trace: Trace, before: Array, velocity: Array) -> Array:
    """Headings along the velocity, or the plan's headings for agents at rest: (agents, steps + 1), rad."""
    moving = np.linalg.norm(velocity[..., :2], axis=-1) > STILL
    headings = np.where(moving, np.arctan2(velocity[..., 1], velocity[..., 0]), trace.heading[:, before])
    headings[:, -1] = trace.heading[:, -1]
    return np.asarray(headings)
