"""``deep(goal, 0.3 m)``: at least a length inside a region."""

from dataclasses import dataclass
from typing import Any, ClassVar

from missionc.extension import PlacePredicate, Region, signed_distance


@dataclass(frozen=True)
class Deep(PlacePredicate):
    parameters: ClassVar[tuple[str, ...]] = ("region", "a length")
    says: ClassVar[str] = "at least a length inside a region"
    example: ClassVar[str] = "deep(goal, 0.3 m)"
    slope: ClassVar[float] = 1.0

    area: Region
    depth: float

    def value(self, xp: Any, place: Any) -> Any:
        return -signed_distance(xp, self.area.shape, place) - self.depth
