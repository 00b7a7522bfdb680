"""Continuity and fidelity of one agent's polynomials: joints, rest at both ends, and distance from the verified plan.

A jump at a joint, or motion instead of rest, is measured by the displacement of a control point that would explain it.
This gives one unit, metres, for every derivative and every duration. Possible rounding errors count against the flight.
"""

from __future__ import annotations

import math

import numpy as np

from missionc.base.trace import Array, Indices
from missionc.geometry.curves.bernstein_intervals import GROWN, Enclosed, derivative, from_powers
from missionc.geometry.curves.piecewise_polynomials import Curves, Pieces, values
from missionc.ir import Agent, Fixed, Mission
from missionc.verification.certificate import CLOCK, MOTION, TUBE, WAYPOINT, Check, judged
from missionc.verification.flight.joint_claims import ALLOWANCE, cut
from missionc.verification.proof.branch_and_bound import Bounds, Claim

DEGREE = 7


def check_flight(mission: Mission, agent: Agent, own: Pieces, planned: Curves) -> list[Check]:
    """Checks of one agent's trajectory file: duration, continuity at the joints, rest at the ends, and waypoints.

    In a plane mission they include the altitude, and for an agent with constant yaw the yaw.
    """
    times = own.times
    late = abs(float(times[-1]) - mission.step * mission.steps)
    findings = [
        judged(
            "duration",
            agent.name,
            -late,
            "s",
            clock(mission),
            agents=(agent.name,),
            detail="the duration of the file equals that of the plan",
        ),
        *check_smooth(agent, own),
        _waypoints(agent, own.coefficients[:, : mission.dimension], times, planned),
    ]
    return [*findings, *check_level(mission, agent, own)]


def check_level(mission: Mission, agent: Agent, own: Pieces) -> list[Check]:
    """Checks that the altitude of a plane mission, and a constant yaw, do not change in an agent's trajectory file."""
    found = []
    if mission.dimension == 2:
        detail = f"the altitude is {agent.altitude:g} m"
        found.append(_worst(agent, "altitude", -_off(own, 2, agent.altitude), own.times, exactness(own), detail))
    if isinstance(agent.yaw, Fixed):
        detail, tolerance = f"the yaw is {agent.yaw.angle:g} rad in continuous time", max(1.0, abs(agent.yaw.angle))
        off = _off(own, 3, agent.yaw.angle)
        found.append(_worst(agent, "yaw", -off, own.times, MOTION * tolerance, detail, "rad"))
    return found


def _off(own: Pieces, axis: int, wanted: float) -> Array:
    """Upper bound on the deviation of a coordinate from ``wanted`` in each piece: (pieces,), metres or rad."""
    whole = from_powers(own.coefficients[:, axis : axis + 1], own.duration[:, None])
    return np.asarray((np.abs(whole.points[:, 0] - wanted).max(axis=-1) + whole.radius[:, 0]) * GROWN)


def check_smooth(agent: Agent, own: Pieces, *, stops: bool = False) -> list[Check]:
    """Checks of continuity at the joints, of rest at both ends, and of a given initial motion, for an agent's
    trajectory file.

    Args:
        stops: True if the agent may come to rest at a joint, where snap ends as at the end of a flight.
    """
    exact = exactness(own)
    beginning = [_begins(agent, own, exact)] if agent.begins else []
    return [_joints(agent, own, exact, stops), *beginning, _rest(agent, own, own.times, exact)]


def exactness(own: Pieces) -> float:
    """Length in metres that counts as zero, for coordinates that the firmware rounds to 24 bits."""
    return MOTION * max(1.0, float(np.abs(own.coefficients[:, :, 0]).max()))


def clock(mission: Mission) -> float:
    """Tolerance of a flight's duration against the plan, seconds."""
    return CLOCK * max(1.0, mission.step * mission.steps)


def _worst(
    agent: Agent, name: str, margin: Array, times: Array, tolerance: float, detail: str, unit: str = "m"
) -> Check:
    """Check with the smallest entry of ``margin`` and its time.

    Args:
        margin: (count,), in ``unit``.
        times: at least (count,), seconds; entry ``i`` is the time of margin ``i``.
    """
    index = int(margin.argmin())
    return judged(
        name,
        agent.name,
        float(margin[index]),
        unit,
        tolerance,
        at=float(times[index]),
        agents=(agent.name,),
        detail=detail,
    )


def _change(coefficients: Array, order: int) -> Array:
    """Coefficients of a derivative in ascending powers: (pieces, 4, 8), in metres and seconds, to (pieces, 4, 8 -
    order).
    """
    for _ in range(order):
        coefficients = derivative(coefficients)
    return coefficients


def _length(offset: Array, radius: Array | float, unit: Array) -> Array:
    """Upper bound on the control point displacement that explains an offset: (pieces,), metres.

    Args:
        offset: (pieces, 4), in the unit of the derivative.
        radius: error bound of each coordinate.
        unit: factor from the derivative to the displacement of one control point, (pieces,).
    """
    return np.asarray(np.linalg.norm(np.abs(offset) + radius, axis=-1) * unit * GROWN)


def _joints(agent: Agent, own: Pieces, exact: float, stops: bool) -> Check:
    jumps = moving = np.zeros(own.duration.size - 1)
    shorter = np.minimum(own.duration[:-1], own.duration[1:])
    for order in range(5):
        change = _change(own.coefficients, order)
        before = from_powers(change[:-1], own.duration[:-1, None])
        off = before.points[..., -1] - change[1:, :, 0]
        unit = shorter**order / math.perm(DEGREE, order)
        length = _length(off, before.radius, unit)
        jumps = np.maximum(jumps, np.where(moving <= exact, 0.0, length) if stops and order == 4 else length)
        moving = np.maximum(moving, _length(before.points[..., -1], before.radius, unit)) if order else moving
    detail = "pieces are continuous from position to snap"
    return _worst(
        agent, "joints", -jumps, own.times[1:], exact, f"{detail}, except for snap at rest" if stops else detail
    )


