"""Required formations and graphs of an outline, the agents that they couple, and conflicts of formations.

A conflict is reported only if it is certain: if some pair of positions satisfies a formation's edge, the agents are
assumed to satisfy it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from missionc.backends.clot.schedule.gather_team import can_be_gathered
from missionc.backends.clot.schedule.goal_sets import GoalSets
from missionc.backends.clot.schedule.presence import PresenceConstraints
from missionc.backends.clot.schedule.tasks import Hold, Outline
from missionc.base.trace import Array
from missionc.ir import FormationEdge, Predicate
from missionc.ir.kernel.nodes import Atom, Node
from missionc.ir.kernel.walk import graph_of, postorder


def is_denied(shape: Predicate, come: PresenceConstraints, shapes: Iterable[Predicate], goals: GoalSets) -> bool:
    """Return true if agents cannot be in a formation while they are at their goals and in the other formations."""
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
    """Return true if an edge admits an offset in this box; corners (dim,), metres."""
    if isinstance(target, tuple):
        wanted = np.array(target)
        return bool((wanted >= low - tolerance).all() and (wanted <= high + tolerance).all())
    nearest = np.linalg.norm(np.maximum(np.maximum(low, -high), 0.0))
    furthest = np.linalg.norm(np.maximum(np.abs(low), np.abs(high)))
    return bool(nearest <= target + tolerance and furthest >= target - tolerance)


def _differ(one: FormationEdge, other: FormationEdge, tolerance: float) -> bool:
    """Return true if two edges between the same agents require offsets that differ by more than ``tolerance``
    metres."""
    if {one.first, one.second} != {other.first, other.second}:
        return False
    if isinstance(one.target, tuple) and isinstance(other.target, tuple):
        sign = 1.0 if one.first == other.first else -1.0
        return float(np.linalg.norm(np.array(one.target) - sign * np.array(other.target))) > tolerance
    return abs(float(np.linalg.norm(one.target)) - float(np.linalg.norm(other.target))) > tolerance


def tied_agents(outline: Outline, company: PresenceConstraints, *, links: bool = True) -> frozenset[int]:
    """Agents with a formation or links at any time, and agents that must always be near such an agent.

    Args:
        links: True if required links count.
    """
    tied: set[int] = set()
    for node in _asked(outline):
        if not links and reads_links(node):
            continue
        graph = graph_of(node)
        if graph is not None:
            tied.update(graph.agents)
        elif isinstance(node, Atom) and (node.predicate.formation is not None or node.predicate.graph is not None):
            tied.update(node.predicate.others)
    left = list(company.meetings)
    while near := [each for each in left if not tied.isdisjoint(each.agents)]:
        tied.update(*(each.agents for each in near))
        left = [each for each in left if each not in near]
    return frozenset(tied)


def reads_links(node: Node) -> bool:
    """Return true if the truth of a node depends on the links of a graph."""
    return graph_of(node) is not None or (isinstance(node, Atom) and node.predicate.graph is not None)


def formations(outline: Outline) -> tuple[Predicate, ...]:
    """Distinct formation predicates that are required at any time."""
    found = (node.predicate for node in _asked(outline) if isinstance(node, Atom))
    return tuple(dict.fromkeys(each for each in found if each.formation is not None))


def shapes(holds: tuple[Hold, ...]) -> Iterator[Predicate]:
    """Yield the distinct formation and graph predicates of holds."""
    seen: set[Predicate] = set()
    for hold in holds:
        node = hold.node
        if isinstance(node, Atom) and can_be_gathered(node.predicate) and node.predicate not in seen:
            seen.add(node.predicate)
            yield node.predicate


def _asked(outline: Outline) -> Iterable[Node]:
    """All subformulas of the holds of an outline, including the holds of events."""
    holds = [*outline.fixed, *(hold for event in outline.events for hold in (*event.holds, *event.before))]
    return postorder(dict.fromkeys(hold.node for hold in holds))
