"""Whether one agent's polynomials fly the verified plan.

A jump at a joint, or motion where there should be rest, is measured by how far
a control point would have to move to explain it: one scale, metres, for every
derivative and every length of piece.
"""

from __future__ import annotations

import math

import numpy as np

from missionc.ir import Agent, Mission
from missionc.plan import Array
from missionc.verify.certificate import Check, judged
from missionc.verify.columns import Pieces
from missionc.verify.curves import Curves, control_points, refined, values
from missionc.verify.tolerances import CLOCK, MOTION, TUBE, WAYPOINT

DEGREE = 7


def check_flight(mission: Mission, agent: Agent, own: Pieces, planned: Curves) -> list[Check]:
    """Clock, joints, rest, waypoints and tube (and the altitude, in a plane) of an agent's file."""
    times = np.concatenate([[0.0], np.cumsum(own.duration)])
    level = own.coefficients[:, : mission.dimension]
    # The firmware's numbers have 24 bits, wherever the world is.
    exact = MOTION * max(1.0, float(np.abs(own.coefficients[:, :, 0]).max()))
    clock = CLOCK * max(1.0, mission.step * mission.steps)
    late = abs(float(times[-1]) - mission.step * mission.steps)
    findings = [
        judged("duration", agent.name, -late, "s", clock, agents=(agent.name,), detail="it lasts as long as the plan"),
        _joints(agent, own, times, exact),
        _rest(agent, own, times, exact),
        _waypoints(agent, level, times, planned),
        _tube(agent, level, times, planned, clock),
    ]
    if mission.dimension == 2:
        height = np.abs(control_points(own.coefficients[:, 2:3], own.duration) - agent.altitude).max(axis=(1, 2))
        findings.append(_worst(agent, "altitude", -height, times, exact, f"it flies at {agent.altitude:g} m"))
    return findings


def _worst(agent: Agent, name: str, margin: Array, times: Array, tolerance: float, detail: str) -> Check:
    """``margin`` in metres at each of the first of ``times``."""
    index = int(margin.argmin())
    return judged(
        name,
        agent.name,
        float(margin[index]),
        "m",
        tolerance,
        at=float(times[index]),
        agents=(agent.name,),
        detail=detail,
    )


def _derivative_at(coefficients: Array, local: Array, order: int) -> Array:
    """(pieces, 4, 8), (pieces,) -> (pieces, 4): over the change that moving one control point by a metre makes."""
    falling = np.array([math.perm(power, order) for power in range(order, DEGREE + 1)], dtype=np.float64)
    return values(coefficients[..., order:] * falling, local) / math.perm(DEGREE, order)


def _joints(agent: Agent, own: Pieces, times: Array, exact: float) -> Check:
    jumps = np.zeros(own.duration.size - 1)
    shorter = np.minimum(own.duration[:-1], own.duration[1:])
    for order in range(5):
        before = _derivative_at(own.coefficients[:-1], own.duration[:-1], order)
        after = _derivative_at(own.coefficients[1:], np.zeros(own.duration.size - 1), order)
        jumps = np.maximum(jumps, np.linalg.norm(after - before, axis=-1) * shorter**order)
    return _worst(agent, "joints", -jumps, times[1:], exact, "from position to snap, nothing jumps between pieces")


def _rest(agent: Agent, own: Pieces, times: Array, exact: float) -> Check:
    moving = np.zeros(2)
    ends = np.array([0.0, own.duration[-1]])
    for order in (1, 2, 3):
        value = _derivative_at(own.coefficients[[0, -1]], ends, order)
        moving = np.maximum(moving, np.linalg.norm(value, axis=-1) * own.duration[[0, -1]] ** order)
    detail = "velocity, acceleration and jerk are zero at both ends"
    return _worst(agent, "rest", -moving, times[[0, -1]], exact, detail)


def _waypoints(agent: Agent, level: Array, times: Array, planned: Curves) -> Check:
    piece = np.clip(np.searchsorted(times, planned.times, side="right") - 1, 0, len(level) - 1)
    local = np.clip(planned.times - times[piece], 0.0, np.diff(times)[piece])
    start = planned.coefficients[agent.index, :, :, 0]
    end = values(planned.coefficients[agent.index, -1:], planned.durations[-1:])
    error = np.linalg.norm(values(level[piece], local) - np.concatenate([start, end]), axis=-1)
    return _worst(agent, "waypoints", -error, planned.times, WAYPOINT, "at every step's time it is where the plan is")


def _tube(agent: Agent, level: Array, times: Array, planned: Curves, clock: float) -> Check:
    """Cut at the steps, every control point near the verified motion of the step that its piece belongs to."""
    cut = _cut_at_steps(level, times, planned.times, clock)
    times, level = cut.times, cut.coefficients[0]
    step = np.searchsorted(planned.times, (times[:-1] + times[1:]) / 2, side="right") - 1
    step = np.clip(step, 0, planned.durations.size - 1)
    low, high = times[:-1] - planned.times[step], times[1:] - planned.times[step]
    outside = (low < -clock) | (high > planned.durations[step] + clock)
    path = planned.coefficients[agent.index, step]
    points = np.swapaxes(control_points(level, np.diff(times)), 1, 2)
    whole = _stray(points, path, np.zeros_like(low), planned.durations[step])
    part = _stray(points, path, np.maximum(low, 0.0), np.minimum(high, planned.durations[step]))
    margin = np.where(outside, -np.inf, TUBE - np.minimum(whole, part))
    detail = f"every control point is within {TUBE:g} m of the verified motion of its step"
    return _worst(agent, "tube", margin, times, MOTION, detail)


def _cut_at_steps(level: Array, times: Array, steps: Array, clock: float) -> Curves:
    """Pieces of one step at most; a step within the clock's tolerance of a joint is at the joint."""
    nearest = np.abs(times[np.clip(np.searchsorted(times, steps), 0, times.size - 1)] - steps)
    before = np.abs(times[np.clip(np.searchsorted(times, steps) - 1, 0, times.size - 1)] - steps)
    return refined(Curves(times, level[None]), steps[np.minimum(nearest, before) > clock])


def _stray(points: Array, path: Array, low: Array, high: Array) -> Array:
    """At least the largest distance of a piece's points to its path from ``low`` to ``high``.

    (pieces, points, dim), (pieces, dim, degree + 1), (pieces,) twice -> (pieces,).
    A parabola bulges from its chord by at most |p''| * duration**2 / 8.
    """
    start, end = values(path, low), values(path, high)
    along = end - start
    square = (along**2).sum(axis=-1)[:, None]
    reach = ((points - start[:, None]) * along[:, None]).sum(axis=-1)
    share = np.clip(np.divide(reach, square, out=np.zeros_like(reach), where=square > 0), 0.0, 1.0)
    beside = np.linalg.norm(points - start[:, None] - share[..., None] * along[:, None], axis=-1).max(axis=-1)
    bulge = np.linalg.norm(path[..., 2], axis=-1) * 2 * (high - low) ** 2 / 8 if path.shape[-1] > 2 else 0.0
    return np.asarray(beside + bulge)
