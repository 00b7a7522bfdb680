"""The trajectory table, CSV: every agent's state at every step, SI units; a plane mission flies at its altitude.

Resources and flags have a column each, which is empty for agents that do not have them.
"""

from __future__ import annotations

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.language.margins.resources import flag_truths, levels

COLUMNS = "agent,t,x,y,z,vx,vy,vz,yaw"


def trajectories(mission: Mission, trace: Trace) -> str:
    """The text of ``trajectories.csv``: one row for each agent and step."""
    more = [(each.name, each.agents, levels(each, trace).tolist()) for each in mission.resources]
    more += [(each.name, each.agents, flag_truths(each, trace).astype(int).tolist()) for each in mission.flags]
    lines = [",".join([COLUMNS, *(cell(name) for name, _, _ in more)])]
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
            own = [repr(rows[agent.index][step]) if agent.index in having else "" for _, having, rows in more]
            lines.append(",".join([cell(agent.name), *(repr(number) for number in numbers), *own]))
    return "\n".join(lines) + "\n"


def cell(name: str) -> str:
    """A name as a cell of the table, in quotes where it has a comma: ``"rack[3, 7]"``."""
    return f'"{name}"' if "," in name else name
