"""Flag predicates: an agent has visited one region since its last visit to another."""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Region
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words
from missionc.ir.resources import Flag


@dataclass(frozen=True, slots=True)
class Flagged(PredicateFacts):
    """Flag predicate: the agent's flag is set.

    Its margin is the robustness of the equivalent past formula over the earlier steps.
    """

    flag: Flag

    @property
    def reads_past(self) -> bool:
        return True

    @property
    def regions(self) -> tuple[Region, ...]:
        cleared = self.flag.cleared_in
        return (self.flag.set_in,) if cleared is None else (self.flag.set_in, cleared)

    def margin(self, view: Measures) -> Array:
        """Margin of the flag being set: (...), metres."""
        return view.flagged(self.flag)

    def rate(self, view: Changes) -> Array:
        """Zero rate, (...), m/s: between two steps a flag has its value of the earlier step."""
        return 0.0 * view.motion()

    def moved(self, borders: Borders) -> Flagged:
        return self

    def show(self, words: Words) -> str:
        return self.flag.name

    def phrases(self, words: Phrases) -> tuple[str, str]:
        return f"has `{self.flag.name}` set", f"does not have `{self.flag.name}` set"
