"""The trajectory table, CSV: every agent's state at every step, SI units; a plane mission flies at its altitude."""

from __future__ import annotations

from missionc.base.trace import Trace
from missionc.ir import Mission

COLUMNS = "agent,t,x,y,z,vx,vy,vz,yaw"


def trajectories(mission: Mission, trace: Trace) -> str:
    """The text of ``trajectories.csv``: one row for each agent and step."""
    lines = [COLUMNS]
    for agent in mission.agents:
        flat = ([float(agent.altitude)], [0.0]) if mission.dimension == 2 else ([], [])
        for step in range(trace.position.shape[1]):
            numbers = [
                round(mission.step * step, 9),
                *trace.position[agent.index, step].tolist(),
                *flat[0],
                *trace.velocity[agent.index, step].tolist(),
                *flat[1],
                float(trace.heading[agent.index, step]),
            ]
            lines.append(",".join([agent.name, *(repr(number) for number in numbers)]))
    return "\n".join(lines) + "\n"
