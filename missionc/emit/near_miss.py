"""A motion that breaks a requirement, as JSON, ``missionc.near_miss/1``: no plan, but a trace that can be judged."""

from __future__ import annotations

from missionc.emit.text import compact, listed, record
from missionc.ir import Mission
from missionc.plan import Judgement, Trace


def near_miss_json(
    mission: Mission, trace: Trace, judgements: tuple[Judgement, ...], broken: Judgement, planned_for: str
) -> str:
    """The text of ``near_miss.json``, one line for each list of positions.

    Args:
        broken: the requirement that does not hold.
        planned_for: the change of the mission with which the motion is a plan.
    """
    head = {
        "schema": "missionc.near_miss/1",
        "mission": mission.name,
        "plan": False,
        "violates": broken.as_record(),
        "planned_for": planned_for,
        "times": [round(mission.step * each, 9) for each in range(trace.position.shape[1])],
    }
    agents = [
        record(
            {
                "name": agent.name,
                "team": agent.team,
                "radius": float(agent.radius),
                "position": trace.position[agent.index].tolist(),
            },
            depth=2,
        )
        for agent in mission.agents
    ]
    lines = [f"  {compact(key)}: {compact(value)}" for key, value in head.items()]
    lines.append(listed("agents", agents))
    lines.append(listed("requirements", [compact(each.as_verdict()) for each in judgements]))
    return "{\n" + ",\n".join(lines) + "\n}\n"
