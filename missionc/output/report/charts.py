"""Time charts of distances, speeds, accelerations and resources, with the limits of the mission and the vehicles."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, TypeAlias

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.geometry.displacement import displaced
from missionc.ir import Agent, Mission, Resource
from missionc.ir.language.margins.resources import levels
from missionc.output.report.flight_tracks import Flights
from missionc.output.report.pack import pack, thousandths
from missionc.output.report.sample_tracks import Placed, Sampled
from missionc.output.report.simulated_tracks import Simulated
from missionc.verification.certificate import Certificate
from missionc.verification.plan.obstacle_bodies import solid

MOST_PAIRS = 1 << 21
"""Maximum number of distances that are computed together."""

MOST_CURVES = 8
"""Maximum number of agents whose resource levels are drawn as separate curves."""

INSTANT = 1e-9
"""Tolerance in seconds up to which two times count as equal."""
NEARLY = 2e-3
"""Tolerance in metres up to which a computed bound counts as equal to the mission's own."""

Teams: TypeAlias = dict[str, list[Agent]]
Limit: TypeAlias = tuple[str, str, float]
"""Limit line of a chart: its source, its team and its value."""


def charts(mission: Mission, moving: Flights, certificate: Certificate, trace: Trace) -> list[dict[str, Any]]:
    """Charts for the report, with a series for each motion (and team), and the limits that apply to it."""
    charts = []
    if len(mission.agents) > 1:
        nearest = [(name, "", separation(mission, each)) for name, each in moving.places()]
        lower_limits: list[Limit] = [("mission", "", mission.separation), *_proved(mission, moving, certificate)]
        charts.append(_chart("separation", "m", nearest, lower_limits, low=True))
    if mission.obstacles or any(world.obstacles for _, world in moving.worlds):
        nearest = [(name, "", _clearance(mission, moving, name, each)) for name, each in moving.places()]
        charts.append(_chart("clearance", "m", nearest, [("mission", "", mission.clearance)], low=True))
    teams = _teams(mission)
    planned, flown = "dynamics", "vehicle"
    dynamics = _limits(teams, planned, lambda agent: agent.dynamics.top_speed)
    sideways = _limits(teams, flown, lambda agent: agent.vehicle.speed)
    upwards = _limits(teams, flown, lambda agent: agent.vehicle.vertical_speed)
    plane = mission.dimension == 2
    wanted: list[tuple[str, Callable[[Sampled], Array], list[Limit]]] = [
        ("speed", attrgetter("velocity"), dynamics + sideways if plane else dynamics),
        ("horizontal speed", _sideways, [] if plane else sideways),
        ("vertical speed", _upwards, [] if plane else upwards),
    ]
    for name, vectors, limits in wanted:
        if limits:
            charts.append(_chart(name, "m/s", _largest(teams, moving, vectors), limits, low=False))
    strongest = _limits(teams, planned, attrgetter("dynamics.top_acceleration")) + _limits(
        teams, flown, lambda agent: agent.vehicle.acceleration
    )
    pushes = [
        each for each in _largest(teams, moving, attrgetter("acceleration")) if each[0] == "flown" or each[2].any()
    ]
    if pushes:
        charts.append(_chart("acceleration", "m/s²", pushes, strongest, low=False))
    charts += [_left(mission, resource, trace) for resource in mission.resources]
    return [*charts, *([_tracking(teams, moving.simulated)] if moving.simulated else [])]


def _left(mission: Mission, resource: Resource, trace: Trace) -> dict[str, Any]:
    """Chart of a resource's level at the steps for each agent, or of the minimum if there are many agents."""
    found = levels(resource, trace)[list(resource.agents)]
    names = [mission.agents[agent].name for agent in resource.agents]
    if len(names) > MOST_CURVES:
        names, found = [""], found.min(axis=0, keepdims=True)
    series = [("planned", name, row) for name, row in zip(names, found, strict=True)]
    return _chart(resource.name, "", series, [("capacity", "", resource.capacity)], low=False)


def _tracking(teams: Teams, flight: Simulated) -> dict[str, Any]:
    """Chart of the maximum tracking error of each team's simulated vehicles."""
    indices = {team: [agent.index for agent in agents] for team, agents in teams.items()}
    errors = [("simulated", team, 1000 * flight.error[own].max(axis=0)) for team, own in indices.items()]
    allowed: list[Limit] = [("vehicle", team, 1000 * float(flight.allowed[own].min())) for team, own in indices.items()]
    return _chart("tracking error", "mm", errors, allowed, low=False)


