"""``x + 2*y <= 3``: an inequality over the state of an agent and distances from it."""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate

PREDICATE = Predicate(
    name="compare",
    about=About.EITHER,
    parameters=("linear expression", "linear expression"),
    called=False,
    says="an inequality, linear in the state of one agent, or in distances between two named agents",
    example="distance(base) <= 2 m",
)
