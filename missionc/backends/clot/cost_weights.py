"""Cost weights of trajectory optimisation, and the robustness margins that it aims at.

Costs add up over agents and steps. Shortfalls of margins are in metres (of speed and
acceleration, in the metres they move within a step; of turning, in the metres it leads aside),
and count squared. Each figure says its unit and what it is for, which is what ``--emit cost-graph``
prints.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from missionc.backends.clot.settings import Spare, clot_settings
from missionc.backends.setting import setting
from missionc.geometry.natural_scale import body
from missionc.ir import Mission, Objective


def spare(mission: Mission) -> Spare:
    """What margins of a mission are asked to have to spare."""
    standard = clot_settings(mission).spare
    least = standard.share * longest_step(mission)
    return replace(standard, task=max(standard.task, least), bodies=max(standard.bodies, least))


def with_room(mission: Mission, share: float = 1.0) -> Spare:
    """Margins that are wanted if there is room: wider ones in a larger world, and by their natural scales.

    Args:
        share: of those by their natural scales.
    """
    least = spare(mission)
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    extent = float((high - low)[:2].min())
    room = clot_settings(mission).spare.room * extent
    scaled = max(least.scaled, share * clot_settings(mission).shortening.wide)
    bodies = max(least.bodies, room, scaled * body(mission))
    return replace(least, task=max(least.task, room), bodies=bodies, scaled=scaled)


def longest_step(mission: Mission) -> float:
    """How far the fastest agent goes within one step, metres."""
    return float(max(agent.dynamics.top_speed for agent in mission.agents) * mission.step)


SHORT = 0.01
"""The share of the longest step below which the way between neighbouring control points counts by its square."""


@dataclass(frozen=True, slots=True)
class Aim:
    """What a plan is made less of, while nothing else has a cost."""

    length: float = setting(0.0, "/m^2", "between neighbouring control points")
    bend: float = setting(0.0, "/m^2", "of second differences of control points")
    metres: float = setting(0.0, "/m", "of way between neighbouring control points")
    steps: int = setting(0, "steps", "of descent at most")
    gain: float = setting(0.0, "", "of the cost: the share that a step must gain for there to be another")
    cuts: int = setting(4, "programs", "for a step, each with what the last one broke")


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
