"""``connected(radio)``: the graph, over all of its agents or over those named, is connected.

``connected(radio, 2)``: also without any one of them.
"""

from missionc.ir import About
from missionc.ir.language.predicate import Predicate
from missionc.ir.predicates import Connected

PREDICATE = Predicate(
    name="connected",
    about=About.TEAM,
    parameters=("graph", "agents?", "a number?"),
    called=True,
    says="every one of the agents has a route to every other on the graph, also without fewer of them than the number",
    example="connected(radio, east)",
    meant=Connected,
)
