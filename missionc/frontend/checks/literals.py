"""Literals (predicates and their negations): the positions that each allows, and pairs that exclude each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field, replace
from typing import TypeAlias

from missionc.base.late_dataclass import Record
from missionc.geometry.configuration_space import Area, Atlas, covers, disjoint
from missionc.ir import Beacon, Compare, Coordinate, DistanceTo, Feature, Inside, Predicate, Region, Touches, Vector
from missionc.ir.distances.signed_distance import measured_outside


class Literal(Record):
    """Predicate, or its negation if ``positive`` is False."""

    predicate: Predicate
    positive: bool

    @property
    def opposite(self) -> Literal:
        return Literal(self.predicate, not self.positive)


class Unbounded(Record):
    """Bound of a predicate that does not constrain an agent's centre."""


UNBOUNDED = Unbounded()

MOST_RULES = 250
"""Maximum number of literals that are compared with one another; further ones are ignored."""

Bound: TypeAlias = Area | Unbounded


def comparison_literal(literal: Literal) -> Compare | Unbounded:
    """The literal as a comparison, such as ``-e > 0`` for ``not (e >= 0)``; ``UNBOUNDED`` if it is not one."""
    predicate = literal.predicate
    if not isinstance(predicate, Compare):
        return UNBOUNDED
    if literal.positive:
        return predicate
    terms = tuple((-weight, feature) for weight, feature in predicate.terms)
    return replace(predicate, terms=terms, constant=-predicate.constant, strict=not predicate.strict)


class LiteralRule(Record, eq=False):
    """Constraint of a literal on an agent's centre.

    ``within`` is an outer bound of the positions where the literal can be true, ``beyond`` an inner bound of those
    where it is false; ``said`` is the literal as a comparison.
    """

    literal: Literal
    said: Compare | Unbounded
    within: Bound
    beyond: Bound


def nowhere_literal(rule: LiteralRule, free: Area) -> bool:
    """Return whether the literal is false at every position in an area, which is an outer bound."""
    outside = not isinstance(rule.within, Unbounded) and disjoint(rule.within, free)
    return outside or (not isinstance(rule.beyond, Unbounded) and covers(rule.beyond, free))


def exclude(one: LiteralRule, other: LiteralRule) -> bool:
    """Return whether two literals exclude each other for one agent."""
    if one.literal == other.literal.opposite or _apart(one.said, other.said):
        return True
    if not isinstance(one.within, Unbounded) and nowhere_literal(other, one.within):
        return True
    return not isinstance(other.within, Unbounded) and _all_beyond(one, other.within)


def _all_beyond(rule: LiteralRule, area: Area) -> bool:
    return not isinstance(rule.beyond, Unbounded) and covers(rule.beyond, area)


class LiteralPlaces(Record, eq=False):
    """Positions that literals allow for the centre of an agent with a radius between two bounds in metres."""

    atlas: Atlas
    least: float
    most: float
    known: dict[Literal, LiteralRule] = field(default_factory=dict)

    def rule(self, literal: Literal) -> LiteralRule:
        if literal not in self.known:
            if len(self.known) < MOST_RULES:
                rule = LiteralRule(literal, comparison_literal(literal), self._within(literal), self._beyond(literal))
            else:
                rule = LiteralRule(literal, comparison_literal(literal), UNBOUNDED, UNBOUNDED)
            self.known[literal] = rule
        return self.known[literal]

    def _within(self, literal: Literal) -> Bound:
        atlas = self.atlas
        match literal:
            case Literal(Inside(region, body), True):
                area = atlas.outer(region.shape)
                return atlas.shrunk(area, self.least) if body else area
            case Literal(Touches(region), True) if measured_outside(region.shape):
                return atlas.near(region.shape, self.most, outer=True)
            case Literal(Compare(), _):
                inequality = comparison_literal(literal)
                return UNBOUNDED if isinstance(inequality, Unbounded) else self._where(inequality)
            case _:
                return UNBOUNDED

    def _where(self, inequality: Compare) -> Bound:
        """Outer bound on the positions that a comparison allows: a half space, or the points within a distance."""
        match inequality.terms:
            case ((weight, DistanceTo(target)),) if weight < 0 and not isinstance(target, int):
                return self._up_to(target, inequality.constant / -weight)
            case terms if terms and all(isinstance(feature, Coordinate) for _, feature in terms):
                return self.atlas.half_space(_weights(terms, self.atlas.world.dimension), inequality.constant)
            case _:
                return UNBOUNDED

    def _up_to(self, target: Region | Beacon, distance: float) -> Bound:
        atlas = self.atlas
        if isinstance(target, Beacon):
            return atlas.grown(atlas.point(target.position), max(distance, 0.0), outer=True)
        if distance < 0:
            return atlas.shrunk(atlas.outer(target.shape), -distance)
        return atlas.near(target.shape, distance, outer=True) if measured_outside(target.shape) else UNBOUNDED

    def _beyond(self, literal: Literal) -> Bound:
        atlas = self.atlas
        match literal:
            case Literal(Inside(region, False), False):
                return atlas.inner(region.shape)
            case Literal(Touches(region), False):
                return atlas.near(region.shape, self.least, outer=False)
            case Literal(Compare(), _):
                inequality = comparison_literal(literal)
                return UNBOUNDED if isinstance(inequality, Unbounded) else self._nearer_than(inequality)
            case _:
                return UNBOUNDED

    def _nearer_than(self, inequality: Compare) -> Bound:
        """Inner bound on the positions that are too near for a comparison that requires a positive distance."""
        atlas = self.atlas
        match inequality.terms:
            case ((weight, DistanceTo(target)),) if weight > 0 and not isinstance(target, int):
                distance = -inequality.constant / weight
                if distance <= 0:
                    return UNBOUNDED
                if isinstance(target, Beacon):
                    return atlas.grown(atlas.point(target.position), distance, outer=False)
                return atlas.near(target.shape, distance, outer=False)
            case _:
                return UNBOUNDED


def _weights(terms: tuple[tuple[float, Feature], ...], dimension: int) -> Vector:
    weights = [0.0] * dimension
    for weight, feature in terms:
        assert isinstance(feature, Coordinate)
        weights[feature.axis] += weight
    return tuple(weights)


def _apart(one: Compare | Unbounded, other: Compare | Unbounded) -> bool:
    """Return whether two comparisons of opposite linear terms exclude each other.

    ``f + a >= 0`` and ``-f + b >= 0`` do if ``a + b < 0`` (or 0, if one of them is strict).
    """
    if isinstance(one, Unbounded) or isinstance(other, Unbounded) or not one.terms or not other.terms:
        return False
    first, second = dict(_merged(one)), dict(_merged(other))
    if not first or first.keys() != second.keys():
        return False
    ratios = [-first[feature] / second[feature] for feature in first]
    scale = ratios[0]
    if scale <= 0 or any(not math.isclose(ratio, scale, rel_tol=1e-12) for ratio in ratios):
        return False
    gap = one.constant + scale * other.constant
    slack = 1e-9 * max(1.0, abs(one.constant))
    return gap < -slack or (abs(gap) <= slack and (one.strict or other.strict))


def _merged(inequality: Compare) -> Iterator[tuple[Feature, float]]:
    """Each feature of a comparison once with its total weight, without features whose weights cancel."""
    weights: dict[Feature, float] = {}
    for weight, feature in inequality.terms:
        weights[feature] = weights.get(feature, 0.0) + weight
    return ((feature, weight) for feature, weight in weights.items() if weight != 0)
