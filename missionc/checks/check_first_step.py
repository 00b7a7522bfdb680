"""Check of requirements that ask for nothing: true at the first step already, from every place where agents may start.

    in   Mission, its requirements and what they mean, the FreeSpace
    out  nothing but findings
    says MC521

``eventually[0, 20 s] base`` of a team that starts in ``base`` is satisfied before anybody moves. Only starts are looked
at, and only what is sure of them is said. Agents are the bits of a number.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field
from functools import reduce
from operator import and_, or_

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.checks.free_space import FreeSpace
from missionc.checks.place_margins import Joint, margin_at
from missionc.diagnostics.code import ASKS_NOTHING
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Agent, Exactly, Inside, Mission, Predicate, Requirement
from missionc.ir.wording import listed
from missionc.kernel.conjuncts import conjuncts
from missionc.kernel.evaluate import Domain, evaluate
from missionc.kernel.nodes import (
    Eventually,
    Goal,
    NeighbourNode,
    Node,
    PathLength,
    ReachNode,
    RouteNode,
    Until,
    UntilNode,
    WindowNode,
)
from missionc.kernel.walk import more_than, postorder
from missionc.language.walk_formulas import bits_of
from missionc.monitoring.end_columns import MOST_NODES
from missionc.world import plain_floats
from missionc.world.area import SURE
from missionc.world.configuration_space import covers

FEW = 256
"""Agents that are looked at; of larger teams nothing is said."""


def check_first_step(
    mission: Mission, undecided: Iterable[tuple[Requirement, Goal]], ground: FreeSpace
) -> Iterator[Diagnostic]:
    """One finding for each part of a requirement that every start satisfies before anybody has moved.

    Args:
        undecided: the requirements of which nothing else is known, with what they mean.
    """
    if len(mission.agents) > FEW:
        return
    joint = tuple(
        plain_floats.Place(each.start.point) if isinstance(each.start, Exactly) else None for each in mission.agents
    )
    starts = Starts(mission, ground, (1 << len(mission.agents)) - 1, joint)
    for requirement, goal in undecided:
        awaited = _awaited(goal)
        if not awaited or more_than(MOST_NODES, (node for asked in awaited.values() for node, _ in asked)):
            continue
        known = evaluate([node for asked in awaited.values() for node, _ in asked], starts)
        for span, asked in awaited.items():
            if all(known[node] & (starts.everyone if agent is None else 1 << agent) for node, agent in asked):
                yield _asks_nothing(mission, requirement, span, [agent for _, agent in asked])


def _awaited(goal: Goal) -> dict[Span, list[tuple[Node, int | None]]]:
    """What is waited for from the first step on, by where it is written, and of whom."""
    awaited: dict[Span, list[tuple[Node, int | None]]] = {}
    for conjunct in conjuncts((goal.formula,)):
        node = conjunct.formula
        if not conjunct.windows and any(isinstance(each, Eventually | Until) for each in postorder((node,))):
            awaited.setdefault(node.span or goal.span, []).append((node, conjunct.agent))
    return awaited


@dataclass(slots=True, eq=False)
class Starts(Domain[int]):
    """The domain of those of whom a formula surely holds at the first step, wherever they start."""

    mission: Mission
    ground: FreeSpace
    everyone: int
    joint: Joint
    """Where each agent starts, if that is given."""
    known: dict[tuple[Predicate, bool], int] = field(default_factory=dict)

    def atom(self, predicate: Predicate, holds: bool) -> int:
        if (predicate, holds) not in self.known:
            agents = (agent for agent in self.mission.agents if self._sure(predicate, holds, agent))
            bits = bits_of(tuple(agent.index for agent in agents))
            self.known[predicate, holds] = self.everyone if predicate.about_team and bits else bits
        return self.known[predicate, holds]

    def _sure(self, predicate: Predicate, holds: bool, agent: Agent) -> bool:
        start = agent.start
        if isinstance(start, Exactly):
            if predicate.graph:
                return False
            margin = margin_at(self.mission, predicate, agent, self.joint)
            return margin is not None and (margin > SURE if holds else margin < -SURE)
        if not (holds and isinstance(predicate, Inside)) or predicate.body:
            return False
        atlas = self.ground.atlas
        same = predicate.region.shape == start.region.shape
        return same or covers(atlas.inner(predicate.region.shape), atlas.outer(start.region.shape))

    def member(self, agents: frozenset[int], holds: bool) -> int:
        bits = bits_of(tuple(agents))
        return bits if holds else self.everyone & ~bits

    def path_length(self, node: PathLength, holds: bool) -> int:
        return 0

    def meet(self, parts: Sequence[int]) -> int:
        return reduce(and_, parts, self.everyone)

    def join(self, parts: Sequence[int]) -> int:
        return reduce(or_, parts, 0)

    def at_least(self, count: int, parts: Sequence[int]) -> int:
        enough = (agent for agent in self.mission.agents if sum(part >> agent.index & 1 for part in parts) >= count)
        return bits_of(tuple(agent.index for agent in enough))

    def at(self, agent: int, body: int) -> int:
        return self.everyone if body >> agent & 1 else 0

    def window(self, node: WindowNode, body: int) -> int:
        here = node.low == 0 and (not node.every or node.high == 0)
        return body if here else 0

    def until(self, node: UntilNode, hold: int, end: int) -> int:
        return end if node.low == 0 and (not node.every or node.high == 0) else 0

    def neighbour(self, node: NeighbourNode, body: int) -> int:
        return 0

    def reach(self, node: ReachNode, through: int, end: int) -> int:
        return 0 if node.every else end

    def route(self, node: RouteNode, through: int, end: int) -> int:
        return end if not node.every and node.low <= 0 else 0


# ------------------------------------------------------------------ messages


def _asks_nothing(mission: Mission, requirement: Requirement, span: Span, agents: Iterable[int | None]) -> Diagnostic:
    who = sorted({agent for agent in agents if agent is not None})
    starts = [mission.agents[agent].start.span for agent in who[:1]]
    names = [f"`{mission.agents[agent].name}`" for agent in who]
    return Diagnostic(
        ASKS_NOTHING,
        f"requirement `{requirement.name}` is satisfied before anybody moves",
        Label(span, f"true at 0 s{f' of {listed(names)}' if names else ''}, wherever they start"),
        tuple(Label(start, "they start here" if len(who) > 1 else "it starts here") for start in starts),
        help="let the window begin later, start elsewhere, or ask for another agent where a route may have no links",
    )
