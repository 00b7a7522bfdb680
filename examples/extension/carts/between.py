"""``between(a, b, 6 m)``: the distances from two beacons add up to at most so many metres."""

from dataclasses import dataclass
from typing import Any, ClassVar

from missionc.extension import Beacon, PlacePredicate, Unfit


@dataclass(frozen=True)
class Between(PlacePredicate):
    parameters: ClassVar[tuple[str, ...]] = ("beacon", "beacon", "a length")
    says: ClassVar[str] = "the distances from two beacons add up to at most a length"
    example: ClassVar[str] = "between(dock, gate, 6 m)"
    slope: ClassVar[float] = 2.0  # a metre away from both adds two metres

    first: Beacon
    second: Beacon
    length: float

    def __post_init__(self) -> None:
        apart = sum((a - b) ** 2 for a, b in zip(self.first.position, self.second.position, strict=True)) ** 0.5
        if self.length < apart:
            raise Unfit(f"the beacons are {apart:g} m apart, so no place is within {self.length:g} m")

    def value(self, xp: Any, place: Any) -> Any:
        return self.length - _distance(xp, place, self.first) - _distance(xp, place, self.second)


def _distance(xp: Any, place: Any, beacon: Beacon) -> Any:
    offsets = [place[..., axis] - each for axis, each in enumerate(beacon.position)]
    return xp.sqrt(sum(each * each for each in offsets))
