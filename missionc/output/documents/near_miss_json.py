"""Closest infeasible candidate as JSON, ``missionc.near_miss/2``: a trace that violates a requirement, not for
flight.
"""

from __future__ import annotations

from missionc.backends.api import Attempt, Scope
from missionc.ir import Mission
from missionc.output.json_layout import compact, document, listed, record


def near_miss_json(mission: Mission, attempt: Attempt, planned_for: str, scope: Scope | None) -> str:
    """Content of ``near_miss.json``, one line for each list of positions.

    Args:
        planned_for: change of the mission with which the candidate is a plan; empty if unknown.
        scope: scope that is proven to contain no plan, or None.
    """
    position = attempt.trace.position
    head = {
        "schema": "missionc.near_miss/2",
        "mission": mission.name,
        "plan": False,
        "impossible": scope and scope.value,
        "violates": [each.as_record() for each in attempt.violated],
        "faults": [each.as_record() for each in attempt.worst_faults()],
        "planned_for": planned_for or None,
        "times": [round(mission.step * each, 9) for each in range(position.shape[1])],
    }
    agents = [
        record(
            {
                "name": agent.name,
                "team": agent.team,
                "radius": float(agent.radius),
                "position": position[agent.index].tolist(),
            },
            depth=2,
        )
        for agent in mission.agents
    ]
    requirements = [compact(each.as_verdict()) for each in attempt.requirements]
    return document(head, listed("agents", agents), listed("requirements", requirements))
