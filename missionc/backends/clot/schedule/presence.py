"""Presence constraints: agents that a formula requires at goals, or near other agents.

    in   Hold
    out  PresenceConstraints

A formula without temporal operators is decomposed. A part that one agent's position decides is a goal of that agent; a
maximum distance between two agents is a meeting. If a number of several agents is required, the choice of agents is
open.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from missionc.backends.clot.schedule.tasks import Hold, Literal, conjuncts, literals
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Mission, Predicate
from missionc.ir.kernel.nodes import (
    Any,
    At,
    AtLeast,
    Atom,
    NeighbourNode,
    Node,
    Not,
    PathLength,
    ReachNode,
    RouteNode,
)
from missionc.ir.kernel.walk import children
from missionc.ir.language.margins.predicate_margins import of_pair


class Meeting(Record):
    """Meeting of agents, which must all be within ``reach`` metres of each other."""

    agents: tuple[int, ...]
    reach: float


class CardinalityGoal(Record):
    """Constraint that ``count`` of these goals, each of one agent, must be reached."""

    count: int
    goals: tuple[tuple[int, tuple[Node, ...]], ...]


class PresenceConstraints(Record):
    """Constraints on the positions of agents at one time.

    Args:
        goals: conditions on each agent's own position.
        meetings: agents that must be near each other.
        some: numbers of goals that must be reached.
        apart: pairs of agents and their least distance, metres.
    """

    goals: tuple[tuple[int, tuple[Node, ...]], ...] = ()
    meetings: tuple[Meeting, ...] = ()
    some: tuple[CardinalityGoal, ...] = ()
    apart: tuple[tuple[int, int, float], ...] = ()

    @property
    def agents(self) -> set[int]:
        """Agents that may have to move to satisfy the constraints."""
        named = {agent for agent, _ in self.goals} | {agent for each in self.meetings for agent in each.agents}
        return named | {agent for each in self.some for agent, _ in each.goals}

    @property
    def moves_on(self) -> bool:
        """True if the constraints require agents to be near each other, but at no particular position."""
        return bool(self.meetings) and not (self.goals or self.some)

    def __bool__(self) -> bool:
        return bool(self.goals or self.meetings or self.some)


NOBODY = PresenceConstraints()


def attendance(mission: Mission, holds: Iterable[Hold]) -> PresenceConstraints:
    """Presence constraints of holds, as far as positions decide the holds."""
    goals: dict[int, list[Node]] = {}
    pairs: dict[tuple[int, int], float] = {}
    some: list[CardinalityGoal] = []
    apart: list[tuple[int, int, float]] = []
    for hold in holds:
        for agent, node in conjuncts(hold.agent, hold.node) if hold.timeless else ():
            pair = _pair(mission, agent, node)
            if reads_past(node):
                continue
            if pair is not None:
                first, second, least, reach = pair
                apart.append((first, second, least))
                if reach < np.inf:
                    pairs[first, second] = min(reach, pairs.get((first, second), np.inf))
            elif (whom := agents_of(agent, node)) is not None and len(whom) == 1:
                goals.setdefault(whom.pop(), []).append(_bare(node))
            elif isinstance(node, AtLeast | Any):
                some.extend(_some(mission, agent, node))
    fixed = tuple((agent, tuple(nodes)) for agent, nodes in goals.items())
    return PresenceConstraints(fixed, tuple(_meetings(pairs)), tuple(some), tuple(apart))


def implied(holds: Iterable[Hold], always: Iterable[Hold]) -> Iterator[Hold]:
    """Yield further holds that follow because only one part of a hold that always applies remains possible (unit
    propagation)."""
    sure = {literal for hold in holds if hold.timeless for literal in literals(hold.agent, hold.node)}
    for hold in always if sure else ():
        for agent, node in conjuncts(hold.agent, hold.node):
            if isinstance(node, Any):
                left = [part for part in node.parts if not _denied(agent, part, sure)]
                if len(left) == 1:
                    yield Hold(agent, left[0], 0, 0, True)


def _denied(agent: int, node: Node, sure: set[Literal]) -> bool:
    if isinstance(node, Any):
        return all(_denied(agent, part, sure) for part in node.parts)
    return any((who, what, not holds) in sure for who, what, holds in literals(agent, node))


def agents_of(agent: int, node: Node) -> set[int] | None:
    """Agents whose own positions decide a formula; None if anything else matters."""
    whom: set[int] = set()
    stack = [(agent, node)]
    while stack:
        agent, node = stack.pop()
        match node:
            case At(other, body):
                stack.append((other, body))
            case Atom(predicate):
                if predicate.about_team or predicate.others or predicate.graph is not None:
                    return None
                whom.add(agent)
            case NeighbourNode() | ReachNode() | RouteNode() | PathLength():
                return None
            case _:
                stack.extend((agent, part) for part in children(node))
    return whom


def reads_past(node: Node) -> bool:
    """Return true if a node is a predicate of the past, or its negation."""
    leaf = node.body if isinstance(node, Not) else node
    return isinstance(leaf, Atom) and leaf.predicate.reads_past


def _bare(node: Node) -> Node:
    """Formula without surrounding ``At`` operators."""
    while isinstance(node, At):
        node = node.body
    return node


def _some(mission: Mission, agent: int, node: AtLeast | Any) -> Iterator[CardinalityGoal]:
    goals: list[tuple[int, tuple[Node, ...]]] = []
    for part in node.parts:
        come = attendance(mission, (Hold(agent, part, 0, 0, True),))
        if come.meetings or come.some or len(come.goals) != 1:
            return
        goals.extend(come.goals)
    count = node.count if isinstance(node, AtLeast) else 1
    if len({whose for whose, _ in goals}) == len(goals):
        yield CardinalityGoal(count, tuple(goals))


def _pair(mission: Mission, agent: int, node: Node) -> tuple[int, int, float, float] | None:
    """Two agents with the least and the greatest distance, metres, at which a formula about them is true; None for
    other formulas.

    The greatest distance is infinite without a bound.
    """
    leaf = node.body if isinstance(node, Not) else node
    if not isinstance(leaf, Atom) or leaf.predicate.formation or leaf.predicate.graph or leaf.predicate.reads_speed:
        return None
    pairs = {(min(pair), max(pair)) for pair in leaf.predicate.pairs_of(agent)}
    if len(pairs) != 1:
        return None
    first, second = pairs.pop()
    margin = _by_distance(mission, leaf.predicate, agent, first, second)
    if margin is None:
        return None
    length, values = margin
    holding = np.flatnonzero((values if node is leaf else -values) >= 0)
    if not len(holding):
        return None
    least = float(length[holding[0]]) if holding[0] > 0 else 0.0
    return first, second, least, float(length[holding[-1]]) if holding[-1] < len(length) - 1 else np.inf


def _by_distance(
    mission: Mission, predicate: Predicate, agent: int, first: int, second: int
) -> tuple[Array, Array] | None:
    """Margins of a predicate as a function of the distance of two agents: distances and margins, (lengths,) each,
    metres; None for other predicates."""
    lengths = 240  # distances at which a comparison of two places is evaluated, up to the world's diagonal
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    length = np.geomspace(1e-2, float(np.linalg.norm(high - low)), lengths)
    here = np.tile(low, (lengths, 1))
    there = here.copy()
    there[:, 0] += length
    asked, other = (second, first) if agent == second else (first, second)
    try:
        return length, np.asarray(of_pair(predicate, mission, asked, other, here, there))
    except ValueError:
        return None


def _meetings(pairs: dict[tuple[int, int], float]) -> Iterator[Meeting]:
    """Yield a meeting for each connected group of agents, with the least reach of any of its pairs."""
    left = dict(pairs)
    while left:
        (first, second), reach = left.popitem()
        group = {first, second}
        while near := [pair for pair in left if not group.isdisjoint(pair)]:
            for pair in near:
                reach = min(reach, left.pop(pair))
                group.update(pair)
        yield Meeting(tuple(sorted(group)), reach)
