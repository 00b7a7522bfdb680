"""Headings as predicates: an agent faces within an angle of a direction, or of that in which a beacon is.

Angles are differences round the circle, so that 350 deg is 20 deg from 10 deg. Of a direction the margin is the angle
to spare; of a beacon it is how far the agent is from where it would face too far aside, which is in metres.
"""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Beacon
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


@dataclass(frozen=True, slots=True)
class Facing(PredicateFacts):
    """The heading differs by at most ``within``, rad, in (0, pi), from ``towards``: rad from the x axis to the left."""

    towards: float | Beacon
    within: float

    @property
    def reads_speed(self) -> bool:
        """Who moves moves where it faces."""
        return True

    @property
    def reads_heading(self) -> bool:
        return True

    @property
    def unit(self) -> str:
        return "m" if isinstance(self.towards, Beacon) else "rad"

    def margin(self, view: Measures) -> Array:
        return view.facing(self.towards, self.within)

    def rate(self, view: Changes) -> Array:
        """Between two steps the heading is what it was at the first of them; where a beacon is changes with the way."""
        return view.motion() if isinstance(self.towards, Beacon) else 0.0 * view.motion()

    def moved(self, borders: Borders) -> Facing:
        """No flight that misses its plan by some metres faces elsewhere for that."""
        return self

    def show(self, words: Words) -> str:
        towards = self.towards.name if isinstance(self.towards, Beacon) else words.angle(self.towards)
        return f"heading within {words.angle(self.within)} of {towards}"

    def phrases(self, words: Phrases) -> tuple[str, str]:
        whither = f"`{self.towards.name}`" if isinstance(self.towards, Beacon) else words.angle(self.towards)
        where = f"within {words.angle(self.within)} of {whither}"
        return f"faces {where}", f"does not face {where}"
