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

from collections import Counter, deque
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from missionc.backends.api import Planned, Progress
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower_motion import Ways, lower_motion
from missionc.backends.smt.lift import lift
from missionc.backends.smt.prioritized.joint_search import JointSearch
from missionc.backends.smt.prioritized.planning_order import PlanningOrder
from missionc.backends.smt.prioritized.progression import TooComplex
from missionc.backends.smt.prioritized.refused_alone import names_about, smallest_conflict
from missionc.backends.smt.prioritized.requirement_parts import (
    NOBODY,
    Agents,
    Part,
    RequirementParts,
    applicable_parts,
    named_agents,
    split_requirements,
)
from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.prioritized.single_agent_relaxation import SingleAgentRelaxation
from missionc.backends.smt.prioritized.single_agent_search import HASTE, SingleAgentSearch
from missionc.backends.smt.refine.collisions import needed
from missionc.backends.smt.refine.lazy_constraints import Effort, JointMotion
from missionc.backends.smt.refine.problem import LINKS, Problem, Setting
from missionc.backends.smt.roadmap.labels import Labels
from missionc.backends.smt.roadmap.roadmap import Indices, Roadmap
from missionc.backends.smt.sat.solve import Solvers
from missionc.backends.smt.sat.wait_for_process import is_over
from missionc.backends.smt.shorten.shorten_paths import shorten_paths
from missionc.backends.work import MOVE_STEP
from missionc.base.trace import Flags, Trace
from missionc.kernel.nodes import All, Goal, Kernel, Node
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.logic import TRUTH

TOGETHER = 8
"""So many agents are planned in one turn, unless more belong together."""

IN_VAIN = 3
"""After so many agents one after the other that found no way by themselves, some are planned together."""

PUSHES = 6
"""So many times the number of agents may have to make way for another."""

BACK_AND_FORTH = 2
"""After two have so often taken each other's place they are planned together."""

REPAIRS = 6
"""So often those of whom something does not hold at the end may be planned again."""

ENOUGH, ENOUGH_EACH = 100_000_000, 3_000_000
"""After so much work of single-agent searches, and so much more for each agent, none is begun any more."""

FAILURES = 12
"""After so many turns that found nothing all agents are planned at once."""

EFFORT = Effort(conflicts=1_000, rounds=50)
"""The effort of a turn, which is the planning of one group."""


