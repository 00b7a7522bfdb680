"""The intermediate representation: the mission as meant, names are objects, units are SI, windows are whole steps.

Values only. Everything after ``resolve.resolve_mission`` reads this and never the tree
as written. Agents are numbered through the whole mission, in the order of
their declaration; an agent set is a tuple of such numbers in the order meant.
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
