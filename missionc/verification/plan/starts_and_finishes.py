"""Checks that a plan begins and ends as the mission requires, and stays within the world."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.geometry.curves.piecewise_polynomials import Curves, control_points
from missionc.ir import Agent, InitialSet, Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.verification.certificate import CONTACT, MOTION, Check, judged


def check_places(mission: Mission, trace: Trace) -> list[Check]:
    """Checks that each agent's centre is in its start region first, and in its finish region, if there is one, last."""
    findings = []
    for agent in mission.agents:
        findings.append(check_place(agent, "start", agent.start, trace.position[agent.index, 0], 0.0))
        if agent.finish is not None:
            last = trace.position[agent.index, -1]
            findings.append(check_place(agent, "finish", agent.finish, last, mission.step * mission.steps))
    return findings


def check_place(agent: Agent, name: str, place: InitialSet, position: Array, at: float) -> Check:
    """Check that an agent's centre is in its start or finish region.

    Args:
        position: centre of the agent, (dim,), metres.
        at: time, seconds.
    """
    if place.point is None:
        margin, tolerance = -float(signed_distance(np, place.shape, position)), CONTACT
    else:
        margin, tolerance = -float(np.linalg.norm(position - np.array(place.point))), MOTION
    return judged(name, agent.name, margin, "m", tolerance, at=at, agents=(agent.name,), detail=str(place))


def check_world(mission: Mission, curves: Curves, tolerance: float = CONTACT) -> Check:
    """Check that the agents' centres stay in the world, in continuous time.

    The check is exact for straight and parabolic motion. A polynomial of higher degree is bounded by its control
    points, which extend slightly further.
    """
    where, _ = extremes(curves)
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    room = np.minimum(where - low[:, None], high[:, None] - where).min(axis=2)
    agent, piece, point = np.unravel_index(int(room.argmin()), room.shape)
    return judged(
        "world",
        "world",
        float(room[agent, piece, point]),
        "m",
        tolerance,
        at=float(curves.times[piece]),
        agents=(mission.agents[int(agent)].name,),
        detail="every centre is inside the world in continuous time",
    )


def extremes(curves: Curves) -> tuple[Array, Array]:
    """Points that bound each coordinate in each piece, (agents, pieces, dim, points), metres, and their times, seconds.

    Up to degree two, they are the ends of the piece and the turning point of the coordinate. Above, they are the
    control points, which the curve may not reach, each with the time of the beginning of the piece.
    """
    begin = curves.times[:-1, None, None]
    duration = curves.durations[:, None]
    if curves.coefficients.shape[-1] > 3:
        found = control_points(curves.coefficients, np.broadcast_to(curves.durations, curves.coefficients.shape[:2]))
        return found, np.broadcast_to(begin, found.shape)
    start, linear = curves.coefficients[..., 0], curves.coefficients[..., 1]
    bend = curves.coefficients[..., 2] if curves.coefficients.shape[-1] == 3 else np.zeros_like(linear)
    turn = np.divide(-linear, 2 * bend, out=np.zeros_like(linear), where=bend != 0)
    local = np.stack(
        [np.zeros_like(linear), np.broadcast_to(duration, linear.shape), np.clip(turn, 0.0, duration)], axis=-1
    )
    return start[..., None] + (linear[..., None] + bend[..., None] * local) * local, begin + local
