"""The intermediate representation: the mission as meant, names are objects, units are SI, windows are whole steps.

Values only. Everything after ``resolve.resolve_mission`` reads this and never the tree
as written. Agents are numbered through the whole mission, in the order of
their declaration; an agent set is a tuple of such numbers in the order meant.
"""

from missionc.ir.agents import Agent, AgentSet, Anywhere, Exactly, Place
from missionc.ir.couplings import BeaconCover, Formation, FormationEdge, Graph, Proximity
from missionc.ir.dynamics import DoubleIntegrator, Dynamics, SingleIntegrator, Unicycle
from missionc.ir.formulas import About, Apply, AtLeastOf, Belongs, Formula, Holds, Length, OfAgent, Truth, Window
from missionc.ir.mission import Connectivity, Mission, Objective, Preference, Requirement, SolveWith, Tolerance
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
from missionc.ir.vehicles import AHEAD, FIGURES, PLAIN, AlongPath, Band, Figure, Fixed, Vehicle, Yaw

__all__ = [
    "AHEAD",
    "FIGURES",
    "PLAIN",
    "About",
    "Agent",
    "AgentSet",
    "AlongPath",
    "Altitude",
    "Anywhere",
    "Apply",
    "AtLeastOf",
    "Ball",
    "Band",
    "Beacon",
    "BeaconCover",
    "Belongs",
    "Box",
    "Compare",
    "Connected",
    "Connectivity",
    "Coordinate",
    "Difference",
    "Disc",
    "DistanceBetween",
    "DistanceTo",
    "DoubleIntegrator",
    "Dynamics",
    "Exactly",
    "Feature",
    "Figure",
    "Fixed",
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
    "Tolerance",
    "Touches",
    "Truth",
    "Unicycle",
    "Union",
    "Vector",
    "Vehicle",
    "Window",
    "World",
    "Yaw",
]
