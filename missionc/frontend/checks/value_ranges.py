"""Value ranges of comparisons: interval bounds on the difference of their two sides, for every plan."""

from __future__ import annotations

import math

from missionc import ir
from missionc.base.late_dataclass import Record
from missionc.frontend.checks.free_space import FreeSpace
from missionc.geometry.configuration_space import empty
from missionc.ir.wording import number


class Range(Record):
    """Closed interval of real numbers from ``low`` to ``high``."""

    low: float
    high: float

    def __add__(self, other: Range) -> Range:
        return Range(self.low + other.low, self.high + other.high)

    def scaled(self, weight: float) -> Range:
        ends = (self.low * weight, self.high * weight)
        return Range(min(ends), max(ends))


def of_comparison(ground: FreeSpace, agent: ir.Agent, comparison: ir.Compare) -> Range:
    """Range of a comparison's difference, which must be at least 0, for an agent and all others of its kind."""
    total = Range(comparison.constant, comparison.constant)
    for weight, feature in comparison.terms:
        total += of_feature(ground, agent, feature).scaled(weight)
    return total


def of_feature(ground: FreeSpace, agent: ir.Agent, feature: ir.Feature) -> Range:
    """Range of a state or a distance, in SI units, for an agent and all others of its kind."""
    mission = ground.mission
    low, high = mission.world.low, mission.world.high
    match feature:
        case ir.Coordinate(axis):
            return Range(low[axis], high[axis])
        case ir.Speed():
            return Range(agent.dynamics.lowest_speed, agent.dynamics.top_speed)
        case ir.Altitude():
            return Range(low[2], high[2]) if mission.dimension == 3 else Range(agent.altitude, agent.altitude)
        case ir.Level(resource):
            most = mission.horizon * (resource.per_second + resource.per_metre * agent.dynamics.top_speed)
            return Range(resource.start - most, resource.capacity)
        case ir.DistanceBetween(first, second):
            return _between(mission, first, second)
        case ir.DistanceTo(int()):
            return Range(0.0, math.dist(low, high))
        case ir.DistanceTo(ir.Beacon() as beacon):
            return Range(0.0, _farthest(mission, beacon.position, beacon.position))
        case ir.DistanceTo(region):
            assert isinstance(region, ir.Region)
            area = ground.atlas.outer(region.shape)
            if empty(area):
                return Range(-math.inf, math.inf)
            corners = ground.atlas.bounds(area)
            deepest = min(b - a for a, b in zip(*corners, strict=True)) / 2
            return Range(-deepest, _farthest(mission, *corners))


def _between(mission: ir.Mission, first: int, second: int) -> Range:
    if first == second:
        return Range(0.0, 0.0)
    bodies = mission.agents[first].radius + mission.agents[second].radius + mission.separation
    return Range(bodies, math.dist(mission.world.low, mission.world.high))


def _farthest(mission: ir.Mission, low: ir.Vector, high: ir.Vector) -> float:
    """Upper bound on the distance from a point of the world to a point in a box, metres."""
    spans = zip(mission.world.low, mission.world.high, low, high, strict=True)
    return math.hypot(*(max(d - a, b - c, 0.0) for a, b, c, d in spans))


def range_in_words(comparison: ir.Compare, values: Range) -> str:
    """Text for the range of the single state or distance in a comparison."""
    match comparison.terms:
        case ((weight, feature),) if weight != 0:
            both = (values + Range(-comparison.constant, -comparison.constant)).scaled(1 / weight)
            what = {ir.Speed: "the speed", ir.Altitude: "the altitude"}.get(type(feature), "the distance")
            if isinstance(feature, ir.Coordinate):
                what = f"`{'xyz'[feature.axis]}`"
            if isinstance(feature, ir.Level):
                what = f"`{feature.resource.name}`"
            low, high = number(round(both.low, 4)), number(round(both.high, 4))
            says = f"{what} is {low}" if low == high else f"{what} stays between {low} and {high}"
            return f"{says} {feature.unit}".rstrip()
        case _:
            return "the difference of both sides never changes sign"
