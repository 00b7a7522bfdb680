"""Cost weights of trajectory optimisation, and its target margins.

Costs add up over agents and steps. Shortfalls of margins are in metres and count squared. For speed and acceleration, a
shortfall is the distance moved within a step; for turning, the lateral distance. Each weight has its unit and purpose,
which ``--emit cost-graph`` prints.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from missionc.backends.clot.settings import Spare, Weights, clot_settings
from missionc.backends.setting import setting
from missionc.base.late_dataclass import Record
from missionc.geometry.natural_scale import body
from missionc.ir import Mission, Objective


def spare(mission: Mission) -> Spare:
    """Target margins of a mission."""
    standard = clot_settings(mission).spare
    least = standard.share * longest_step(mission)
    return replace(standard, task=max(standard.task, least), bodies=max(standard.bodies, least))


def with_room(mission: Mission, share: float = 1.0) -> Spare:
    """Target margins for a world with free space: wider in a larger world, and relative to the natural scales of the
    margins.

    Args:
        share: fraction of the margins relative to natural scales.
    """
    least = spare(mission)
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    extent = float((high - low)[:2].min())
    room = clot_settings(mission).spare.room * extent
    scaled = max(least.scaled, share * clot_settings(mission).shortening.wide)
    bodies = max(least.bodies, room, scaled * body(mission))
    return replace(least, task=max(least.task, room), bodies=bodies, scaled=scaled)


def longest_step(mission: Mission) -> float:
    """Greatest distance of the fastest agent within one step, metres."""
    return float(max(agent.dynamics.top_speed for agent in mission.agents) * mission.step)


SHORT = 0.01
"""Fraction of the longest step below which the distance of neighbouring control points counts squared."""


class Aim(Record):
    """Objective of an improvement of a plan: weights of length, bend and distance, and limits of the descent."""

    length: float = setting(0.0, "cost of squared distances between neighbouring control points (/m^2)")
    bend: float = setting(0.0, "cost of squared second differences of control points (/m^2)")
    metres: float = setting(0.0, "cost of distances between neighbouring control points (/m)")
    steps: int = setting(0, "largest number of descent steps")
    gain: float = setting(0.0, "smallest relative decrease of the cost for another step")
    cuts: int = setting(4, "number of programs for a step, each with the constraints that the last program violated")

    def weights(self, of: Weights) -> Weights:
        """Cost weights with the weights of length, bend and distance of this objective."""
        return replace(of, length=self.length, bend=self.bend, metres=self.metres)


METRES = Aim(length=0.01, bend=0.05, metres=1.0, steps=40, gain=4e-4, cuts=2)
"""Objective that minimises distance, from a trajectory with minimal squared steps."""

AIMS = {
    Objective.DISTANCE: (Aim(length=1.0, bend=0.05, steps=40, gain=1e-3, cuts=2), METRES),
    Objective.ENERGY: (Aim(bend=1.0, steps=40, gain=1e-3, cuts=2),),
}
"""Stages of improvement for each objective of missions, in order."""

STRAIGHT = Aim(length=1.0, bend=1.0, steps=60, gain=2e-3, cuts=2)
"""Objective for plans from a roadmap, which are far from straight."""

WIDE = Aim(length=0.01, bend=0.3, metres=1.0, steps=10, gain=4e-3, cuts=2)
"""Objective for a plan after a polish for wider margins, which makes it longer."""

TIDY = Aim(length=0.2, bend=1.0, steps=2, gain=1e-2)
"""Objective of missions without ``minimize``: the first steps remove most detours."""
