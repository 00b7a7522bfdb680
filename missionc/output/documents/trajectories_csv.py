"""The trajectory table in CSV: state of every agent at every step, SI units.

Agents of a plane mission are at their altitudes. Each resource and flag has a column, which is empty for agents without
it.
"""

from __future__ import annotations

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.language.margins.resources import flag_truths, levels

COLUMNS = "agent,t,x,y,z,vx,vy,vz,yaw"


def trajectories(mission: Mission, trace: Trace) -> str:
    """Content of ``trajectories.csv``: one row for each agent and step."""
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
    """The name as a cell of a CSV table, in quotes if it contains a comma: ``"rack[3, 7]"``."""
    return f'"{name}"' if "," in name else name
