"""``inside(field)``: the whole body of the agent is in the region."""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate
from missionc.ir.predicates import Inside

PREDICATE = Predicate(
    name="inside",
    about=About.AGENT,
    parameters=("region",),
    called=True,
    says="the agent's whole body is in the region",
    example="inside(field)",
    meant=lambda region: Inside(region, body=True),
)
