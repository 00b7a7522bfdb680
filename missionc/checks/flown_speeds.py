"""Check of goals at the speeds that vehicles fly: what dynamics reach in time, and no flight does.

    in   Mission, its Kernel
    out  what `check_goals` finds of requirements then
    says MC509 MC551

Only what is to come before the mission's last step is looked at: a window that reaches to the end goes further where
the plan is flown slower than it was made, and so does a finish.
"""

from __future__ import annotations

import math
from dataclasses import replace

from missionc.checks.check_goals import requirements_out_of_reach
from missionc.checks.free_space import FreeSpace
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Agent, Mission
from missionc.ir.wording import listed, speed
from missionc.kernel.nodes import Kernel


def check_flown_speeds(mission: Mission, kernel: Kernel) -> list[Diagnostic]:
    """What is out of reach, of a mission in which nothing is at the speeds of its dynamics; none where no vehicle is
    slower than those."""
    agents = tuple(
        replace(agent, dynamics=agent.dynamics.at_most(_most(mission, agent), math.inf)) for agent in mission.agents
    )
    slower = {
        agent.team: f"`{agent.team}` flies at {speed(flown.dynamics.top_speed)} at most, by its vehicle"
        for agent, flown in zip(mission.agents, agents, strict=True)
        if flown.dynamics != agent.dynamics
    }
    if not slower:
        return []
    flown = replace(mission, agents=agents)
    found = requirements_out_of_reach(flown, kernel, FreeSpace.of(flown), mission.steps - 1)
    return [replace(each, notes=(*each.notes, listed(list(slower.values())))) for each in found]


def _most(mission: Mission, agent: Agent) -> float:
    """Metres a second in any direction: what is flown sideways and up or down at once."""
    vehicle = agent.vehicle
    return vehicle.speed if mission.dimension == 2 else math.hypot(vehicle.speed, vehicle.vertical_speed)
