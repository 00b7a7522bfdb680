"""``loaded``: the flag of the agent is set."""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate

PREDICATE = Predicate(
    name="flag",
    about=About.AGENT,
    parameters=("flag",),
    called=False,
    says="the agent has been in the region that sets the flag, and not in the one that clears it since",
    example="loaded",
)
