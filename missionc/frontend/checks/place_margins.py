"""Robustness margins of predicates at given positions of the agents, without arrays."""

from __future__ import annotations

from typing import TypeAlias

from missionc.geometry import plain_floats
from missionc.geometry.plain_floats import Place
from missionc.ir import Agent, Mission, Predicate
from missionc.ir.language.margins.view import View

Joint: TypeAlias = tuple[Place | None, ...]
"""Position of each agent; None for an agent that may be anywhere."""


def margin_at(mission: Mission, predicate: Predicate, agent: Agent, joint: Joint) -> float | None:
    """Robustness margin of a predicate at given positions; None if it depends on unknown positions.

    The predicate must not be one of a connected graph.
    """
    needed = predicate.others | ({agent.index} if predicate.reads_oneself(mission.dimension) else set())
    if predicate.reads_speed or predicate.reads_past or any(joint[each] is None for each in needed):
        return None
    return float(predicate.margin(_AtPlaces(mission, agent, joint)))


class _AtPlaces(View):
    """View for one agent at given positions of all agents; agents that may be anywhere are skipped."""

    def __init__(self, mission: Mission, agent: Agent, joint: Joint) -> None:
        super().__init__(plain_floats, mission.dimension)
        self.agent, self.joint = agent, joint

    def own(self) -> Place:
        return self.place(self.agent.index)

    def place(self, agent: int) -> Place:
        return self.joint[agent] or Place((0.0,) * self.dimension)

    def radius(self) -> float:
        return self.agent.radius

    def plane(self) -> float:
        return self.agent.altitude
