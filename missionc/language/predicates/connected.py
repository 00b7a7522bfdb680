"""``connected(radio)``: the graph, over all of its agents or over those named, is connected."""

from missionc.ir import About
from missionc.ir.predicates import Connected
from missionc.language.predicate import Predicate

PREDICATE = Predicate(
    name="connected",
    about=About.TEAM,
    parameters=("graph", "agents?"),
    called=True,
    says="every one of the agents has a route to every other on the graph",
    example="connected(radio, east)",
    meant=lambda graph, agents: Connected(graph, graph.agents if agents is None else agents),
)
