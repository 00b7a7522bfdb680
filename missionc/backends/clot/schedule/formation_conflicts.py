"""Formation conflicts: formations that agents cannot keep while each is where it has to be, or in another one.

    in   an edge of a formation, the goal sets of its agents or what another formation asks of the same two
    out  whether both can be

What is found is sure: where two places of many would do for an edge, it can be kept.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from missionc.backends.clot.schedule.goal_sets import GoalSets
from missionc.backends.clot.schedule.presence import PresenceConstraints
from missionc.base.trace import Array
from missionc.ir import FormationEdge, Predicate


def is_denied(shape: Predicate, come: PresenceConstraints, shapes: Iterable[Predicate], goals: GoalSets) -> bool:
    """Whether agents cannot be in a formation while they are where they come to, and in these other formations."""
    formation = shape.formation
    assert formation is not None
    reached = {
        agent: (goal.points.min(axis=0) - goals.grid.cell, goal.points.max(axis=0) + goals.grid.cell)
        for agent, nodes in come.goals
        if agent in shape.others and (goal := goals.of(agent, nodes)) is not None
    }
    for edge in formation.edges:
        if edge.first in reached and edge.second in reached:
            (first_low, first_high), (second_low, second_high) = reached[edge.first], reached[edge.second]
            if not _within(edge.target, formation.tolerance, second_low - first_high, second_high - first_low):
                return True
    others = [other.formation for other in shapes if other.formation not in (None, formation)]
    return any(
        _differ(edge, asked, formation.tolerance + other.tolerance)
        for other in others
        if other is not None
        for asked in other.edges
        for edge in formation.edges
    )


def _within(target: float | tuple[float, ...], tolerance: float, low: Array, high: Array) -> bool:
    """Whether an offset in this box, (dim,) corners, metres, is what an edge keeps."""
    if isinstance(target, tuple):
        wanted = np.array(target)
        return bool((wanted >= low - tolerance).all() and (wanted <= high + tolerance).all())
    nearest = np.linalg.norm(np.maximum(np.maximum(low, -high), 0.0))
    furthest = np.linalg.norm(np.maximum(np.abs(low), np.abs(high)))
    return bool(nearest <= target + tolerance and furthest >= target - tolerance)


def _differ(one: FormationEdge, other: FormationEdge, tolerance: float) -> bool:
    """Whether two edges between the same agents ask for what is further apart than this, metres."""
    if {one.first, one.second} != {other.first, other.second}:
        return False
    if isinstance(one.target, tuple) and isinstance(other.target, tuple):
        sign = 1.0 if one.first == other.first else -1.0
        return float(np.linalg.norm(np.array(one.target) - sign * np.array(other.target))) > tolerance
    return abs(float(np.linalg.norm(one.target)) - float(np.linalg.norm(other.target))) > tolerance
