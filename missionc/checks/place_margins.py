"""Robustness margins of predicates at given places of the agents, in plain numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from missionc.ir import (
    Agent,
    Altitude,
    Compare,
    DistanceBetween,
    DistanceTo,
    Feature,
    InFormation,
    Inside,
    Mission,
    Predicate,
    Speed,
    Touches,
)
from missionc.language.margins import compare, formation, inside, region, touches
from missionc.world import plain_floats
from missionc.world.plain_floats import Place, Places
from missionc.world.signed_distance import distance_between

Joint: TypeAlias = tuple[Place | None, ...]
"""Where each agent is; nothing for one that may be anywhere."""


def margin_at(mission: Mission, predicate: Predicate, agent: Agent, joint: Joint) -> float | None:
    """The margin of a predicate, not of a connected graph, at places; None where it hangs on one that is not given."""
    if any(joint[needed] is None for needed in _needed(predicate, agent, mission.dimension)):
        return None
    nowhere = Place((0.0,) * mission.dimension)
    places = Places(nowhere if place is None else place for place in joint)
    here = places[agent.index]
    match predicate:
        case Inside(where, True):
            return float(inside.margin(plain_floats, where, agent.radius, here))
        case Inside(where):
            return float(region.margin(plain_floats, where, here))
        case Touches(where):
            return float(touches.margin(plain_floats, where, agent.radius, here))
        case InFormation(shape):
            return float(formation.margin(plain_floats, shape, places))
        case Compare(terms):
            if any(isinstance(feature, Speed) for _, feature in terms):
                return None

            def value(feature: Feature) -> float:
                match feature:
                    case DistanceTo(int(target)):
                        return float(distance_between(plain_floats, here, places[target]))
                    case DistanceBetween(first, second):
                        return float(distance_between(plain_floats, places[first], places[second]))
                    case _:
                        return float(compare.own_feature(plain_floats, feature, agent.altitude, here, None))

            return float(compare.margin(predicate, mission.dimension, value))
        case _:
            raise ValueError("a graph is connected by all of its agents")


def _needed(predicate: Predicate, agent: Agent, dimension: int) -> Iterator[int]:
    """The agents whose places a predicate hangs on, asked of an agent."""
    match predicate:
        case InFormation(shape):
            for edge in shape.edges:
                yield from (edge.first, edge.second)
        case Compare(terms):
            for weight, feature in terms:
                if weight:
                    yield from _needed_by(feature, agent.index, dimension)
        case _:
            yield agent.index


def _needed_by(feature: Feature, agent: int, dimension: int) -> tuple[int, ...]:
    match feature:
        case DistanceBetween(first, second):
            return (first, second)
        case DistanceTo(int(target)):
            return (agent, target)
        case Altitude() if dimension == 2:
            return ()
        case _:
            return (agent,)
