"""Prioritized planning in groups: a few agents at a time, around the reserved trajectories of those before them.

    in   roadmaps, the requirements in parts
    out  a joint motion in which every requirement holds, or nothing

Few missions need all their agents at once. Those that the requirements need are
planned group by group, each with the parts that are about agents who are there
by then; all the others take the shortest way that stays clear. The monitor judges
the whole. Where a turn finds nothing, more agents take part in it: those nobody
needs, those whose turn has not come, at last those who were settled before.
That no plan is found in this way says nothing.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from missionc.backends.api import Planned, Progress
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower_motion import all_ways, lower_motion
from missionc.backends.smt.lift import lift
from missionc.backends.smt.prioritized.planning_order import Order
from missionc.backends.smt.prioritized.requirement_parts import (
    NOBODY,
    Agents,
    Asked,
    Part,
    among,
    asked_of,
    asks_of,
)
from missionc.backends.smt.prioritized.reservations import Settled
from missionc.backends.smt.prioritized.single_agent_relaxation import Outlook
from missionc.backends.smt.prioritized.single_agent_search import Alone
from missionc.backends.smt.refine.lazy_constraints import Effort, Found
from missionc.backends.smt.refine.problem import (
    LINKS,
    Problem,
    Setting,
)
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Indices, Roadmap
from missionc.backends.smt.sat.solve import Solvers
from missionc.backends.smt.shorten.shorten_paths import calm
from missionc.base.trace import Flags, Trace
from missionc.kernel.nodes import All, Goal, Kernel, Node
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.logic import TRUTH

TOGETHER = 8
"""So many agents are planned in one turn, unless more belong together."""

IN_VAIN = 3
"""After so many agents one after the other that found no way by themselves, some are planned together."""

PUSHES = 3
"""So many times the number of agents may have to make way for another."""

REPAIRS = 6
"""So often those of whom something does not hold at the end may be planned again."""

FAILURES = 12
"""After so many turns that found nothing all agents are planned at once."""

EFFORT = Effort(conflicts=1_000, rounds=50)
"""What a turn may cost."""


@dataclass(slots=True, eq=False)
class Turns:
    """A joint motion as it grows.

    ``until``, on the clock of ``time.monotonic``, is for missions on which the
    counts above are too generous.
    """

    setting: Setting
    kernel: Kernel
    roadmaps: tuple[Roadmap, ...]
    solvers: Solvers
    until: float
    asked: Asked = field(init=False)
    asks: dict[Node, Agents] = field(init=False)
    order: Order = field(init=False)
    settled: Settled = field(init=False)
    seen: Alone | None = None
    """What single agents look for a way in; it may be older than the last who were settled."""
    lonely: set[int] = field(default_factory=set)
    """Those who can do nothing of what is asked of them as long as nobody is settled."""
    kept: set[Part] = field(default_factory=set)
    """What holds of the settled, whoever joins them."""
    largest: Problem | None = None
    """The largest problem that had an answer."""
    rounds: int = 0
    taken: int = 0
    failures: int = 0

    def __post_init__(self) -> None:
        mission = self.setting.mission
        with self.setting.account.stage("lower"):
            labels = Labels(mission, self.roadmaps)
            roadmap_of = {agent: number for number, roadmap in enumerate(self.roadmaps) for agent in roadmap.agents}
            self.asked = asked_of(self.kernel, labels, roadmap_of)
            self.asks = asks_of(part.formula for part in self.asked.parts)
            ways = all_ways(self.roadmaps, self.asked.never)
            self.order = Order(labels, ways, roadmap_of)
            self.settled = Settled(lower_motion(self.roadmaps, ways, NOBODY, Clauses(1)), mission)

    @property
    def everyone(self) -> Agents:
        return frozenset(range(len(self.setting.mission.agents)))

    def plan(self) -> Trace | None:
        """A joint motion in which every requirement holds and nobody comes too near another, if it is found.

        Raises:
            TooLarge: the clauses would pass their limit.
            Unexpressible: a predicate is about too many agents at once.
        """
        waiting = self.order.groups(self.asked.parts)
        if sum(map(len, waiting)) > TOGETHER:
            waiting = self.order.groups(self.failing_alone())
        for _ in range(REPAIRS):
            if not self.take_turns(waiting):
                return None
            with self.setting.account.stage("bystanders"):
                whole = self.settled.with_bystanders(self.order.ways)
                trace = None if isinstance(whole, int) else lift(whole.states, whole.motion, self.setting.mission)
                failing = [] if trace is None else self.failing(trace)
            if not isinstance(whole, int) and failing is None:
                return self.calmed(whole)
            free = self.everyone.difference(self.settled.agents)
            groups = [(whole,)] if isinstance(whole, int) else self.order.groups(failing or ())
            again = [tuple(sorted(group & (free | self.settled.alone))) for group in map(frozenset, groups)]
            waiting = [group for group in again if group] or ([tuple(sorted(free))] if free else [])
            if not waiting:
                return None
            self.release(agent for group in waiting for agent in group if agent not in free)
            self.seen = None
        return None

    def calmed(self, whole: Settled) -> Trace:
        """What all do, but for ways that a solver chose and nobody needs; the others go the shortest there are."""
        mission, motion = self.setting.mission, whole.motion
        with self.setting.account.stage("calm"):
            chosen = frozenset(self.settled.agents) - self.settled.alone
            goals = [goal.formula for goal in self.kernel.requirements]
            self.setting.budget.found(Planned(lift(whole.states, motion, mission), self.setting.account.report()))
            return lift(calm(whole.states, chosen, goals, motion, mission), motion, mission)

    def failing_alone(self) -> list[Part]:
        """What does not hold where each takes the shortest way that there is for it alone."""
        with self.setting.account.stage("bystanders"):
            states = self.settled.each_alone(self.order.ways)
            if states is None:
                return list(self.asked.parts)
            return self.failing(lift(states, self.settled.motion, self.setting.mission)) or []

    def failing(self, trace: Trace) -> list[Part] | None:
        """The parts that do not hold; None where every requirement does."""
        goals = [goal.formula for goal in self.kernel.requirements]
        parts = [part.formula for part in self.asked.parts]
        values = Evaluation(TRUTH, self.setting.mission, trace).values([*goals, *parts])
        if all(values[goal][0, 0] for goal in goals):
            return None
        return [part for part in self.asked.parts if not values[part.formula][0, 0]]

    def take_turns(self, waiting: list[tuple[int, ...]]) -> bool:
        """Settles all of these groups, by themselves or as many at once as a turn takes; whether that came off."""
        size = 1
        while waiting := self.by_themselves(waiting):
            count = sum(map(len, waiting))
            size = max(size, -(-count // -(-count // TOGETHER)))  # turns of equal size
            batch: list[int] = []
            for group in waiting:
                if not batch or len(batch) + len(group) <= size:
                    batch += group
            taken = self.turn_with_helpers(frozenset(batch), waiting)
            if not taken:
                return False
            size = max(size, len(taken))
            waiting = [group for group in waiting if not taken.issuperset(group)]
        return True

    def by_themselves(self, waiting: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Settles those for whom there is a way by themselves; who is left."""
        queue, left, failures = deque(waiting), list[tuple[int, ...]](), 0
        while queue and failures < IN_VAIN and time.monotonic() < self.until:
            group = queue.popleft()
            moved = self.alone(group[0]) if len(group) == 1 else None
            if moved is None:
                left.append(group)
                failures += 1
            else:
                queue.extend((agent,) for agent in moved)
                failures = 0
        return left + list(queue)

    def alone(self, agent: int) -> list[int] | None:
        """Settles the agent on the shortest way on which all holds that is asked of it, if there is one.

        Where others are in the way it goes where few are, of those who were settled alone.

        Returns:
            whom it takes the place of: they wait again.
        """
        asked = self.asked_among(self.kept, frozenset((agent, *self.settled.agents)))
        formulas, settled, setting = list(asked.values()), self.settled, self.setting
        with setting.account.stage("alone"):
            only = frozenset((agent,))
            if not settled.agents and self.hopeless(formulas, self.order.ways, only):
                self.lonely.add(agent)
                return None
            way = None
            if self.seen is not None and all(part.grows for part in asked):
                way = self.seen.way(agent, formulas, settled)
            if way is None and (self.seen is None or self.seen.agents != settled.agents):
                self.seen = Alone(settled, self.order.ways, setting.mission, setting.budget.limits.clauses)
                way = self.seen.way(agent, formulas, settled)
            moved: list[int] = []
            if way is None and self.seen is not None and settled.moved.sum() < PUSHES * settled.motion.agents:
                way = self.seen.way(agent, formulas, settled, pushing=True)
                moved = [] if way is None else settled.in_the_way(agent, way)
            if way is None:
                return None
            settled.moved[moved] += 1
            self.release(moved)
            self.settle(frozenset((agent,)), np.broadcast_to(way, settled.states.shape), asked, alone=True)
            return moved

    def turn_with_helpers(self, batch: Agents, waiting: list[tuple[int, ...]]) -> Agents:
        """Settles the batch, and as many more as it takes; gives who took part, nobody where that fails."""
        groups = [group for group in waiting if batch.isdisjoint(group)]
        later = frozenset(agent for group in groups for agent in group)
        idle = sorted(self.everyone.difference(batch, later, self.settled.agents))
        more = [(agent,) for agent in idle] + groups + [(agent,) for agent in reversed(self.settled.agents)]
        helpers = 0
        while True:
            together = batch.union(*more[:helpers])
            if together == self.everyone:
                return NOBODY
            if self.together(together):
                return together
            self.failures += 1
            if helpers >= len(more) or self.failures >= FAILURES or not self.solvers.alive:
                return NOBODY
            helpers = max(1, 2 * helpers)

    def together(self, batch: Agents) -> bool:
        """Settles the batch around all who are settled and not in it; whether a way was found."""
        setting, settled, kept = self.setting, self.settled, self.kept
        if not batch.isdisjoint(settled.agents):  # what holds of the others may rest on them
            settled, kept = settled.copy(), set()
            settled.release(batch.intersection(settled.agents))
        before = frozenset(settled.agents)
        if not before and len(batch) == 1 and batch <= self.lonely:
            return False
        asked = self.asked_among(kept, before | batch)
        setting.budget.listen(Progress("lower", self.taken + 1, f"{len(before)} + {len(batch)} agents"))
        with setting.account.stage("lower"):
            roadmaps = settled.open_roadmaps()
            ways = settled.fixed(all_ways(roadmaps, self.asked.never))
            ways = tuple(way if agent in before | batch else self.order.ways[agent] for agent, way in enumerate(ways))
            if self.hopeless(list(asked.values()), ways, before | batch):
                return False
        goal = Goal("all parts", All(tuple(asked.values())), setting.mission.span)
        problem = setting.problem((goal,), roadmaps, ways, batch, before, LINKS, self.solvers)
        if problem.lowered.hopeless:
            return False
        result = problem.search.find(problem.lowered.goals, self.until, EFFORT)
        if not isinstance(result, Found):
            return False
        if settled is not self.settled:
            self.settled, self.kept, self.seen = settled, kept, None
        with setting.account.stage("bystanders"):
            self.settle(batch, result.states, asked, alone=False)
        self.taken += 1
        self.rounds += problem.search.rounds
        if self.largest is None or problem.search.clauses.count > self.largest.search.clauses.count:
            self.largest = problem
        return True

    def hopeless(self, formulas: Sequence[Node], ways: tuple[Flags, ...], present: Agents) -> bool:
        """Whether these hold in no joint motion of those who are there, each within its ways. False says nothing."""
        return Outlook(self.order.labels, ways, present).hopeless(formulas)

    def asked_among(self, kept: set[Part], present: Agents) -> dict[Part, Node]:
        """What can be asked of those who are there, but for what is kept in any case."""
        formulas = {part: among(part.formula, self.asks, present) for part in self.asked.parts if part not in kept}
        return {part: formula for part, formula in formulas.items() if formula is not None}

    def settle(self, agents: Agents, states: Indices, asked: Iterable[Part], *, alone: bool) -> None:
        """These agents do what ``states``, (agents of the mission, steps + 1), say, and what is asked is kept."""
        self.settled.settle(sorted(agents), states, alone=alone)
        self.lonely.clear()
        self.kept.update(part for part in asked if part.grows)

    def release(self, agents: Iterable[int]) -> None:
        """These agents, settled alone, wait again. What rested on them is found out at the end."""
        released = frozenset(agents)
        self.settled.release(sorted(released))
        self.kept = {part for part in self.kept if not part.asks or not part.asks <= released}
