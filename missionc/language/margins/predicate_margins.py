"""Margins of all predicates: the signed distance of each to the border of its truth, positive where true.

All in metres, but for comparisons of speed alone (m/s). At exactly 0 the sign
says nothing; ``holds`` knows on which side the border is.
"""

from __future__ import annotations

from typing import assert_never

import numpy as np

from missionc.base.trace import Trace
from missionc.ir import (
    Compare,
    Connected,
    DistanceBetween,
    DistanceTo,
    Feature,
    Formation,
    FormationEdge,
    InFormation,
    Inside,
    Mission,
    Predicate,
    Touches,
)
from missionc.language.margins import compare, connected, formation, inside, region, touches
from missionc.language.margins.connected import algebraic_connectivity
from missionc.language.margins.links import all_links, link_margin
from missionc.world.signed_distance import Array, Namespace, distance_between

__all__ = [
    "algebraic_connectivity",
    "all_links",
    "formation_margin",
    "holds",
    "link_margin",
    "margin",
    "of_pair",
    "of_states",
]


def margin(predicate: Predicate, mission: Mission, trace: Trace) -> Array:
    """A predicate's margin all along a trace.

    Returns:
        (agents, steps + 1) for predicates about one agent, (steps + 1,) for
        those about the team.
    """
    position = trace.position
    match predicate:
        case Inside(place, body):
            if body:
                return inside.margin(np, place, _radii(mission), position)
            return region.margin(np, place, position)
        case Touches(place):
            return touches.margin(np, place, _radii(mission), position)
        case Compare():
            return _compare(predicate, mission, trace)
        case Connected():
            return connected.margin(connected.restricted(predicate), trace)
        case InFormation(shape):
            return formation.margin(np, shape, position)
        case _:
            assert_never(predicate)


def holds(predicate: Predicate, margins: Array) -> Array:
    """Whether a predicate of these margins is true.

    Regions, tolerances and ``>=`` hold at their border; links and ``>`` do not.
    """
    return margins > 0 if predicate.open_border else margins >= 0


def of_states(
    predicate: Predicate, mission: Mission, agent: int, position: Array, velocity: Array, *, xp: Namespace = np
) -> Array:
    """The margin of a predicate that one agent's own state decides: (..., dim) twice -> (...).

    Raises:
        ValueError: the predicate needs another agent.
    """
    one = mission.agents[agent]

    def value(feature: Feature) -> Array:
        if isinstance(feature, DistanceTo) and feature.target == agent:
            return 0.0 * position[..., 0]
        return compare.own_feature(xp, feature, one.altitude, position, velocity)

    match predicate:
        case Inside(place, body):
            if body:
                return inside.margin(xp, place, one.radius, position)
            return region.margin(xp, place, position)
        case Touches(place):
            return touches.margin(xp, place, one.radius, position)
        case Compare():
            return compare.margin(predicate, mission.dimension, value) + 0.0 * position[..., 0]
        case Connected() | InFormation():
            raise ValueError("one agent's state does not decide a predicate about the team")
        case _:
            assert_never(predicate)


def of_pair(
    predicate: Predicate,
    mission: Mission,
    first: int,
    second: int,
    first_position: Array,
    second_position: Array,
    *,
    xp: Namespace = np,
) -> Array:
    """The margin, for agent ``first``, of a comparison that reads no other agent than ``second``.

    Args:
        first_position: (..., dim), metres; broadcasts with ``second_position``.

    Returns:
        (...), metres.

    Raises:
        ValueError: the predicate is no comparison, or it reads a speed or a third agent.
    """
    if not isinstance(predicate, Compare):
        raise ValueError("only comparisons are about a pair of agents")
    between = distance_between(xp, first_position, second_position)

    def value(feature: Feature) -> Array:
        match feature:
            case DistanceTo(int() as target):
                ends = {first, target}
            case DistanceBetween(one, other):
                ends = {one, other}
            case _:
                return compare.own_feature(xp, feature, mission.agents[first].altitude, first_position, None)
        if len(ends) == 1:
            return 0.0 * between
        if ends != {first, second}:
            raise ValueError(f"{feature} reads a third agent")
        return between

    return compare.margin(predicate, mission.dimension, value) + 0.0 * between


def formation_margin(
    shape: Formation, edge: FormationEdge, first_position: Array, second_position: Array, *, xp: Namespace = np
) -> Array:
    """The tolerance minus one edge's error: (..., dim) twice -> (...), metres."""
    return shape.tolerance - formation.edge_error(xp, edge, first_position, second_position)


def _radii(mission: Mission) -> Array:
    return np.array([agent.radius for agent in mission.agents])[:, None]


def _compare(predicate: Compare, mission: Mission, trace: Trace) -> Array:
    position, velocity = trace.position, trace.velocity
    altitudes = np.array([agent.altitude for agent in mission.agents])[:, None]

    def value(feature: Feature) -> Array:
        match feature:
            case DistanceTo(int() as target):
                return distance_between(np, position, np.broadcast_to(position[target], position.shape))
            case DistanceBetween(first, second):
                return distance_between(np, position[first], position[second])
            case _:
                return compare.own_feature(np, feature, altitudes, position, velocity)

    shape = position.shape[1:2] if predicate.about_team else position.shape[:2]
    return compare.margin(predicate, mission.dimension, value) + np.zeros(shape)
