"""The mission as meant: names are objects, units are SI, windows are whole steps.

Values only. Everything after ``passes.resolve`` reads this and never the tree
as written. Agents are numbered through the whole mission, in the order of
their declaration; an agent set is a tuple of such numbers in the order meant.
"""

from missionc.ir.agents import (
    Agent,
    AgentSet,
    Anywhere,
    DoubleIntegrator,
    Dynamics,
    Exactly,
    Place,
    SingleIntegrator,
    Unicycle,
    top_speed,
)
from missionc.ir.couplings import BeaconCover, Formation, FormationEdge, Graph, Proximity
from missionc.ir.formulas import About, Apply, AtLeastOf, Belongs, Formula, Holds, Length, OfAgent, Truth, Window
from missionc.ir.mission import Mission, Objective, Preference, Requirement, SolveWith
from missionc.ir.places import Beacon, Obstacle, Path, Region, Still, World
from missionc.ir.predicates import (
    Altitude,
    Compare,
    Connected,
    Coordinate,
    DistanceBetween,
    DistanceTo,
    Feature,
    InFormation,
    Inside,
    Predicate,
    Speed,
    Touches,
)
from missionc.ir.shapes import Ball, Box, Difference, Disc, Intersection, Polygon, Prism, Shape, Union, Vector

__all__ = [
    "About",
    "Agent",
    "AgentSet",
    "Altitude",
    "Anywhere",
    "Apply",
    "AtLeastOf",
    "Ball",
    "Beacon",
    "BeaconCover",
    "Belongs",
    "Box",
    "Compare",
    "Connected",
    "Coordinate",
    "Difference",
    "Disc",
    "DistanceBetween",
    "DistanceTo",
    "DoubleIntegrator",
    "Dynamics",
    "Exactly",
    "Feature",
    "Formation",
    "FormationEdge",
    "Formula",
    "Graph",
    "Holds",
    "InFormation",
    "Inside",
    "Intersection",
    "Length",
    "Mission",
    "Objective",
    "Obstacle",
    "OfAgent",
    "Path",
    "Place",
    "Polygon",
    "Predicate",
    "Preference",
    "Prism",
    "Proximity",
    "Region",
    "Requirement",
    "Shape",
    "SingleIntegrator",
    "SolveWith",
    "Speed",
    "Still",
    "Touches",
    "Truth",
    "Unicycle",
    "Union",
    "Vector",
    "Window",
    "World",
    "top_speed",
]
