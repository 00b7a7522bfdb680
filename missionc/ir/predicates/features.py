"""Features of an agent's state and distances, which comparisons are linear in."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Beacon, Region
from missionc.ir.predicates.views import Array, Changes, Measures, Words
from missionc.ir.resources import Resource


class FeatureFacts:
    """What is asked of a feature; a kind says otherwise where it differs from this."""

    __slots__ = ()

    @property
    def others(self) -> tuple[int, ...]:
        """The agents that it names."""
        return ()

    def reads_oneself(self, dimension: int) -> bool:
        return True

    def is_of_one(self, agent: int) -> bool:
        """Whether it is the distance from an agent to itself, asked of that agent."""
        ends = {*self.others, agent} if self.reads_oneself(3) else {*self.others}
        return bool(self.others) and len(ends) == 1

    def direction(self, dimension: int) -> tuple[float, ...] | None:
        """The vector whose inner product with one's position it is, but for a constant; None where it is none."""
        return None

    @property
    def unit(self) -> str:
        return "m"

    @property
    def reads_past(self) -> bool:
        """Whether the steps before bear on it."""
        return False

    def measured(self, view: Measures) -> Array:
        """Its value: (...), in its unit."""
        raise NotImplementedError

    def rate(self, view: Changes) -> Array:
        """A bound on how fast its value changes, where it has no direction: (...), per second."""
        return view.motion()

    def show(self, words: Words) -> str:
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class Coordinate(FeatureFacts):
    axis: int

    def direction(self, dimension: int) -> tuple[float, ...]:
        return tuple(float(axis == self.axis) for axis in range(dimension))

    def measured(self, view: Measures) -> Array:
        return view.coordinate(self.axis)

    def show(self, words: Words) -> str:
        return "xyz"[self.axis]


@dataclass(frozen=True, slots=True)
class Speed(FeatureFacts):
    """The speed at a step: of the motion that starts there (of the last motion, at the last step)."""

    @property
    def unit(self) -> str:
        return "m/s"

    def measured(self, view: Measures) -> Array:
        return view.speed()

    def rate(self, view: Changes) -> Array:
        return view.acceleration()

    def show(self, words: Words) -> str:
        return "speed"


@dataclass(frozen=True, slots=True)
class Altitude(FeatureFacts):
    """The third coordinate in a volume; the team's ``altitude`` in a plane."""

    def reads_oneself(self, dimension: int) -> bool:
        return dimension == 3

    def direction(self, dimension: int) -> tuple[float, ...]:
        return (0.0, 0.0, 1.0)[:dimension]

    def measured(self, view: Measures) -> Array:
        return view.altitude()

    def show(self, words: Words) -> str:
        return "altitude"


@dataclass(frozen=True, slots=True)
class DistanceTo(FeatureFacts):
    """From the agent's centre to a region's border (negative inside), to a beacon, or to another agent's centre."""

    target: Region | Beacon | int

    @property
    def others(self) -> tuple[int, ...]:
        return (self.target,) if isinstance(self.target, int) else ()

    def measured(self, view: Measures) -> Array:
        if isinstance(self.target, Region):
            return view.outside(self.target)
        return view.to_beacon(self.target) if isinstance(self.target, Beacon) else view.apart(None, self.target)

    def rate(self, view: Changes) -> Array:
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
        return view.apart(self.first, self.second)

    def rate(self, view: Changes) -> Array:
        return view.relative(self.first, self.second)

    def show(self, words: Words) -> str:
        return f"distance({words.agent(self.first)}, {words.agent(self.second)})"


@dataclass(frozen=True, slots=True)
class Level(FeatureFacts):
    """What the agent has left of a resource."""

    resource: Resource

    @property
    def unit(self) -> str:
        return ""

    @property
    def reads_past(self) -> bool:
        return True

    def measured(self, view: Measures) -> Array:
        return view.level(self.resource)

    def rate(self, view: Changes) -> Array:
        return view.use(self.resource)

    def show(self, words: Words) -> str:
        return self.resource.name


Feature: TypeAlias = Coordinate | Speed | Altitude | DistanceTo | DistanceBetween | Level
