"""Features of an agent's state and distances, the terms of comparisons."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Beacon, Region
from missionc.ir.predicates.views import Array, Changes, Measures, Words
from missionc.ir.resources import Resource


class FeatureFacts:
    """Facts of a feature; kinds override these defaults."""

    __slots__ = ()

    @property
    def others(self) -> tuple[int, ...]:
        """Named agents."""
        return ()

    def reads_oneself(self, dimension: int) -> bool:
        return True

    def is_of_one(self, agent: int) -> bool:
        """Return whether it is the distance from an agent to itself."""
        ends = {*self.others, agent} if self.reads_oneself(3) else {*self.others}
        return bool(self.others) and len(ends) == 1

    def direction(self, dimension: int) -> tuple[float, ...] | None:
        """Vector whose inner product with the agent's position equals it up to a constant.

        None if there is none.
        """
        return None

    @property
    def unit(self) -> str:
        return "m"

    @property
    def reads_past(self) -> bool:
        """True if it depends on earlier steps."""
        return False

    def measured(self, view: Measures) -> Array:
        """Value: (...), in its unit (metres, m/s or the unit of a resource)."""
        raise NotImplementedError

    def rate(self, view: Changes) -> Array:
        """Bound on the rate of change of its value if it has no direction: (...), per second."""
        return view.motion()

    def show(self, words: Words) -> str:
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class Coordinate(FeatureFacts):
    axis: int

    def direction(self, dimension: int) -> tuple[float, ...]:
        return tuple(float(axis == self.axis) for axis in range(dimension))

    def measured(self, view: Measures) -> Array:
        """Coordinate: (...), metres."""
        return view.coordinate(self.axis)

    def show(self, words: Words) -> str:
        return "xyz"[self.axis]


@dataclass(frozen=True, slots=True)
class Speed(FeatureFacts):
    """Speed at a step: of the motion that starts there (at the last step, of the last motion)."""

    @property
    def unit(self) -> str:
        return "m/s"

    def measured(self, view: Measures) -> Array:
        """Speed: (...), m/s."""
        return view.speed()

    def rate(self, view: Changes) -> Array:
        """Acceleration: (...), m/s²."""
        return view.acceleration()

    def show(self, words: Words) -> str:
        return "speed"


@dataclass(frozen=True, slots=True)
class Altitude(FeatureFacts):
    """The third coordinate in a volume; the team's ``altitude`` in a plane mission."""

    def reads_oneself(self, dimension: int) -> bool:
        return dimension == 3

    def direction(self, dimension: int) -> tuple[float, ...]:
        return (0.0, 0.0, 1.0)[:dimension]

    def measured(self, view: Measures) -> Array:
        """Altitude: (...), metres."""
        return view.altitude()

    def show(self, words: Words) -> str:
        return "altitude"


@dataclass(frozen=True, slots=True)
class DistanceTo(FeatureFacts):
    """Distance from the agent's centre to a region's border (negative inside), a beacon, or another agent's centre."""

    target: Region | Beacon | int

    @property
    def others(self) -> tuple[int, ...]:
        return (self.target,) if isinstance(self.target, int) else ()

    def measured(self, view: Measures) -> Array:
        """Distance: (...), metres."""
        if isinstance(self.target, Region):
            return view.outside(self.target)
        return view.to_beacon(self.target) if isinstance(self.target, Beacon) else view.apart(None, self.target)

    def rate(self, view: Changes) -> Array:
        """Bound on its rate of change: (...), m/s."""
        return view.relative(None, self.target) if isinstance(self.target, int) else view.motion()

    def show(self, words: Words) -> str:
        return f"distance({words.agent(self.target) if isinstance(self.target, int) else self.target.name})"


@dataclass(frozen=True, slots=True)
class DistanceBetween(FeatureFacts):
    first: int
    second: int

    @property
    def others(self) -> tuple[int, ...]:
        return (self.first, self.second)

    def reads_oneself(self, dimension: int) -> bool:
        return False

    def measured(self, view: Measures) -> Array:
        """Distance: (...), metres."""
        return view.apart(self.first, self.second)

    def rate(self, view: Changes) -> Array:
        """Bound on its rate of change: (...), m/s."""
        return view.relative(self.first, self.second)

    def show(self, words: Words) -> str:
        return f"distance({words.agent(self.first)}, {words.agent(self.second)})"


@dataclass(frozen=True, slots=True)
class Level(FeatureFacts):
    """Level of an agent's resource."""

    resource: Resource

    @property
    def unit(self) -> str:
        return ""

    @property
    def reads_past(self) -> bool:
        return True

    def measured(self, view: Measures) -> Array:
        """Level: (...), in the unit of the resource (a number)."""
        return view.level(self.resource)

    def rate(self, view: Changes) -> Array:
        """Bound on its rate of change: (...), units per second (a number)."""
        return view.use(self.resource)

    def show(self, words: Words) -> str:
        return self.resource.name


Feature: TypeAlias = Coordinate | Speed | Altitude | DistanceTo | DistanceBetween | Level
