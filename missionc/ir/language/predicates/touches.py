"""``touches(field)``: some part of the agent is in the region."""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate
from missionc.ir.predicates import Touches

PREDICATE = Predicate(
    name="touches",
    about=About.AGENT,
    parameters=("region",),
    called=True,
    says="some part of the agent's body is in the region",
    example="touches(field)",
    meant=Touches,
)
