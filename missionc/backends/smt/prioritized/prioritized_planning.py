"""Prioritized planning in groups: a few agents at a time, around the reserved trajectories of earlier agents.

    in   roadmaps, the requirements in parts
    out  a joint motion that satisfies every requirement, or nothing

Few missions need all their agents at once. The needed agents are planned group by group, each with the parts about
agents planned by then; all others take the shortest clear path. The monitor checks the whole plan. If a group fails,
more agents are added to it: first agents that no requirement needs, then agents of later groups, and at last agents
planned before. Before that, a leader is planned for its own requirements, and all others follow it. A failure of this
method proves nothing.

Receding horizon: a joint problem of the first steps only, after which each agent continues alone.

    in   roadmaps, possible states of each agent, and the last step with joint conditions
    out  the same for those steps; then each agent's whole path, beginning with the result

Without joint conditions after a step, the solver does not need the later steps. At the last of its steps, an agent may
be in any state from which it can still reach its goals in time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from missionc.backends.api import Planned, Progress
from missionc.backends.smt.encode.lower_motion import Ways
from missionc.backends.smt.lift import lift
from missionc.backends.smt.prioritized.requirement_parts import (
    NOBODY,
    Agents,
    Part,
    applicable_parts,
    deepened,
)
from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.prioritized.single_agent_planning import SingleAgentPlanning
from missionc.backends.smt.prioritized.single_agent_search import SingleAgentSearch
from missionc.backends.smt.refine.lazy_constraints import Effort, JointMotion
from missionc.backends.smt.refine.problem import Problem, Setting
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.settings import smt_settings
from missionc.backends.smt.shorten.shorten_paths import shorten_paths
from missionc.base.trace import SEARCH, Flags, Indices, Trace, solved_by
from missionc.base.units import Steps
from missionc.ir import Mission
from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import All, Goal, Node
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import TRUTH


def last_asked(formulas: Sequence[Node], mission: Mission) -> int:
    """Last step that matters for joint formulas at step 0; the mission's last step if the last step is not much
    later."""
    shorter = 2  # least ratio of the mission's steps to those of a part planned alone
    ahead = steps_ahead(formulas, mission.steps)
    last = max((ahead[formula] for formula in formulas), default=0) + 1
    return last if shorter * last <= mission.steps else mission.steps


def first_steps(
    setting: Setting, roadmaps: tuple[Roadmap, ...], ways: Sequence[Flags], last: int
) -> tuple[Setting, tuple[Roadmap, ...], tuple[Flags, ...]]:
    """Setting, roadmaps and possible states, (steps + 1, states) each, truncated after the step ``last``; unchanged for
    the mission's last step."""
    if last == setting.mission.steps:
        return setting, roadmaps, tuple(ways)
    mission = replace(setting.mission, steps=Steps(last))
    shorter = tuple(
        replace(
            roadmap,
            standing=roadmap.standing[: last + 1],
            allowed=roadmap.allowed[:last],
            finishes=tuple(np.flatnonzero(ways[agent][last]) for agent in roadmap.agents),
        )
        for roadmap in roadmaps
    )
    return replace(setting, mission=mission), shorter, tuple(way[: last + 1] for way in ways)


def continued(
    planning: SingleAgentPlanning, reservations: Reservations, agents: Sequence[int], begun: Indices
) -> Indices | None:
    """Whole paths of agents, states (agents of the mission, steps + 1), planned one by one; None if an agent has none.

    Args:
        reservations: reservations of all others.
        begun: first steps of the paths, (agents of the mission, some steps).
    """
    whole, limit = reservations.copy(), planning.setting.budget.limits.clauses
    never, exclusions = dict(planning.requirements.never), planning.requirements.exclusions
    steps = np.arange(begun.shape[1])
    for agent in agents:
        elsewhere = np.zeros_like(whole.motion.roadmap(agent).standing)
        elsewhere[steps] = True
        elsewhere[steps, begun[agent]] = False
        never[agent] = elsewhere | never[agent] if agent in never else elsewhere
    search = SingleAgentSearch(planning.order.labels, never, whole, limit, exclusions=exclusions)
    with planning.counted(search):
        for agent in agents:
            way = search.way(agent, (), whole)
            if way is None:
                return None
            whole.reserve((agent,), np.broadcast_to(way, whole.states.shape))
    return np.asarray(whole.states)


