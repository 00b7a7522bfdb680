"""Starts and finishes of a plan where the mission has them, and its states within the world."""

from __future__ import annotations

from typing import assert_never

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.curves.piecewise_polynomials import Curves, control_points
from missionc.ir import Agent, Anywhere, Exactly, Mission, Place
from missionc.verify.certificate import Check, judged
from missionc.verify.tolerances import CONTACT, MOTION
from missionc.world.signed_distance import signed_distance


def check_places(mission: Mission, trace: Trace) -> list[Check]:
    """Each agent's start, and its finish where it has one. A place is about the agent's centre."""
    findings = []
    for agent in mission.agents:
        findings.append(check_place(agent, "start", agent.start, trace.position[agent.index, 0], 0.0))
        if agent.finish is not None:
            last = trace.position[agent.index, -1]
            findings.append(check_place(agent, "finish", agent.finish, last, mission.step * mission.steps))
    return findings


def check_place(agent: Agent, name: str, place: Place, position: Array, at: float) -> Check:
    """An agent at a time, in seconds: its centre, (dim,), is in the place, or there."""
    match place:
        case Anywhere(region):
            margin = -float(signed_distance(np, region.shape, position))
            return judged(
                name, agent.name, margin, "m", CONTACT, at=at, agents=(agent.name,), detail=f"in `{region.name}`"
            )
        case Exactly(point):
            margin = -float(np.linalg.norm(position - np.array(point)))
            where = ", ".join(f"{value:g}" for value in point)
            return judged(name, agent.name, margin, "m", MOTION, at=at, agents=(agent.name,), detail=f"at ({where})")
        case _:
            assert_never(place)


def check_world(mission: Mission, curves: Curves, tolerance: float = CONTACT) -> Check:
    """The world bounds the agents' centres, at every moment.

    Exact for straight and parabolic motion; a polynomial of higher degree is
    judged by its control points, which reach a little further than it does.
    """
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    where, times = _extremes(curves) if curves.coefficients.shape[-1] <= 3 else _hull(curves)
    room = np.minimum(where - low[:, None], high[:, None] - where).min(axis=2)
    agent, piece, point = np.unravel_index(int(room.argmin()), room.shape)
    return judged(
        "world",
        "world",
        float(room[agent, piece, point]),
        "m",
        tolerance,
        at=float(times[piece]),
        agents=(mission.agents[int(agent)].name,),
        detail="every centre is inside it throughout",
    )


def _extremes(curves: Curves) -> tuple[Array, Array]:
    """Each coordinate at the ends of each piece and where it turns within: (agents, pieces, dim, points)."""
    start, linear = curves.coefficients[..., 0], curves.coefficients[..., 1]
    bend = curves.coefficients[..., 2] if curves.coefficients.shape[-1] == 3 else np.zeros_like(linear)
    duration = curves.durations[:, None]
    turn = np.divide(-linear, 2 * bend, out=np.zeros_like(linear), where=bend != 0)
    times = [np.zeros_like(linear), np.broadcast_to(duration, linear.shape), np.clip(turn, 0.0, duration)]
    return np.stack([start + (linear + bend * time) * time for time in times], axis=-1), curves.times[:-1]


def _hull(curves: Curves) -> tuple[Array, Array]:
    """The control points of each piece: (agents, pieces, dim, points)."""
    durations = np.broadcast_to(curves.durations, curves.coefficients.shape[:2])
    return control_points(curves.coefficients, durations), curves.times[:-1]
