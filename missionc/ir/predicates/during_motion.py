"""A predicate, or its negation, at all times from a step to the next.

Planners on roadmaps require it, as a label of moves, and use its margin only. No mission writes it.
"""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Region
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Measures


@dataclass(frozen=True, slots=True)
class DuringMotion(PredicateFacts):
    """True if the predicate (without ``truth``, its negation) holds during the agent's whole motion from this step.

    At the last step, true if it holds there.
    """

    predicate: PredicateFacts
    truth: bool

    @property
    def reads_motion(self) -> bool:
        return True

    @property
    def regions(self) -> tuple[Region, ...]:
        return self.predicate.regions

    @property
    def open_border(self) -> bool:
        return self.predicate.open_border is self.truth

    def margin(self, view: Measures) -> Array:
        """Least margin over the motion: (...), metres."""
        return view.least_in_motion(self.at_place)

    def at_place(self, view: Measures) -> Array:
        """Margin at the place of the view: (...), metres."""
        margin = self.predicate.margin(view)
        return margin if self.truth else -margin


def decided_by_place(predicate: PredicateFacts) -> bool:
    """Return whether the place of the evaluated agent decides the predicate at each time."""
    of_team = predicate.about_team or predicate.others or predicate.formation or predicate.graph
    moving = predicate.reads_speed or predicate.reads_heading or predicate.reads_motion
    return not (of_team or moving or predicate.reads_past)