@dataclass(slots=True, eq=False)
class PrioritizedPlanner(SingleAgentPlanning):
    """Prioritized planner: extends a joint motion group by group."""

    together: bool = True
    """True if agents without a separate path are planned together by the solver."""
    largest: Problem | None = None
    """Largest solved SAT problem."""
    nearest: Trace | None = None
    """First joint motion with the fewest violated parts so far."""
    fewest: int = 0
    """Number of violated parts of ``nearest``."""
    rounds: int = 0
    taken: int = 0
    failures: int = 0

    def plan(self, first: Agents = NOBODY) -> Indices | None:
        """Joint motion, (agents, steps + 1), without conflicts that satisfies every requirement; None if not found.

        Args:
            first: agents planned before all others.

        Raises:
            TooLarge: the clauses would exceed their limit.
            Unexpressible: a predicate depends on too many agents at once.
        """
        waiting = self.order.groups(self.requirements.parts)
        if sum(map(len, waiting)) > self.settings.group:
            waiting = self.order.groups(self.failing_alone())
        return self.completed(sorted(waiting, key=lambda group: first.isdisjoint(group)))

    def plan_again(self, states: Indices, agents: Agents, by_solver: Mapping[int, str]) -> Indices | None:
        """Joint motion with ``agents`` replanned; all others keep their paths unless pushed. The result is None if none
        is found.

        Args:
            states: motion to change, (agents, steps + 1).
            by_solver: agents whose paths a solver found, with the solver.

        Raises:
            TooLarge: the clauses would exceed their limit.
            Unexpressible: a predicate depends on too many agents at once.
        """
        self.reserve(self.everyone - agents, states, (), alone=True)
        self.by_solver = {agent: by for agent, by in by_solver.items() if agent not in agents}
        return self.completed([(agent,) for agent in sorted(agents)])

    def completed(self, waiting: list[tuple[int, ...]]) -> Indices | None:
        """Joint motion after planning these groups, and replanning agents that violate a part of the requirements; None
        if not found."""
        for _ in range(self.settings.repairs):
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
        """Joint motion after a local search for shorter paths; agents planned alone already have shortest paths."""
        mission, motion = self.setting.mission, whole.motion
        methods = {agent.name: self.by_solver.get(agent.index, SEARCH) for agent in mission.agents}
        self.setting.account.solved = solved_by(methods)
        with self.setting.account.stage("calm"):
            chosen = frozenset(self.reservations.agents) - self.reservations.alone
            goals = [goal.formula for goal in self.kernel.requirements]
            self.setting.budget.on_incumbent(Planned(self.trace(whole.states), self.setting.account.report()))
            return shorten_paths(whole.states, chosen, goals, motion, mission)

    def trace(self, states: Indices) -> Trace:
        """Trace of a joint motion, (agents, steps + 1)."""
        return lift(states, self.reservations.motion.own_roadmaps, self.setting.mission)

    def failing_alone(self) -> list[Part]:
        """Parts that are violated if each agent takes its shortest path alone."""
        with self.setting.account.stage("bystanders"):
            nobody = self.reservations.emptied()
            ways = [self.single_agent.way(agent, (), nobody) for agent in sorted(self.everyone)]
            if any(way is None for way in ways):
                return list(self.requirements.parts)
            return self.failing(self.trace(np.stack([way for way in ways if way is not None]))) or []

    def failing(self, trace: Trace) -> list[Part] | None:
        """Parts that a trace violates; None if every requirement is satisfied."""
        goals = [goal.formula for goal in self.kernel.requirements]
        parts = [part.formula for part in self.requirements.parts]
        values = Evaluation(TRUTH, self.setting.mission, trace).values([*goals, *parts])
        if all(values[goal][0, 0] for goal in goals):
            return None
        return [part for part in self.requirements.parts if not values[part.formula][0, 0]]

    def plan_groups(self, waiting: list[tuple[int, ...]]) -> bool:
        """Plan all these groups, one by one or as many together as the group size allows; return true on success."""
        size = 1
        waiting = self.plan_in_orders(waiting) if not self.reservations.agents else waiting
        while waiting := self.plan_single_agents(waiting):
            if self.refused is not None or not self.together:
                return False
            count = sum(map(len, waiting))
            size = max(size, -(-count // -(-count // self.settings.group)))  # turns of equal size
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

    def plan_with_helpers(self, batch: Agents, waiting: list[tuple[int, ...]]) -> Agents:
        """Plan the batch with as many additional agents as needed; return the planned agents, empty after failure."""
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
            if not helpers and self.plan_around_leader(batch):
                return self.everyone
            if (
                helpers >= len(more)
                or self.failures >= self.settings.failures
                or not self.affordable
                or not self.solvers.alive
            ):
                return NOBODY
            helpers = max(1, 2 * helpers)

    def plan_around_leader(self, leaders: Agents) -> bool:
        """Plan one of ``leaders`` on its shortest path for its own requirements, then all other agents; return true on
        success.

        Requirements on several agents, such as escorts in turns, then apply to the others with a known leader. The
        method fails at once if some agent is already planned, or if one group cannot contain the others.
        """
        if self.reservations.agents or len(self.everyone) - 1 > self.settings.group:
            return False
        for leader in sorted(leaders):
            own = [part for part in self.requirements.parts if part.named == frozenset((leader,))]
            shared = any(leader in part.named and len(part.named) > 1 for part in self.requirements.parts)
            if not own or not shared or not self.affordable:
                continue
            with self.setting.account.stage("alone"), self.counted(self.single_agent) as search:
                way = search.way(leader, [part.formula for part in own], self.reservations)
            if way is None:
                continue
            states = np.broadcast_to(way, self.reservations.states.shape)
            self.reserve(frozenset((leader,)), states, own, alone=True)
            if self.plan_together(self.everyone - {leader}):
                return True
            self.release((leader,))
            self.failures += 1
        return False

    def plan_together(self, batch: Agents) -> bool:
        """Plan the batch around all other planned agents with the solver; return true on success."""
        setting, reservations, guaranteed = self.setting, self.reservations, self.guaranteed
        if not batch.isdisjoint(reservations.agents):  # conditions on the others may depend on them
            reservations, guaranteed = reservations.copy(), set()
            reservations.release(batch.intersection(reservations.agents))
        before = frozenset(reservations.agents)
        if not before and len(batch) == 1 and batch <= self.infeasible_alone:
            return False
        parts = applicable_parts(self.requirements, self.named, guaranteed, before | batch)
        formulas = [*parts.values(), *self.requirements.excluded(before | batch)]
        setting.budget.on_progress(Progress("lower", self.taken + 1, f"{len(batch)} agents after {len(before)}"))
        with setting.account.stage("lower"):
            roadmaps = reservations.open_roadmaps()
            open_ways = Ways(roadmaps, self.requirements.never)
            standing = [reservations.motion.roadmap(agent).standing for agent in sorted(self.everyone)]
            ways = reservations.fixed(
                [open_ways[agent] if agent in batch else way for agent, way in enumerate(standing)]
            )
        group_effort = Effort(self.settings.conflicts, self.settings.rounds)
        for asked in deepened(formulas, setting.mission.steps, self.settings.first_window):
            with setting.account.stage("lower"):
                if self.infeasible(asked, ways, before | batch):
                    continue
            last = last_asked(asked, setting.mission)
            with setting.account.stage("lower"):
                shorter = first_steps(setting, roadmaps, ways, last)
            goal = Goal("all parts", All(tuple(asked)), setting.mission.span)
            links = smt_settings(setting.mission).solver.links
            problem = shorter[0].problem((goal,), *shorter[1:], batch, before, links, self.solvers)
            if problem.lowered.infeasible:
                continue
            effort = group_effort.within(self.most - setting.account.work, problem.search.clauses.count)
            result = problem.search.find(problem.lowered.goals, effort=effort)
            if not isinstance(result, JointMotion):
                continue
            states: Indices | None = result.states
            if last < setting.mission.steps:
                with setting.account.stage("bystanders"):
                    states = continued(self, reservations, sorted(batch), result.states)
            if states is not None:
                break
        else:
            return False
        if reservations is not self.reservations:
            self.reservations, self.guaranteed = reservations, guaranteed
        with setting.account.stage("bystanders"):
            self.reserve(batch, states, parts, alone=False)
        self.by_solver |= dict.fromkeys(batch, self.solvers.answered)
        self.taken += 1
        self.rounds += problem.search.rounds
        if self.largest is None or problem.search.clauses.count > self.largest.search.clauses.count:
            self.largest = problem
        return True
