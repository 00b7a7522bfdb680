"""What each cost weighs, and how much more than nothing each margin is asked to be. The one place for both.

Costs add up over agents and steps. Shortfalls of margins are in metres (of speed and
acceleration, in the metres they move within a step), and count squared.
"""

from __future__ import annotations

from dataclasses import dataclass

from missionc.ir import Objective


@dataclass(frozen=True, slots=True)
class Weights:
    """Args:
    task: for each m² by which a margin of the formulas falls short.
    bodies: for each m² of obstacles, separation and the world's bounds.
    limits: for each m² of speed and acceleration.
    length: for each m² between neighbouring control points.
    bend: for each m² of second differences of control points.
    """

    task: float = 400.0
    bodies: float = 400.0
    limits: float = 400.0
    length: float = 0.02
    bend: float = 1.0


@dataclass(frozen=True, slots=True)
class Spare:
    """Args:
    task: metres asked of every margin of the formulas, where its tolerance allows.
    bodies: metres beyond what obstacles, separation and bounds need.
    limits: the share of each limit that is left unused.
    """

    task: float = 0.03
    bodies: float = 0.03
    limits: float = 0.02


@dataclass(frozen=True, slots=True)
class ProbeWeights:
    """What a moved waypoint costs, where costs are only compared with each other.

    Args:
        bodies: for each metre by which obstacles, bounds and separation lack room.
        task: for each metre of robustness.
        limits: for each metre in a step above a limit.
        bend: for each m² of half the squared second differences.
        room: metres beyond what bodies need, below which they cost: r_o and r_s.
        margin: metres of robustness above which a goal costs nothing, where goals cost what they lack.
    """

    bodies: float = 8.0
    task: float = 6.0
    limits: float = 4.0
    bend: float = 2.4
    room: float = 0.08
    margin: float = 0.1


@dataclass(frozen=True, slots=True)
class Aim:
    """What a plan is made less of.

    Args:
        length, bend: as in ``Weights``, while nothing else has a cost.
        steps: of descent at most.
        gain: the share of the cost that a step must gain for there to be another.
    """

    length: float
    bend: float
    steps: int
    gain: float


AIMS = {Objective.DISTANCE: Aim(1.0, 0.05, 40, 1e-3), Objective.ENERGY: Aim(0.0, 1.0, 40, 1e-3)}

TIDY = Aim(0.2, 1.0, 2, 1e-2)
"""Where nothing is asked to be least: most of the detours go in the first steps."""
