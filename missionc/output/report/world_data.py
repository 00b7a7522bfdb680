"""The world of a page's data: what a map draws of a mission before anything moves.

in   Mission, its Kernel
out  a dict that JSON can hold
"""

from __future__ import annotations

from typing import Any

from missionc.ir import Agent, Mission, Obstacle, Path
from missionc.kernel.nodes import Kernel
from missionc.output.region_roles import region_roles
from missionc.output.report.outlines import inner_point, solids
from missionc.output.report.pack import PER_METRE


def world_data(mission: Mission, kernel: Kernel) -> dict[str, Any]:
    """Times in seconds, lengths in metres; ``per_metre`` is of the numbers that are packed."""
    roles = region_roles(mission, kernel)
    return {
        "mission": mission.name,
        "step": mission.step,
        "steps": mission.steps,
        "per_metre": PER_METRE,
        "world": {"low": list(mission.world.low), "high": list(mission.world.high)},
        "regions": [
            {**_shape(mission, region.name, region.shape), "role": roles[region.name]} for region in mission.regions
        ],
        "obstacles": [_obstacle(mission, obstacle) for obstacle in mission.obstacles],
        "beacons": [{"name": beacon.name, "position": list(beacon.position)} for beacon in mission.beacons],
        "agents": [_agent(agent) for agent in mission.agents],
    }


def _agent(agent: Agent) -> dict[str, Any]:
    return {"name": agent.name, "team": agent.team, "radius": agent.radius}


def _shape(mission: Mission, name: str, shape: Any) -> dict[str, Any]:
    parts = solids(mission.world, shape)
    return {"name": name, "parts": parts, "inner": inner_point(mission.world, parts)}


def _obstacle(mission: Mission, obstacle: Obstacle) -> dict[str, Any]:
    path = obstacle.motion
    moves = (
        {"times": list(path.times), "offsets": [list(each) for each in path.offsets]}
        if isinstance(path, Path)
        else None
    )
    return {**_shape(mission, obstacle.name, obstacle.shape), "path": moves, "growth": obstacle.growth}
