"""Cost weights of trajectory optimisation, and the robustness that each margin is asked to have to spare.

Costs add up over agents and steps. Shortfalls of margins are in metres (of speed and
acceleration, in the metres they move within a step; of turning, in the metres it leads aside),
and count squared. Each figure says its unit and what it is for, which is what ``--emit cost-graph``
prints.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from missionc.ir import Mission, Objective


def _figure(value: float, unit: str, says: str) -> float:
    figure: float = field(default=value, metadata={"unit": unit, "says": says})
    return figure


@dataclass(frozen=True, slots=True)
class Weights:
    """What a joint motion's costs weigh."""

    title: ClassVar[str] = "weight"
    task: float = _figure(400.0, "/m^2", "by which a margin of the formulas falls short")
    bodies: float = _figure(400.0, "/m^2", "of obstacles, separation and the world's bounds")
    limits: float = _figure(400.0, "/m^2", "of speed, acceleration and turning beyond their limits")
    links: float = _figure(
        1.0, "/m^2", "by which lambda_2 falls short of a ring's, where connectivity is judged by that"
    )
    length: float = _figure(0.02, "/m^2", "between neighbouring control points")
    bend: float = _figure(1.0, "/m^2", "of second differences of control points")
    metres: float = _figure(0.0, "/m", "of way between neighbouring control points, in a descent")


@dataclass(frozen=True, slots=True)
class Spare:
    """What margins are asked to have to spare."""

    title: ClassVar[str] = "spare"
    task: float = _figure(0.03, "m", "of every margin of the formulas, where its tolerance allows")
    bodies: float = _figure(0.03, "m", "beyond what obstacles, separation and bounds need")
    limits: float = _figure(0.02, "", "of each limit, left unused")
    links: float = _figure(
        0.3, "m", "of a link for it to count in full in lambda_2, where connectivity is judged by that"
    )


ROOM = 0.005
"""The share of the world's narrower side that is asked for where there is room."""

SHARE = 0.02
"""The share of the longest step of the fastest agent that is asked for at least."""


def spare(mission: Mission) -> Spare:
    """What margins of a mission are asked to have to spare."""
    standard, least = Spare(), SHARE * longest_step(mission)
    return replace(standard, task=max(standard.task, least), bodies=max(standard.bodies, least))


def with_room(mission: Mission) -> Spare:
    """What they are asked for where there is room: more in a larger world, and of larger bodies."""
    least = spare(mission)
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    extent = float((high - low)[:2].min())
    room = ROOM * extent
    return replace(least, task=max(least.task, room), bodies=max(least.bodies, room))


def longest_step(mission: Mission) -> float:
    """How far the fastest agent goes within one step, metres."""
    return float(max(agent.dynamics.top_speed for agent in mission.agents) * mission.step)


SHORT = 0.01
"""The share of the longest step below which the way between neighbouring control points counts by its square."""


@dataclass(frozen=True, slots=True)
class ProbeWeights:
    """What a moved waypoint costs, where costs are only compared with each other: Algorithm 1's."""

    title: ClassVar[str] = "probe"
    bodies: float = _figure(8.0, "/m", "by which obstacles, bounds and separation lack room")
    task: float = _figure(6.0, "/m", "of robustness")
    limits: float = _figure(4.0, "/m", "in a step above a limit")
    bend: float = _figure(2.4, "/m^2", "of half the squared second differences")
    room: float = _figure(0.08, "m", "beyond what bodies need, below which they cost: r_o and r_s")
    margin: float = _figure(0.1, "m", "of robustness above which a goal costs nothing, where goals cost what they lack")
    later: float = _figure(0.3, "", "of what a goal lacks, where agents still to come may see to it")


@dataclass(frozen=True, slots=True)
class Aim:
    """What a plan is made less of, while nothing else has a cost."""

    length: float = _figure(0.0, "/m^2", "between neighbouring control points")
    bend: float = _figure(0.0, "/m^2", "of second differences of control points")
    metres: float = _figure(0.0, "/m", "of way between neighbouring control points")
    steps: int = field(default=0, metadata={"unit": "steps", "says": "of descent at most"})
    gain: float = _figure(0.0, "", "of the cost: the share that a step must gain for there to be another")
    cuts: int = field(default=4, metadata={"unit": "programs", "says": "for a step, each with what the last one broke"})


METRES = Aim(length=0.01, bend=0.05, metres=1.0, steps=40, gain=4e-4, cuts=2)
"""For the distance itself, from a motion of which the squares of its steps are least."""

AIMS = {
    Objective.DISTANCE: (Aim(length=1.0, bend=0.05, steps=40, gain=1e-3, cuts=2), METRES),
    Objective.ENERGY: (Aim(bend=1.0, steps=40, gain=1e-3, cuts=2),),
}
"""One after the other."""

STRAIGHT = Aim(length=1.0, bend=1.0, steps=60, gain=2e-3, cuts=2)
"""For plans from a roadmap, which are far from straight."""

TIDY = Aim(length=0.2, bend=1.0, steps=2, gain=1e-2)
"""Where nothing is asked to be least: most of the detours go in the first steps."""
