"""``heading within 10 deg of 90 deg``: the agent faces so far from a direction at most, or from that of a beacon."""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate

PREDICATE = Predicate(
    name="heading",
    about=About.AGENT,
    parameters=("an angle", "a direction or a beacon"),
    called=False,
    says="the agent's heading differs by so much at most from a direction, or from that in which a beacon is",
    example="heading within 10 deg of 90 deg",
)
