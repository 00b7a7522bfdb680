"""``drone``: the agent belongs to the team, to the group, or is the agent."""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate

PREDICATE = Predicate(
    name="member",
    about=About.AGENT,
    parameters=("agents",),
    called=False,
    says="the agent is one of these",
    example="drone[0..2]",
)
