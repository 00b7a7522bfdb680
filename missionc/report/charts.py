"""How near, how fast and how hard over time, each with what the mission allows."""

from __future__ import annotations

from typing import Any

import numpy as np

from missionc.ir import Agent, DoubleIntegrator, Mission, Still
from missionc.ir.agents import top_speed
from missionc.plan import Array
from missionc.report.flights import Flights, Sampled
from missionc.report.pack import pack, thousandths
from missionc.verify.solids import solid

MOST_PAIRS = 1 << 21
"""Distances that are held at once."""


def charts(mission: Mission, moving: Flights) -> list[dict[str, Any]]:
    """Charts with a series for each motion (and team), and the limits that hold for it."""
    found = []
    if len(mission.agents) > 1:
        nearest = [(name, "", _separation(mission, each)) for name, each in moving.by_name()]
        found.append(_chart("separation", "m", nearest, [("", mission.separation)], low=True))
    if mission.obstacles:
        nearest = [(name, "", _clearance(mission, each)) for name, each in moving.by_name()]
        found.append(_chart("clearance", "m", nearest, [("", mission.clearance)], low=True))
    teams = _teams(mission)
    speeds = [
        (name, team, _largest(each.velocity[_indices(agents)]))
        for team, agents in teams.items()
        for name, each in moving.by_name()
    ]
    limits = [(team, max(top_speed(agent.dynamics) for agent in agents)) for team, agents in teams.items()]
    found.append(_chart("speed", "m/s", speeds, limits, low=False))
    pushes = [
        (name, team, _largest(each.acceleration[_indices(agents)]))
        for team, agents in teams.items()
        for name, each in moving.by_name()
        if name == "flown" or any(isinstance(agent.dynamics, DoubleIntegrator) for agent in agents)
    ]
    strongest = [
        (team, max(agent.dynamics.acceleration for agent in agents if isinstance(agent.dynamics, DoubleIntegrator)))
        for team, agents in teams.items()
        if any(isinstance(agent.dynamics, DoubleIntegrator) for agent in agents)
    ]
    if pushes:
        found.append(_chart("acceleration", "m/s²", pushes, strongest, low=False))
    return found


def _chart(
    name: str, unit: str, series: list[tuple[str, str, Array]], limits: list[tuple[str, float]], *, low: bool
) -> dict[str, Any]:
    """``low``: the limits are the least that is allowed, otherwise the most."""
    return {
        "name": name,
        "unit": unit,
        "low": low,
        "series": [
            {"motion": motion, "team": team, "values": pack(thousandths(values))} for motion, team, values in series
        ],
        "limits": [{"team": team, "value": round(value, 6)} for team, value in limits],
    }


def _teams(mission: Mission) -> dict[str, list[Agent]]:
    found: dict[str, list[Agent]] = {}
    for agent in mission.agents:
        found.setdefault(agent.team, []).append(agent)
    return found


def _indices(agents: list[Agent]) -> list[int]:
    return [agent.index for agent in agents]


def _largest(vectors: Array) -> Array:
    """(agents, samples, dim) -> (samples,): the largest norm of any agent."""
    return np.asarray(np.linalg.norm(vectors, axis=-1).max(axis=0))


def _separation(mission: Mission, each: Sampled) -> Array:
    """Between the bodies of the nearest pair: (samples,), metres."""
    first, second = np.triu_indices(len(mission.agents), 1)
    radius = np.array([agent.radius for agent in mission.agents])
    bodies = (radius[first] + radius[second])[:, None]
    size = max(1, MOST_PAIRS // len(first))
    found = []
    for start in range(0, each.times.size, size):
        place = each.position[:, start : start + size]
        found.append((np.linalg.norm(place[first] - place[second], axis=-1) - bodies).min(axis=0))
    return np.concatenate(found)


def _clearance(mission: Mission, each: Sampled) -> Array:
    """Between the body and the obstacle that are nearest: (samples,), metres."""
    radius = np.array([agent.radius for agent in mission.agents])[:, None]
    nearest = np.full(each.times.size, np.inf)
    for obstacle in mission.obstacles:
        place = each.position
        if not isinstance(obstacle.motion, Still):
            path = obstacle.motion
            columns = np.array(path.offsets).T
            shift = np.stack([np.interp(each.times, path.times, column) for column in columns], axis=-1)
            place = place - shift
        distance = solid(obstacle.shape, mission.dimension)(place) - radius
        nearest = np.minimum(nearest, distance.min(axis=0))
    return nearest
