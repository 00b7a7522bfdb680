"""Comparisons: linear inequalities in the state of an agent and its distances, or in distances of named agents.

The margin is the value divided by its greatest rate of change per metre of motion: the norm of the coordinates' weights
plus the magnitudes of the distances' weights. A comparison of speed only is divided by the speed's weight and stays in
m/s; likewise for a resource.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import replace

from missionc.base.late_dataclass import dataclass
from missionc.ir.places import Beacon, Region
from missionc.ir.predicates.facts import PredicateFacts
from missionc.ir.predicates.features import Coordinate, DistanceBetween, DistanceTo, Feature, Level, Speed
from missionc.ir.predicates.views import Array, Borders, Changes, Measures, Phrases, Words


@dataclass(frozen=True, slots=True)
class Compare(PredicateFacts):
    """Comparison predicate: ``constant + sum(weight * feature) >= 0``, or ``> 0`` if ``strict``."""

    terms: tuple[tuple[float, Feature], ...]
    constant: float
    strict: bool

    @property
    def about_team(self) -> bool:
        """True if the comparison reads only distances between named pairs of agents."""
        return bool(self.terms) and all(isinstance(feature, DistanceBetween) for _, feature in self.terms)

    @property
    def others(self) -> frozenset[int]:
        return frozenset(agent for _, feature in self.terms for agent in feature.others)

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        return tuple((each.first, each.second) for _, each in self.terms if isinstance(each, DistanceBetween))

    def pairs_of(self, agent: int) -> tuple[tuple[int, int], ...]:
        targets = [each.target for _, each in self.terms if isinstance(each, DistanceTo)]
        return self.pairs + tuple((agent, each) for each in targets if isinstance(each, int) and each != agent)

    def asked_of(self, agent: int) -> Compare:
        """Comparison without the distances between ``agent`` and itself, which are 0."""
        terms = tuple(term for term in self.terms if not term[1].is_of_one(agent))
        return self if len(terms) == len(self.terms) else replace(self, terms=terms)

    @property
    def reads_speed(self) -> bool:
        return any(isinstance(feature, Speed) for _, feature in self.terms)

    @property
    def is_of_speed(self) -> bool:
        return all(isinstance(feature, Speed) for _, feature in self.terms)

    @property
    def reads_past(self) -> bool:
        return any(feature.reads_past for _, feature in self.terms)

    @property
    def regions(self) -> tuple[Region, ...]:
        """Regions on which the comparison depends: targets of distances and refill regions of resources."""
        found: dict[Region, None] = {}
        for _, feature in self.terms:
            match feature:
                case DistanceTo(Region() as region):
                    found.setdefault(region)
                case Level(resource):
                    found.update(dict.fromkeys(refill.region for refill in resource.refills))
                case _:
                    pass
        return tuple(found)

    @property
    def unit(self) -> str:
        units = {feature.unit for _, feature in self.terms}
        return units.pop() if len(units) == 1 else "m"

    @property
    def open_border(self) -> bool:
        return self.strict

    def reads_oneself(self, dimension: int) -> bool:
        return any(weight and feature.reads_oneself(dimension) for weight, feature in self.terms)

    def scale(self, dimension: int) -> float:
        """Greatest change of the value per metre of an agent's motion, or per m/s if only the speed counts."""
        distances: dict[Feature, float] = defaultdict(float)
        speed = 0.0
        for weight, feature in self.terms:
            if feature.unit != "m":
                speed += weight
            elif feature.direction(dimension) is None:
                distances[feature] += weight
        in_metres = math.hypot(*filter(None, self._direction(dimension))) + sum(map(abs, distances.values()))
        return in_metres or abs(speed) or 1.0

    def margin(self, view: Measures) -> Array:
        """Margin of the comparison, its value divided by ``scale``: (...), metres, or m/s for speeds."""
        total = sum((weight * feature.measured(view) for weight, feature in self.terms), start=self.constant)
        value = total / self.scale(view.dimension)
        return value if self.terms else value + view.nothing()

    def rate(self, view: Changes) -> Array:
        """Upper bound on the rate of change of the margin: (...), m/s."""
        direction = self._direction(view.dimension)
        rate = view.along(direction) if any(direction) else 0.0
        for weight, feature in self.terms:
            if weight and feature.direction(view.dimension) is None:
                rate = rate + abs(weight) * feature.rate(view)
        return rate / self.scale(view.dimension)

    def moved(self, borders: Borders) -> Compare:
        """Comparison with its bound moved by the position error of the agents; a distance between two agents moves by
        twice the error."""
        reach = sum(abs(weight) * _moves(feature) for weight, feature in self.terms)
        return Compare(self.terms, self.constant + borders.metres * reach, self.strict)

    def show(self, words: Words) -> str:
        terms = tuple((weight, feature.show(words)) for weight, feature in self.terms)
        return words.inequality(terms, self.constant, ">" if self.strict else ">=")

    def phrases(self, words: Phrases) -> tuple[str, str]:
        match self.terms:
            case ((_, feature),):
                return _of_one(feature, self._bound(feature.unit, words), words)
            case _ if self.about_team:
                return f"`{self.show(words)}` is true", f"`{self.show(words)}` is false"
            case _:
                return f"satisfies `{self.show(words)}`", f"does not satisfy `{self.show(words)}`"

    def _direction(self, dimension: int) -> tuple[float, ...]:
        weights = [0.0] * dimension
        for weight, feature in self.terms:
            for axis, share in enumerate(feature.direction(dimension) or ()):
                weights[axis] += weight * share
        return tuple(weights)

    def _bound(self, unit: str, words: Phrases) -> str:
        """Wording of a comparison with one feature as a bound on that feature: ``at least 3 m``."""
        weight = self.terms[0][0]
        value = f"{words.number(-self.constant / weight)} {unit}".rstrip()
        if weight > 0:
            return f"more than {value}" if self.strict else f"at least {value}"
        return f"less than {value}" if self.strict else f"at most {value}"


def _moves(feature: Feature) -> float:
    """Greatest change of a feature, metres, if the position of every agent changes by a metre."""
    return 0.0 if feature.unit != "m" else 2.0 if feature.others else 1.0


def _of_one(feature: Feature, bound: str, words: Phrases) -> tuple[str, str]:
    """Wording of a bound on one feature, and wording of its negation."""
    match feature:
        case DistanceBetween(first, second):
            both = f"{words.agent(first)} and {words.agent(second)}"
            return f"{both} are {bound} apart", f"{both} are not {bound} apart"
        case DistanceTo(Region(name=name)):
            whence = f"the border of `{name}` (less than 0 inside)"
        case DistanceTo(Beacon(name=name)):
            whence = f"`{name}`"
        case DistanceTo(int(agent)):
            whence = words.agent(agent)
        case _:
            article = "an" if feature == Coordinate(0) or feature.show(words)[0] == "a" else "a"
            what = f"{article} {feature.show(words)} of {bound}"
            return f"has {what}", f"does not have {what}"
    return f"is {bound} from {whence}", f"is not {bound} from {whence}"
