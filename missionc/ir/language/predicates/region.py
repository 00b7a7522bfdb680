"""``field``: the centre of the agent is in the region."""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate

PREDICATE = Predicate(
    name="region",
    about=About.AGENT,
    parameters=("region",),
    called=False,
    says="the agent's centre is in the region, its border included",
    example="field",
)