def _rest(agent: Agent, own: Pieces, times: Array, exact: float) -> Check:
    moving = np.zeros(2)
    which = [1] if agent.begins else [0, 1]
    ends = own.duration[[0, -1]]
    for order in (1, 2, 3):
        change = _change(own.coefficients[[0, -1]], order)
        last = from_powers(change, ends[:, None])
        value = np.stack([change[0, :, 0], last.points[1, :, -1]])
        radius = np.stack([np.zeros(len(value[0])), last.radius[1]])
        moving = np.maximum(moving, _length(value, radius, ends**order / math.perm(DEGREE, order)))
    detail = f"velocity, acceleration and jerk are zero at {'the end' if agent.begins else 'both ends'}"
    return _worst(agent, "rest", -moving[which], times[[0, -1]][which], exact, detail)


def _begins(agent: Agent, own: Pieces, exact: float) -> Check:
    """Check that the trajectory begins in the given initial state, with the tolerance of a joint."""
    jump = np.zeros(1)
    for order, state in enumerate(agent.begins):
        off = _change(own.coefficients[:1], order)[:, :, 0] - np.array(state)
        jump = np.maximum(jump, _length(off, 0.0, own.duration[:1] ** order / math.perm(DEGREE, order)))
    return _worst(agent, "begins", -jump, own.times, exact, "the first state is continuous from position to snap")


def _waypoints(agent: Agent, level: Array, times: Array, planned: Curves) -> Check:
    piece = np.clip(np.searchsorted(times, planned.times, side="right") - 1, 0, len(level) - 1)
    local = np.clip(planned.times - times[piece], 0.0, np.diff(times)[piece])
    start = planned.coefficients[agent.index, :, :, 0]
    end = values(planned.coefficients[agent.index, -1:], planned.durations[-1:])
    error = np.linalg.norm(values(level[piece], local) - np.concatenate([start, end]), axis=-1)
    error += ALLOWANCE * (1 + values(np.abs(level[piece]), local).sum(axis=-1)) * (1 + times[-1])
    return _worst(
        agent, "waypoints", -error, planned.times, WAYPOINT, "the position equals the plan at the sample times"
    )


def tube(mission: Mission, agent: Agent, own: Pieces, planned: Curves) -> Claim:
    """Claim that the agent's trajectory stays near the verified plan.

    The pieces are split at the steps, and every control point is compared with the plan in its step.
    """
    whole = from_powers(own.coefficients[:, : mission.dimension], own.duration[:, None])[None]
    times = _with_steps(own.times, planned.times, clock(mission))
    level = cut(whole, own.times, times)[0]
    step = np.searchsorted(planned.times, (times[:-1] + times[1:]) / 2, side="right") - 1
    step = np.clip(step, 0, planned.durations.size - 1)
    low, high = times[:-1] - planned.times[step], times[1:] - planned.times[step]
    outside = (low < -clock(mission)) | (high > planned.durations[step] + clock(mission))
    path = planned.coefficients[agent.index, step]

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        points = np.swapaxes(curve.points, 1, 2)
        step_long = _stray(points, path[item], np.zeros(item.size), planned.durations[step[item]])
        begin, end = np.maximum(low[item], 0.0), np.minimum(high[item], planned.durations[step[item]])
        stray = np.minimum(step_long, _stray(points, path[item], begin, end))
        off = np.linalg.norm(curve.radius, axis=-1) * GROWN + ALLOWANCE * (1 + np.abs(points).max(axis=(1, 2)))
        margin = np.where(outside[item], -np.inf, TUBE - stray - off)
        return margin, margin, np.zeros(item.size)

    detail = f"every control point is within {TUBE:g} m of the verified motion of its step"
    agents = np.array([[agent.index]], dtype=np.int64)
    # Its control points count: pieces are not halved to get others.
    return Claim("tube", agent.name, "m", MOTION, detail, agents, times, lambda item: level[item], judge, np.inf)


def _with_steps(times: Array, steps: Array, late: float) -> Array:
    """Times of the joints and steps, (count,), seconds.

    A step within the clock's tolerance of a joint counts as the joint.
    """
    place = np.searchsorted(times, steps)
    nearest = [np.abs(times[np.clip(place - before, 0, times.size - 1)] - steps) for before in (0, 1)]
    inside = (np.minimum(*nearest) > late) & (steps > times[0]) & (steps < times[-1])
    return np.union1d(times, steps[inside])


def _stray(points: Array, path: Array, low: Array, high: Array) -> Array:
    """Upper bound on the distance of a piece's points from the planned path between two times, (pieces,), metres.

    A parabola deviates from its chord by at most |p''| * duration**2 / 8.

    Args:
        points: (pieces, points, dim), metres.
        path: polynomial coefficients, (pieces, dim, degree + 1).
        low, high: times within the path, (pieces,), seconds.
    """
    start, end = values(path, low), values(path, high)
    along = end - start
    square = (along**2).sum(axis=-1)[:, None]
    reach = ((points - start[:, None]) * along[:, None]).sum(axis=-1)
    share = np.clip(np.divide(reach, square, out=np.zeros_like(reach), where=square > 0), 0.0, 1.0)
    beside = np.linalg.norm(points - start[:, None] - share[..., None] * along[:, None], axis=-1).max(axis=-1)
    bulge = np.linalg.norm(path[..., 2], axis=-1) * 2 * (high - low) ** 2 / 8 if path.shape[-1] > 2 else 0.0
    return np.asarray(beside + bulge)
