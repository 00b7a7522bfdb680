"""Prioritized planning of single agents: each takes the shortest path that the previous agents leave free.

    in   roadmaps, the requirements in parts
    out  reserved trajectories, and the agents without a path

An agent without a path displaces others, which are replanned. Two agents that repeatedly displace each other are
searched jointly. The remaining agents go first in another order, from the beginning.

Source:
    Erdmann and Lozano-Pérez, "On multiple moving objects", 1987; Andreychuk and Yakovlev, "Two techniques that enhance
    the performance of multi-robot prioritized path planning", 2018: orders in which the remaining agents go first.

Planning order: the agents that requirements need, in groups that must be planned together.

The order follows from the mission and its roadmaps: agents with the longest path come first.

Precedence: conditions on some agents until other agents act, split into conditions for separate planning.

    in   conjuncts of the requirements
    out  stronger conjuncts, each about fewer agents

``(not (some barge: chamber)) until[0, 10 min] (keeper: hut)`` couples every barge with the keeper. With a selected
step, it requires each barge to stay away before that step, and the keeper to be in the hut at it. The selected step
makes the requirement stronger, so that failure to find a plan proves nothing.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from missionc.backends.run_account import MOVE_STEP
from missionc.backends.smt.encode.clauses import Clauses
from missionc.backends.smt.encode.lower_motion import Ways, lower_motion
from missionc.backends.smt.prioritized.joint_search import JointSearch
from missionc.backends.smt.prioritized.requirement_parts import (
    NOBODY,
    Agents,
    Part,
    RequirementParts,
    agents_named_by,
    applicable_parts,
    named_agents,
    own_formulas,
    split_requirements,
    throughout,
)
from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.prioritized.single_agent_relaxation import SingleAgentRelaxation
from missionc.backends.smt.prioritized.single_agent_search import SingleAgentSearch
from missionc.backends.smt.refine.lazy_constraints import metric, needed
from missionc.backends.smt.refine.problem import Setting
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.backends.smt.sat.solve import Solvers
from missionc.backends.smt.sat.solver_process import is_over
from missionc.backends.smt.settings import PrioritizedSettings, smt_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    Goal,
    Is,
    Kernel,
    Node,
    Not,
    ReachNode,
    Until,
)
from missionc.ir.kernel.walk import Conjunct, awaited, children, conjuncts, postorder, rebuilt, same_objects
from missionc.planning.progression.residuals import TooComplex


class Need(Record):
    """Agents that can make a formula true together, and the number of steps until each can reach its states."""

    steps: int = 0
    agents: Agents = NOBODY


@dataclass(slots=True, eq=False)
class PlanningOrder:
    """Order in which groups of agents are planned."""

    labels: Labels
    _graphs: dict[int, csr_array] = field(default_factory=dict)
    _last: tuple[tuple[int, bytes], int, Array] | None = None
    """Roadmap and starts of the last query, and the number of moves to each state, (states,)."""

    def groups(self, parts: Iterable[Part]) -> list[tuple[int, ...]]:
        """Groups of agents that can make these parts true, each planned as one problem, in planning order.

        First come agents that others must reach, then the agents with the longest path.
        """
        group_of: dict[int, set[int]] = {}
        steps: dict[int, int] = {}
        hubs: set[int] = set()
        for part in parts:
            need = self.need(part.formula)
            hubs |= _hubs(part.formula)
            together = set(need.agents).union(*(group_of.get(agent, ()) for agent in need.agents))
            for agent in together:
                group_of[agent] = together
            for agent in need.agents:
                steps[agent] = max(steps.get(agent, 0), need.steps)
        found = {tuple(sorted(group)) for group in group_of.values()}

        def first(group: tuple[int, ...]) -> tuple[bool, int, tuple[int, ...]]:
            return hubs.isdisjoint(group), -max(steps[agent] for agent in group), group

        return sorted(found, key=first)

    def need(self, formula: Node) -> Need:
        """Cheapest choice of agents that can make a formula true."""
        needs: dict[Node, Need] = {}
        for node in postorder((formula,)):
            needs[node] = self._need(node, needs)
        return needs[formula]

    def _need(self, node: Node, needs: dict[Node, Need]) -> Need:
        match node:
            case At(agent, body):
                inner = needs[body]
                return Need(max(inner.steps, self.steps_to(agent, body)), inner.agents | {agent})
            case Atom():
                return Need(0, agents_named_by(node))
            case Any(parts):
                return _together(_cheapest([needs[part] for part in parts], 1))
            case AtLeast(count, parts):
                return _together(_cheapest([needs[part] for part in parts], count))
            case _:
                return _together([needs[child] for child in children(node)])

    def steps_to(self, agent: int, body: Node) -> int:
        """First step by which the agent can have visited all the states that the formula requires."""
        latest, order = 0, postorder((body,))
        never = len(self.labels.roadmaps[self.labels.roadmap_of[agent]].standing)
        own = own_states(order, self.labels)
        for event in filter(None, map(awaited, order)):
            if event.node in own:
                latest = max(latest, self._moves(agent, states_of(event.node, agent, self.labels), never))
        return latest

    def _moves(self, agent: int, places: Flags, most: int) -> int:
        """Number of moves from the agent's starts to the nearest flagged state, (states,), at most ``most``."""
        few = 16  # moves of the first search; doubled until a goal is reached
        number = self.labels.roadmap_of[agent]
        roadmap = self.labels.roadmaps[number]
        starts = roadmap.starts[roadmap.agents.index(agent)]
        if number not in self._graphs:
            count = len(roadmap.position)
            moves = coo_array((np.ones(len(roadmap.moves)), tuple(roadmap.moves.T)), shape=(count, count))
            self._graphs[number] = csr_array(moves)
        key, near, moves_to = (number, starts.tobytes()), 0, np.zeros(0)
        if self._last is not None and self._last[0] == key:
            _, near, moves_to = self._last
        while near < most and not (near and np.isfinite(moves_to[places]).any()):
            near = max(few, 2 * near)
            moves_to = dijkstra(self._graphs[number], indices=starts, unweighted=True, limit=near, min_only=True)
            self._last = key, near, moves_to
        return int(min(moves_to[places].min(initial=np.inf), most))


