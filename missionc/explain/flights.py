"""Sentences on teams that come from the floor: where they stand, how high they rise, how fast, and where they land."""

from __future__ import annotations

import math

from missionc.ir import Agent, Exactly, Mission
from missionc.ir.wording import metres
from missionc.resolve.show_ir_formula import number


def flights_said(mission: Mission) -> list[str]:
    """One for each team that says ``flight``."""
    teams: dict[str, list[Agent]] = {}
    for agent in mission.agents:
        if agent.pad is not None:
            teams.setdefault(agent.team, []).append(agent)
    return [_said(mission, name, agents) for name, agents in teams.items()]


def _said(mission: Mission, name: str, agents: list[Agent]) -> str:
    pad = agents[0].pad
    assert pad is not None
    where = "from below where it starts" if pad.point is None else "from pads of its own"
    heights = {_height(mission, agent) for agent in agents}
    high = heights.pop() if len(heights) == 1 else None
    up = "to the height of its starts" if high is None else f"to {metres(high)}"
    fast = "" if math.isinf(pad.rise) else f" at {number(pad.rise)} m/s at most"
    slow = "" if math.isinf(pad.land) else f" at {number(pad.land)} m/s at most"
    return f"`{name}` rises {where} {up}{fast}, and comes back to land there{slow}"


def _height(mission: Mission, agent: Agent) -> float | None:
    """None where only a plan can tell."""
    if mission.dimension < 3:
        return float(agent.altitude)
    if agent.pad is not None and agent.pad.hover is not None:
        return agent.pad.hover
    return agent.start.point[2] if isinstance(agent.start, Exactly) else None
