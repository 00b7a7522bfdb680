"""``wall``: the formation holds within its tolerance."""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate

PREDICATE = Predicate(
    name="formation",
    about=About.TEAM,
    parameters=("formation",),
    called=False,
    says="every edge of the formation is within its tolerance",
    example="wall",
)