@dataclass(slots=True, eq=False)
class PrioritizedPlanner:
    """Prioritized planning: a joint motion as it grows.

    ``most``: units of ``work`` of the run's account that it may come to.
    """

    setting: Setting
    kernel: Kernel
    roadmaps: tuple[Roadmap, ...]
    solvers: Solvers
    most: float
    requirements: RequirementParts = field(init=False)
    named: dict[Node, Agents] = field(init=False)
    order: PlanningOrder = field(init=False)
    reservations: Reservations = field(init=False)
    ways: Ways = field(init=False)
    single_agent: SingleAgentSearch = field(init=False)
    infeasible_alone: set[int] = field(default_factory=set)
    """Agents whose single-agent relaxation is infeasible as long as nobody is settled."""
    guaranteed: set[Part] = field(default_factory=set)
    """Parts that hold of the settled, whoever joins them."""
    pushed: Counter[tuple[int, int]] = field(default_factory=Counter)
    """How often the first has taken the place of the second."""
    able: set[int] = field(default_factory=set)
    """Agents that can do alone what is asked of them alone."""
    refused: tuple[str, ...] | None = None
    """Requirements in conflict, where it was found out that these roadmaps hold no plan."""
    largest: Problem | None = None
    """The largest problem that had an answer."""
    nearest: Trace | None = None
    """The joint motion so far in which fewest parts fail, the first of them."""
    fewest: int = 0
    """How many do."""
    rounds: int = 0
    taken: int = 0
    failures: int = 0

    def __post_init__(self) -> None:
        mission = self.setting.mission
        with self.setting.account.stage("lower"):
            labels = Labels(mission, self.roadmaps)
            self.requirements = split_requirements(self.kernel, labels)
            self.named = named_agents(part.formula for part in self.requirements.parts)
            self.ways = Ways(self.roadmaps, self.requirements.never)
            self.order = PlanningOrder(labels)
            self.reservations = Reservations(lower_motion(self.roadmaps, self.ways, NOBODY, Clauses(1)), mission)
            self.single_agent = self.search()

    @property
    def enough(self) -> int:
        """The work of single-agent searches after which none is begun."""
        return ENOUGH + ENOUGH_EACH * len(self.everyone)

    @property
    def affordable(self) -> bool:
        """Whether there is work left to do it with, and time."""
        enough = self.single_agent.work >= self.enough or self.setting.account.work >= self.most
        return not enough and not is_over(self.setting.budget.deadline)

    @property
    def everyone(self) -> Agents:
        return frozenset(range(len(self.setting.mission.agents)))

    def plan(self) -> Indices | None:
        """A joint motion, (agents, steps + 1), in which every requirement holds, clear of each other, if it is found.

        Raises:
            TooLarge: the clauses would pass their limit.
            Unexpressible: a predicate is about too many agents at once.
        """
        waiting = self.order.groups(self.requirements.parts)
        if sum(map(len, waiting)) > TOGETHER:
            waiting = self.order.groups(self.failing_alone())
        for _ in range(REPAIRS):
            if not self.plan_groups(waiting):
                return None
            with self.setting.account.stage("bystanders"):
                whole = self.single_agent.with_bystanders(self.reservations, self.everyone)
                trace = None if isinstance(whole, int) else self.trace(whole.states)
                failing = [] if trace is None else self.failing(trace)
            if not isinstance(whole, int) and failing is None:
                return self.with_shorter_paths(whole)
            if trace is not None and failing and (self.nearest is None or len(failing) < self.fewest):
                self.nearest, self.fewest = trace, len(failing)
            free = self.everyone.difference(self.reservations.agents)
            groups = [(whole,)] if isinstance(whole, int) else self.order.groups(failing or ())
            again = [tuple(sorted(group & (free | self.reservations.alone))) for group in map(frozenset, groups)]
            waiting = [group for group in again if group] or ([tuple(sorted(free))] if free else [])
            if not waiting:
                return None
            self.release(agent for group in waiting for agent in group if agent not in free)
        return None

    def with_shorter_paths(self, whole: Reservations) -> Indices:
        """The motion after a local search for shorter paths; agents planned alone have the shortest already."""
        mission, motion = self.setting.mission, whole.motion
        with self.setting.account.stage("calm"):
            chosen = frozenset(self.reservations.agents) - self.reservations.alone
            goals = [goal.formula for goal in self.kernel.requirements]
            self.setting.budget.found(Planned(self.trace(whole.states), self.setting.account.report()))
            return shorten_paths(whole.states, chosen, goals, motion, mission)

    def trace(self, states: Indices) -> Trace:
        """A joint motion, (agents, steps + 1), as it is flown."""
        return lift(states, self.reservations.motion, self.setting.mission)

    def own_parts(self, agent: int) -> list[Node]:
        """What the requirements ask of this agent by itself."""
        return [part.formula for part in self.requirements.parts if part.named == frozenset((agent,))]

    def search(self, haste: float = HASTE) -> SingleAgentSearch:
        limit = self.setting.budget.limits.clauses
        return SingleAgentSearch(self.order.labels, self.requirements.never, self.reservations, limit, haste)

    def refusing(self, agent: int) -> tuple[str, ...] | None:
        """The requirements that the agent's roadmap holds no way for, if it is for certain that it holds none."""
        if agent in self.able:
            return None
        search = self.search()
        try:
            if search.alone(agent, self.own_parts(agent)) is not None:
                self.able.add(agent)
                return None
            search = SingleAgentSearch(self.order.labels, {}, self.reservations, 1)
            return smallest_conflict(self.kernel, search, agent)
        except TooComplex:
            return None

    def failing_alone(self) -> list[Part]:
        """The parts that do not hold where each takes the shortest way that there is for it alone."""
        with self.setting.account.stage("bystanders"):
            nobody = Reservations(self.reservations.motion, self.setting.mission)
            ways = [self.single_agent.way(agent, (), nobody) for agent in sorted(self.everyone)]
            if any(way is None for way in ways):
                return list(self.requirements.parts)
            return self.failing(self.trace(np.stack([way for way in ways if way is not None]))) or []

    def failing(self, trace: Trace) -> list[Part] | None:
        """The parts that do not hold; None where every requirement does."""
        goals = [goal.formula for goal in self.kernel.requirements]
        parts = [part.formula for part in self.requirements.parts]
        values = Evaluation(TRUTH, self.setting.mission, trace).values([*goals, *parts])
        if all(values[goal][0, 0] for goal in goals):
            return None
        return [part for part in self.requirements.parts if not values[part.formula][0, 0]]

    def plan_groups(self, waiting: list[tuple[int, ...]]) -> bool:
        """Settles all of these groups, by themselves or as many at once as a turn takes; whether that came off."""
        size = 1
        while waiting := self.plan_single_agents(waiting):
            if self.refused is not None:
                return False
            count = sum(map(len, waiting))
            size = max(size, -(-count // -(-count // TOGETHER)))  # turns of equal size
            batch: list[int] = []
            for group in waiting:
                if not batch or len(batch) + len(group) <= size:
                    batch += group
            taken = self.plan_with_helpers(frozenset(batch), waiting)
            if not taken:
                return False
            size = max(size, len(taken))
            waiting = [group for group in waiting if not taken.issuperset(group)]
        return True

    def plan_single_agents(self, waiting: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Settles those for whom there is a way by themselves; who is left."""
        queue, left, failures = deque(waiting), list[tuple[int, ...]](), 0
        while queue and failures < IN_VAIN and self.affordable and self.refused is None:
            group = queue.popleft()
            moved = self.plan_single_agent(group[0]) if len(group) == 1 else None
            if moved is None:
                left.append(group)
                failures += 1
            else:
                queue.extendleft((agent,) for agent in moved)
                failures = 0
                for other in moved:
                    self.pushed[group[0], other] += 1
                    if min(self.pushed[group[0], other], self.pushed[other, group[0]]) == BACK_AND_FORTH:
                        if self.plan_jointly((group[0], other)):
                            queue.remove((other,))
                        break
        return left + list(queue)

    def plan_single_agent(self, agent: int) -> list[int] | None:
        """Settles the agent on the shortest way on which all holds that is asked of it, if there is one.

        Where others are in the way it goes where few are, of those who were settled alone.

        Returns:
            whom it takes the place of: they wait again.
        """
        present = frozenset((agent, *self.reservations.agents))
        parts = applicable_parts(self.requirements, self.named, self.guaranteed, present)
        formulas, reservations, setting = list(parts.values()), self.reservations, self.setting
        with setting.account.stage("alone"):
            only = frozenset((agent,))
            if not reservations.agents and self.infeasible(formulas, self.ways, only):
                self.infeasible_alone.add(agent)
                return None
            may_push = bool(reservations.alone) and reservations.moved.sum() < PUSHES * reservations.motion.agents
            before = self.single_agent.work
            way = self.single_agent.way_or_push(agent, formulas, reservations, may_push=may_push)
            setting.account.work += MOVE_STEP * (self.single_agent.work - before)
            if way is None:
                self.refused = self.refusing(agent)
                return None
            moved = reservations.in_the_way(agent, way)
            reservations.moved[moved] += 1
            self.release(moved)
            self.reserve(frozenset((agent,)), np.broadcast_to(way, reservations.states.shape), parts, alone=True)
            return moved

    def plan_jointly(self, agents: tuple[int, ...]) -> bool:
        """Settles agents, the first of whom is settled, on the best joint motion, if that comes off; or refuses."""
        setting, formulas = self.setting, [self.own_parts(agent) for agent in agents]
        apart = np.stack([needed(np.full(len(agents), one), np.array(agents), setting.mission) for one in agents])
        with setting.account.stage("alone"), suppress(TooComplex):
            free = SingleAgentSearch(self.order.labels, {}, self.reservations, 1)
            nothing: list[list[Node]] = [[]] * len(agents)
            for search, asked, names in (
                (free, nothing, ()),
                (self.single_agent, formulas, names_about(self.kernel, agents)),
            ):
                movers = [search.mover(*each, None) for each in zip(agents, asked, strict=True)]
                if JointSearch(movers, apart, setting.mission.step).refused:
                    self.refused = names
                    return False
            rest = self.reservations.copy()
            rest.release(set(agents).intersection(rest.agents))
            movers = [self.single_agent.mover(*each, rest) for each in zip(agents, formulas, strict=True)]
            found = JointSearch(movers, apart, setting.mission.step).find()
            if found is not None:
                states = rest.states.copy()
                states[list(agents)] = found
                self.release(set(agents).intersection(self.reservations.agents))
                present = frozenset((*agents, *self.reservations.agents))
                parts = applicable_parts(self.requirements, self.named, self.guaranteed, present)
                self.reserve(frozenset(agents), states, parts, alone=True)
                return True
        return False

    def plan_with_helpers(self, batch: Agents, waiting: list[tuple[int, ...]]) -> Agents:
        """Settles the batch, and as many more as it takes; gives who took part, nobody where that fails."""
        groups = [group for group in waiting if batch.isdisjoint(group)]
        later = frozenset(agent for group in groups for agent in group)
        idle = sorted(self.everyone.difference(batch, later, self.reservations.agents))
        more = [(agent,) for agent in idle] + groups + [(agent,) for agent in reversed(self.reservations.agents)]
        helpers = 0
        while True:
            together = batch.union(*more[:helpers])
            if together == self.everyone:
                return NOBODY
            if self.plan_together(together):
                return together
            self.failures += 1
            if helpers >= len(more) or self.failures >= FAILURES or not self.affordable or not self.solvers.alive:
                return NOBODY
            helpers = max(1, 2 * helpers)

    def plan_together(self, batch: Agents) -> bool:
        """Settles the batch around all who are settled and not in it; whether a way was found."""
        setting, reservations, guaranteed = self.setting, self.reservations, self.guaranteed
        if not batch.isdisjoint(reservations.agents):  # what holds of the others may rest on them
            reservations, guaranteed = reservations.copy(), set()
            reservations.release(batch.intersection(reservations.agents))
        before = frozenset(reservations.agents)
        if not before and len(batch) == 1 and batch <= self.infeasible_alone:
            return False
        parts = applicable_parts(self.requirements, self.named, guaranteed, before | batch)
        setting.budget.listen(Progress("lower", self.taken + 1, f"{len(before)} + {len(batch)} agents"))
        with setting.account.stage("lower"):
            roadmaps = reservations.open_roadmaps()
            open_ways = Ways(roadmaps, self.requirements.never)
            standing = [reservations.motion.roadmap(agent).standing for agent in sorted(self.everyone)]
            ways = reservations.fixed(
                [open_ways[agent] if agent in batch else way for agent, way in enumerate(standing)]
            )
            if self.infeasible(list(parts.values()), ways, before | batch):
                return False
        goal = Goal("all parts", All(tuple(parts.values())), setting.mission.span)
        problem = setting.problem((goal,), roadmaps, ways, batch, before, LINKS, self.solvers)
        if problem.lowered.infeasible:
            return False
        result = problem.search.find(problem.lowered.goals, effort=EFFORT)
        if not isinstance(result, JointMotion):
            return False
        if reservations is not self.reservations:
            self.reservations, self.guaranteed = reservations, guaranteed
        with setting.account.stage("bystanders"):
            self.reserve(batch, result.states, parts, alone=False)
        self.taken += 1
        self.rounds += problem.search.rounds
        if self.largest is None or problem.search.clauses.count > self.largest.search.clauses.count:
            self.largest = problem
        return True

    def infeasible(self, formulas: Sequence[Node], ways: Sequence[Flags], present: Agents) -> bool:
        """Whether these hold in no joint motion of those who are there, each within its ways. False says nothing.

        Args:
            ways: for each agent, (steps + 1, states).
        """
        return SingleAgentRelaxation(self.order.labels, ways, present).infeasible(formulas)

    def reserve(self, agents: Agents, states: Indices, parts: Iterable[Part], *, alone: bool) -> None:
        """These agents do what ``states``, (agents of the mission, steps + 1), say, and what is asked is kept."""
        self.reservations.reserve(sorted(agents), states, alone=alone)
        self.infeasible_alone.clear()
        self.guaranteed.update(part for part in parts if part.monotone)

    def release(self, agents: Iterable[int]) -> None:
        """These agents, settled alone, wait again. What rested on them is found out at the end."""
        released = frozenset(agents)
        self.reservations.release(sorted(released))
        self.guaranteed = {part for part in self.guaranteed if not part.named or not part.named <= released}
