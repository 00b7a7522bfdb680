"""Intermediate representation: the resolved mission, with SI units and windows in whole steps.

The package holds values only. Every module after ``resolve.resolve_mission`` reads this form and never the syntax tree.
Agents have numbers over the whole mission, in the order of their declaration. An agent set is a tuple of such numbers.
"""

from missionc.ir.agents import *
from missionc.ir.couplings import *
from missionc.ir.dynamics import *
from missionc.ir.formulas import *
from missionc.ir.lanes import *
from missionc.ir.mission import *
from missionc.ir.pads import *
from missionc.ir.places import *
from missionc.ir.predicates import *
from missionc.ir.resources import *
from missionc.ir.shapes import *
from missionc.ir.vehicles import *
