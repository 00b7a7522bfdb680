"""Intermediate representation: the resolved mission, with SI units and time windows in steps.

The package contains values only. Every module after ``resolve.resolve_mission`` reads this representation and never the
syntax tree. Agents are numbered over the whole mission in the order of their declaration (mission indices). An agent
set is a tuple of mission indices.
"""

from missionc.ir.agents import *
from missionc.ir.couplings import *
from missionc.ir.dynamics import *
from missionc.ir.formulas import *
from missionc.ir.lanes import *
from missionc.ir.mission import *
from missionc.ir.places import *
from missionc.ir.predicates import *
from missionc.ir.resources import *