def _together(needs: list[Need]) -> Need:
    return Need(max((need.steps for need in needs), default=0), NOBODY.union(*(need.agents for need in needs)))


def _cheapest(needs: list[Need], count: int) -> list[Need]:
    return sorted(needs, key=lambda need: (need.steps, len(need.agents), sorted(need.agents)))[: max(count, 0)]


def _hubs(formula: Node) -> set[int]:
    """Agents named as the ends of routes in a formula."""
    hubs: set[int] = set()
    for node in postorder((formula,)):
        match node:
            case ReachNode(graph, _, Is(members) | Not(Is(members)) as end) if isinstance(end, Not) is node.every:
                hubs |= members if len(members) < len(graph.agents) else set()
            case _:
                pass
    return hubs


def with_steps_chosen(kernel: Kernel, order: PlanningOrder, later: float) -> Kernel:
    """Kernel with a selected step for each ``until`` about several agents; the same kernel without such an ``until``.

    Args:
        later: position of the selected step in its window, 0 to 1.
    """
    requirements = tuple(_goal_chosen(goal, order, later) for goal in kernel.requirements)
    return kernel if same_objects(requirements, kernel.requirements) else replace(kernel, requirements=requirements)


def _goal_chosen(goal: Goal, order: PlanningOrder, later: float) -> Goal:
    parts = list(conjuncts((goal.formula,)))
    if not any(map(is_precedence, parts)):
        return goal
    formulas = [
        part for each in parts for part in (_chosen(each, order, later) if is_precedence(each) else [_formula(each)])
    ]
    return replace(goal, formula=All(tuple(formulas), goal.formula.span))


def is_precedence(conjunct: Conjunct) -> bool:
    """Return true if the conjunct is an ``until`` from the beginning whose sides concern more than one agent."""
    if conjunct.windows or not isinstance(conjunct.formula, Until):
        return False
    formula = _formula(conjunct)
    return len(named_agents((formula,))[formula]) > 1


def _formula(conjunct: Conjunct) -> Node:
    """Conjunct as one formula at step 0."""
    asked = throughout(conjunct.windows, conjunct.formula)
    return asked if conjunct.agent is None else At(conjunct.agent, asked, asked.span)


