"""Features: quantities of an agent's state, and distances, that comparisons combine linearly."""

from __future__ import annotations

from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Beacon, Region
from missionc.ir.predicates.views import Array, Changes, Measures, Words
from missionc.ir.resources import Resource


class FeatureFacts:
    """Base class of features; each kind overrides some of these defaults."""

    __slots__ = ()

    @property
    def others(self) -> tuple[int, ...]:
        """Agents that the feature names."""
        return ()

    def reads_oneself(self, dimension: int) -> bool:
        return True

    def is_of_one(self, agent: int) -> bool:
        """Return true if the feature, evaluated for ``agent``, is the distance from an agent to itself."""
        ends = {*self.others, agent} if self.reads_oneself(3) else {*self.others}
        return bool(self.others) and len(ends) == 1

    def direction(self, dimension: int) -> tuple[float, ...] | None:
        """Vector whose inner product with the agent's position equals the feature up to a constant; None if the feature
        is not linear."""
        return None

    @property
    def unit(self) -> str:
        return "m"

    @property
    def reads_past(self) -> bool:
        """True if the feature depends on earlier steps."""
        return False

    def measured(self, view: Measures) -> Array:
        """Value of the feature: (...), in its unit (metres, m/s or the unit of a resource)."""
        raise NotImplementedError

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of a feature without ``direction``: (...), its unit per second."""
        return view.motion()

    def show(self, words: Words) -> str:
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class Coordinate(FeatureFacts):
    axis: int

    def direction(self, dimension: int) -> tuple[float, ...]:
        return tuple(float(axis == self.axis) for axis in range(dimension))

    def measured(self, view: Measures) -> Array:
        """Coordinate of the agent's position: (...), metres."""
        return view.coordinate(self.axis)

    def show(self, words: Words) -> str:
        return "xyz"[self.axis]


@dataclass(frozen=True, slots=True)
class Speed(FeatureFacts):
    """Speed of the agent during the step that starts at the evaluated time (at the last step, of the last motion)."""

    @property
    def unit(self) -> str:
        return "m/s"

    def measured(self, view: Measures) -> Array:
        """Speed of the agent: (...), m/s."""
        return view.speed()

    def rate(self, view: Changes) -> Array:
        """Acceleration of the agent: (...), m/s²."""
        return view.acceleration()

    def show(self, words: Words) -> str:
        return "speed"


@dataclass(frozen=True, slots=True)
class Altitude(FeatureFacts):
    """Altitude of the agent: the third coordinate in a volume, the team's ``altitude`` in a plane mission."""

    def reads_oneself(self, dimension: int) -> bool:
        return dimension == 3

    def direction(self, dimension: int) -> tuple[float, ...]:
        return (0.0, 0.0, 1.0)[:dimension]

    def measured(self, view: Measures) -> Array:
        """Altitude of the agent: (...), metres."""
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
        """Distance from the agent's centre to the target: (...), metres."""
        if isinstance(self.target, Region):
            return view.outside(self.target)
        return view.to_beacon(self.target) if isinstance(self.target, Beacon) else view.apart(None, self.target)

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of the distance from the agent's centre to the target: (...), m/s."""
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
        """Distance between the centres of two named agents: (...), metres."""
        return view.apart(self.first, self.second)

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of the distance between the centres of two named agents: (...), m/s."""
        return view.relative(self.first, self.second)

    def show(self, words: Words) -> str:
        return f"distance({words.agent(self.first)}, {words.agent(self.second)})"


@dataclass(frozen=True, slots=True)
class Level(FeatureFacts):
    """Level of a resource of the agent."""

    resource: Resource

    @property
    def unit(self) -> str:
        return ""

    @property
    def reads_past(self) -> bool:
        return True

    def measured(self, view: Measures) -> Array:
        """Level of the resource: (...), in the resource's unit."""
        return view.level(self.resource)

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of the level: (...), the resource's unit per second."""
        return view.use(self.resource)

    def show(self, words: Words) -> str:
        return self.resource.name


Feature: TypeAlias = Coordinate | Speed | Altitude | DistanceTo | DistanceBetween | Level