def _proved(mission: Mission, moving: Flights, certificate: Certificate) -> list[Limit]:
    """Distance limit at the time of the smallest proved separation margin, including tracking errors and start delays.

    The limit differs at other times, since vehicles are faster or slower there.
    """
    check = next((each for each in certificate.checks if each.name == "flown separation"), None)
    if check is None or moving.flown is None or check.at is None or len(check.agents) != 2:
        return []
    named = {agent.name: agent for agent in mission.agents}
    pair = [named[name] for name in check.agents]
    first, second = (
        np.array([np.interp(check.at, moving.flown.times, axis) for axis in moving.flown.position[agent.index].T])
        for agent in pair
    )
    need = float(np.linalg.norm(first - second)) - sum(agent.radius for agent in pair) - check.margin
    return [("proof", "", round(need, 3))] if need > mission.separation + NEARLY else []


def _chart(
    name: str, unit: str, series: Iterable[tuple[str, str, Array]], limits: list[Limit], *, low: bool
) -> dict[str, Any]:
    """Data of one chart.

    Args:
        series: motion, team and values (samples,) in ``unit``.
        low: True if the limits are minima, False if they are maxima.
    """
    return {
        "name": name,
        "unit": unit,
        "low": low,
        "series": [
            {"motion": motion, "team": team, "values": pack(thousandths(values))} for motion, team, values in series
        ],
        "limits": [{"by": by, "team": team, "value": round(value, 6)} for by, team, value in limits],
    }


def _teams(mission: Mission) -> Teams:
    teams: Teams = {}
    for agent in mission.agents:
        teams.setdefault(agent.team, []).append(agent)
    return teams


def _limits(teams: Teams, by: str, of: Callable[[Agent], float]) -> list[Limit]:
    """Limits of the teams that have a finite one; the smallest of the team's agents counts."""
    limits = [(by, team, min(map(of, agents))) for team, agents in teams.items()]
    return [each for each in limits if math.isfinite(each[2])]


def _sideways(each: Sampled) -> Array:
    return each.velocity[..., :2]


def _upwards(each: Sampled) -> Array:
    return each.velocity[..., 2:]


def _largest(teams: Teams, moving: Flights, of: Callable[[Sampled], Array]) -> list[tuple[str, str, Array]]:
    """Maximum norm of a vector quantity over the agents of a team, (samples,), for each team and motion."""
    return [
        (name, team, np.linalg.norm(of(each)[[agent.index for agent in agents]], axis=-1).max(axis=0))
        for team, agents in teams.items()
        for name, each in moving.by_name()
    ]


def separation(mission: Mission, each: Placed) -> Array:
    """Distance between the bodies of the nearest pair of agents, (samples,), metres."""
    first, second = np.triu_indices(len(mission.agents), 1)
    radius = np.array([agent.radius for agent in mission.agents])
    bodies = (radius[first] + radius[second])[:, None]
    size = max(1, MOST_PAIRS // len(first))
    gaps = []
    for start in range(0, each.times.size, size):
        place = each.position[:, start : start + size]
        gap = np.linalg.norm(place[first] - place[second], axis=-1) - bodies
        if each.there is not None:
            there = each.there[:, start : start + size]
            gap[~(there[first] & there[second])] = np.inf
        gaps.append(gap.min(axis=0))
    return np.concatenate(gaps)


def _clearance(mission: Mission, moving: Flights, name: str, each: Placed) -> Array:
    """Clearance of a motion from obstacles, (samples,), metres.

    For a flight, obstacles are those of the world at each time; for a plan, those of its own mission.
    """
    if not moving.worlds or name == "planned":
        return clearance(mission, each)
    since = np.array([time for time, _ in moving.worlds])
    which = np.searchsorted(since, each.times + INSTANT, side="right") - 1
    return np.stack([clearance(world, each) for _, world in moving.worlds])[which, np.arange(which.size)]


def clearance(mission: Mission, each: Placed) -> Array:
    """Distance between the nearest body and obstacle, (samples,), metres."""
    radius = np.array([agent.radius for agent in mission.agents])[:, None]
    nearest = np.full(each.times.size, np.inf)
    for obstacle in mission.obstacles:
        place, grown = each.position, np.zeros(1)
        if not obstacle.constant:
            place = place - np.array([displaced(obstacle, time, mission.dimension) for time in each.times])
            grown = np.array([obstacle.grown(time) for time in each.times])
        distance = solid(obstacle.shape, mission.dimension)(place) - radius - grown
        if each.there is not None:
            distance = np.where(each.there, distance, np.inf)
        nearest = np.minimum(nearest, distance.min(axis=0))
    return nearest