def _chosen(conjunct: Conjunct, order: PlanningOrder, later: float) -> list[Node]:
    """Conditions of an ``until`` with a selected step: ``end`` at that step, and ``hold`` at all steps before it."""
    settings = smt_settings(order.labels.mission).prioritized
    agent, _, node = conjunct
    assert isinstance(node, Until)
    hold, end = (part if agent is None else At(agent, part, node.span) for part in (node.hold, node.end))
    last = order.labels.mission.steps if node.high is None else node.high
    soon = min(max(node.low, int(settings.wait_factor * order.need(_sometime(end)).steps) + settings.wait_steps), last)
    step = soon + int(later * (last - soon))
    before: list[Node] = [Always(hold, 0, step - 1, node.span)] if step else []
    return [*before, Always(end, step, step, node.span)]


def _sometime(node: Node) -> Node:
    """Formula that a node becomes true for each of its agents separately, at any step."""
    match node:
        case At(agent, body):
            return At(agent, Eventually(body, 0, None, node.span), node.span)
        case All() | Any() | AtLeast():
            return rebuilt(node, tuple(map(_sometime, children(node))))
        case _:
            return node


@dataclass(slots=True, eq=False)
class SingleAgentPlanning:
    """Prioritized planner of single agents: extends a set of reserved trajectories agent by agent.

    ``most``: work limit on the run's account. ``later``: position of the step selected for a precedence in its window
    (0 to 1).
    """

    setting: Setting
    kernel: Kernel
    roadmaps: tuple[Roadmap, ...]
    solvers: Solvers
    most: float
    later: float | None = None
    requirements: RequirementParts = field(init=False)
    named: dict[Node, Agents] = field(init=False)
    order: PlanningOrder = field(init=False)
    reservations: Reservations = field(init=False)
    ways: Ways = field(init=False)
    single_agent: SingleAgentSearch = field(init=False)
    infeasible_alone: set[int] = field(default_factory=set)
    """Agents whose single-agent relaxation is infeasible without any planned agent."""
    lost_alone: set[int] = field(default_factory=set)
    """Agents without a path even without any planned agent."""
    guaranteed: set[Part] = field(default_factory=set)
    """Parts that are satisfied by the planned agents whatever additional agents do."""
    pushed: Counter[tuple[int, int]] = field(default_factory=Counter)
    """Number of times that the first agent has displaced the second."""
    able: set[int] = field(default_factory=set)
    """Agents that can satisfy their own requirements alone."""
    compatible: set[Agents] = field(default_factory=set)
    """Sets of agents that can satisfy their own requirements without conflict, as far as an untimed search shows."""
    chosen: bool = field(init=False)
    """True if steps were selected: the requirements are then stronger, and refusals are not possible."""
    refused: tuple[str, ...] | None = None
    """Names of requirements in conflict, if these roadmaps are known to contain no plan; None otherwise."""
    by_solver: dict[int, str] = field(default_factory=dict)
    """Solver that found the path, for planned agents with a solver's path; all others used search."""

    def __post_init__(self) -> None:
        mission = self.setting.mission
        with self.setting.account.stage("lower"):
            labels = Labels(mission, self.roadmaps)
            self.order = PlanningOrder(labels)
            asked = self.kernel if self.later is None else with_steps_chosen(self.kernel, self.order, self.later)
            self.chosen = asked is not self.kernel
            self.requirements = split_requirements(asked, labels)
            self.named = named_agents(part.formula for part in self.requirements.parts)
            self.ways = Ways(self.roadmaps, self.requirements.never)
            self.reservations = Reservations(lower_motion(self.roadmaps, self.ways, NOBODY, Clauses(1)), mission)
            self.single_agent = self.search()

    @property
    def settings(self) -> PrioritizedSettings:
        return smt_settings(self.setting.mission).prioritized

    @property
    def enough(self) -> int:
        """Work limit of single-agent searches, in units of moves."""
        return self.settings.search_work + self.settings.search_work_each * len(self.everyone)

    @property
    def affordable(self) -> bool:
        """True if work and time are left."""
        enough = self.single_agent.work >= self.enough or self.setting.account.work >= self.most
        return not enough and not is_over(self.setting.budget.deadline)

    @property
    def everyone(self) -> Agents:
        return frozenset(range(len(self.setting.mission.agents)))

    def own_parts(self, agent: int) -> list[Node]:
        """Requirements on this agent alone."""
        return [part.formula for part in self.requirements.parts if part.named == frozenset((agent,))]

    def search(self, haste: float | None = None) -> SingleAgentSearch:
        limit = self.setting.budget.limits.clauses
        never, exclusions = self.requirements.never, self.requirements.exclusions
        return SingleAgentSearch(self.order.labels, never, self.reservations, limit, haste, exclusions)

    @contextmanager
    def counted(self, search: SingleAgentSearch) -> Iterator[SingleAgentSearch]:
        """Context in which the work of a search is counted and limited by the remaining work."""
        account, before = self.setting.account, search.work
        search.most = before + (self.most - account.work) / MOVE_STEP
        try:
            yield search
        finally:
            search.most = math.inf
            account.work += MOVE_STEP * (search.work - before)

    def refusing(self, agent: int) -> tuple[str, ...] | None:
        """Names of the requirements for which the agent's roadmap certainly contains no path; None if unknown."""
        if agent in self.able or self.chosen:
            return None
        with suppress(TooComplex):
            with self.counted(self.search()) as search:
                if search.alone(agent, self.own_parts(agent)) is not None:
                    self.able.add(agent)
                    return None
            with self.counted(SingleAgentSearch(self.order.labels, {}, self.reservations, 1)) as search:
                return smallest_conflict(self.kernel, search, agent)
        return None

    def plan_in_orders(self, waiting: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Plan the agents that have a separate path, restarting with the remaining agents first.

        Returns:
            groups that remain unplanned in the last of these orders.
        """
        order, left, urgent = list[tuple[int, ...]](), waiting, list[tuple[int, ...]]()
        for _ in range(self.settings.orders):
            before, order = order, [*urgent, *(group for group in waiting if group not in urgent)]
            if order != before:
                self.release(list(self.reservations.agents))
                self.reservations.moved[:] = 0
                self.pushed.clear()
                left = self.plan_single_agents(order)
            stuck = [group for group in left if len(group) == 1 and group not in urgent[:1]]
            if (
                not stuck
                or self.refused is not None
                or self.single_agent.work > self.settings.orders_work
                or not self.affordable
            ):
                break
            urgent = [*stuck, *(group for group in urgent if group not in stuck)]
        return left

    def plan_single_agents(self, waiting: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
        """Plan the agents that have a separate path; return the remaining groups."""
        queue, left, failures = deque(waiting), list[tuple[int, ...]](), 0
        while queue and failures < self.settings.single_failures and self.affordable and self.refused is None:
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
                    exchanges = min(self.pushed[group[0], other], self.pushed[other, group[0]])
                    if exchanges == self.settings.exchanges and self.plan_jointly((group[0], other)):
                        queue.remove((other,))
                    elif exchanges >= self.settings.exchanges_most:
                        queue.remove((other,))
                        left.append((other,))
                    if exchanges >= self.settings.exchanges:
                        break
        return left + list(queue)

    def plan_single_agent(self, agent: int) -> list[int] | None:
        """Plan the agent on the shortest path that satisfies its requirements.

        If others block every such path, the agent takes a path with few conflicts with agents that were planned alone.

        Returns:
            displaced agents, which must be replanned; None if there is no path.
        """
        first = not self.reservations.agents
        if first and agent in self.lost_alone:
            return None
        present = frozenset((agent, *self.reservations.agents))
        parts = applicable_parts(self.requirements, self.named, self.guaranteed, present)
        formulas, reservations, setting = list(parts.values()), self.reservations, self.setting
        with setting.account.stage("alone"):
            if first and self.infeasible(formulas, self.ways, frozenset((agent,))):
                self.infeasible_alone.add(agent)
                self.lost_alone.add(agent)
                return None
            may_push = (
                bool(reservations.alone)
                and reservations.moved.sum() < self.settings.pushes * reservations.motion.agents
            )
            with self.counted(self.single_agent) as search:
                way = search.way_or_push(agent, formulas, reservations, may_push=may_push)
            if way is None:
                self.lost_alone.update((agent,) if first else ())
                self.refused = self.refusing(agent)
                return None
            moved = reservations.in_the_way(agent, way)
            reservations.moved[moved] += 1
            self.release(moved)
            self.reserve(frozenset((agent,)), np.broadcast_to(way, reservations.states.shape), parts, alone=True)
            return moved

    def plan_jointly(self, agents: tuple[int, ...]) -> bool:
        """Plan agents, the first of them already planned, on the best joint motion; return true on success."""
        setting, formulas = self.setting, [self.own_parts(agent) for agent in agents]
        one, other = np.array(agents)[:, None], np.array(agents)
        apart, factors = needed(one, other, setting.mission), metric(one, other, setting.mission)
        with setting.account.stage("alone"), suppress(TooComplex):
            free = SingleAgentSearch(self.order.labels, {}, self.reservations, 1)
            nothing: list[list[Node]] = [[]] * len(agents)
            questions = (
                (free, nothing, ()),
                (self.single_agent, formulas, names_about(self.kernel, agents)),
            )
            for search, asked, names in questions if frozenset(agents) not in self.compatible else ():
                movers = [search.mover(*each, None) for each in zip(agents, asked, strict=True)]
                if not self.chosen and JointSearch(movers, apart, factors).refused:
                    self.refused = names
                    return False
            self.compatible.add(frozenset(agents))
            rest = self.reservations.copy()
            rest.release(set(agents).intersection(rest.agents))
            movers = [self.single_agent.mover(*each, rest) for each in zip(agents, formulas, strict=True)]
            found = JointSearch(movers, apart, factors).find()
            states = rest.states.copy()
            states[list(agents)] = 0 if found is None else found
            if found is not None and self.single_agent.admits(agents, states, rest):
                self.release(set(agents).intersection(self.reservations.agents))
                present = frozenset((*agents, *self.reservations.agents))
                parts = applicable_parts(self.requirements, self.named, self.guaranteed, present)
                self.reserve(frozenset(agents), states, parts, alone=True)
                return True
        return False

    def infeasible(self, formulas: Sequence[Node], ways: Sequence[Flags], present: Agents) -> bool:
        """Return true if no joint motion of the present agents satisfies the formulas; False proves nothing.

        Args:
            ways: possible states of each agent, (steps + 1, states).
        """
        return SingleAgentRelaxation(self.order.labels, ways, present).infeasible(formulas)

    def reserve(self, agents: Agents, states: Indices, parts: Iterable[Part], *, alone: bool) -> None:
        """Reserve the trajectories of ``agents`` in ``states``, (agents of the mission, steps + 1), and record the
        parts that they satisfy."""
        self.reservations.reserve(sorted(agents), states, alone=alone)
        self.infeasible_alone.clear()
        self.lost_alone.clear()
        self.guaranteed.update(part for part in parts if part.monotone)

    def release(self, agents: Iterable[int]) -> None:
        """Release agents that were planned alone; effects on other agents are checked at the end."""
        released = frozenset(agents)
        self.reservations.release(sorted(released))
        self.guaranteed = {part for part in self.guaranteed if not part.named or not part.named <= released}
        self.by_solver = {agent: by for agent, by in self.by_solver.items() if agent not in released}


def smallest_conflict(kernel: Kernel, search: SingleAgentSearch, agent: int) -> tuple[str, ...]:
    """Minimal set of requirement names for which the agent has no path.

    Raises:
        TooComplex: the search cannot express the requirements.
    """
    own = {goal.name: own_formulas(goal.formula, agent) for goal in kernel.requirements}
    for name in list(own):
        less = [formula for other, asked in own.items() if other != name for formula in asked]
        if own[name] and search.alone(agent, less) is not None:
            continue
        del own[name]
    return tuple(own)


def names_about(kernel: Kernel, agents: Iterable[int]) -> tuple[str, ...]:
    """Names of the requirements that constrain an agent of ``agents`` by name."""
    goals = kernel.requirements
    return tuple(goal.name for goal in goals if any(own_formulas(goal.formula, agent) for agent in agents))
