"""Region predicates: bounds on the signed distance of an agent's centre or body to a region."""

from __future__ import annotations

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Region
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


class _Bound(PredicateFacts):
    """Base class: the agent's centre is inside the region by at least ``radii`` times its body radius."""

    __slots__ = ()

    @property
    def radii(self) -> int:
        raise NotImplementedError

    def margin(self, view: Measures) -> Array:
        """Margin of the predicate: depth of the agent's centre or body in the region; (...), metres.

        Source:
            [clot] III-C, first class of predicates, for one agent.
        """
        assert self.region is not None
        depth = -view.outside(self.region)
        return depth - self.radii * view.radius() if self.radii else depth

    def rate(self, view: Changes) -> Array:
        return view.motion()


@dataclass(frozen=True, slots=True)
class Inside(_Bound):
    """Region predicate: the agent's centre, or its whole body if ``body``, is in the region; the border belongs to the
    region."""

    region: Region
    body: bool

    @property
    def radii(self) -> int:
        return 1 if self.body else 0

    def moved(self, borders: Borders) -> Inside:
        return Inside(borders.region(self.region), self.body)

    def show(self, words: Words) -> str:
        return f"inside({self.region.name})" if self.body else self.region.name

    def phrases(self, words: Phrases) -> tuple[str, str]:
        name = f"`{self.region.name}`"
        if self.body:
            return f"has its whole body in {name}", f"does not have its whole body in {name}"
        return f"is in {name}", f"is not in {name}"


@dataclass(frozen=True, slots=True)
class Touches(_Bound):
    """Region predicate: some part of the agent's body is in the region; contact with the border counts."""

    region: Region

    @property
    def radii(self) -> int:
        return -1

    def moved(self, borders: Borders) -> Touches:
        return Touches(borders.region(self.region))

    def show(self, words: Words) -> str:
        return f"touches({self.region.name})"

    def phrases(self, words: Phrases) -> tuple[str, str]:
        return f"touches `{self.region.name}`", f"does not touch `{self.region.name}`"
