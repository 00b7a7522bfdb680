"""Heading predicates: an agent faces a direction, or a beacon, within an angle.

Angles are differences on the circle: 350 deg and 10 deg differ by 20 deg. For a direction, the margin is an angle. For
a beacon, it is the agent's distance from the nearest position with too large an angle, in metres.
"""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Beacon
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


@dataclass(frozen=True, slots=True)
class Facing(PredicateFacts):
    """Heading predicate: the heading is within the angle ``within``, rad, in (0, pi), of a direction or of the bearing
    of a beacon.

    A direction ``towards`` is in rad, counterclockwise from the x axis.
    """

    towards: float | Beacon
    within: float

    @property
    def reads_speed(self) -> bool:
        """True, since the heading of a moving agent is the direction of its velocity."""
        return True

    @property
    def reads_heading(self) -> bool:
        return True

    @property
    def unit(self) -> str:
        return "m" if isinstance(self.towards, Beacon) else "rad"

    def margin(self, view: Measures) -> Array:
        """Margin of the heading: (...), rad for a direction, metres for a beacon."""
        return view.facing(self.towards, self.within)

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of the margin: (...), m/s.

        The heading is constant between steps; the bearing of a beacon changes.
        """
        return view.motion() if isinstance(self.towards, Beacon) else 0.0 * view.motion()

    def moved(self, borders: Borders) -> Facing:
        """Predicate unchanged, since a position error does not change the heading."""
        return self

    def show(self, words: Words) -> str:
        towards = self.towards.name if isinstance(self.towards, Beacon) else words.angle(self.towards)
        return f"heading within {words.angle(self.within)} of {towards}"

    def phrases(self, words: Phrases) -> tuple[str, str]:
        whither = f"`{self.towards.name}`" if isinstance(self.towards, Beacon) else words.angle(self.towards)
        where = f"within {words.angle(self.within)} of {whither}"
        return f"faces {where}", f"does not face {where}"
