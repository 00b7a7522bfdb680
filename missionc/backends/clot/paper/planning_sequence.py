"""Dependency graph of agents by phase, which determines the valid planning sequences.

A phase is a run of steps with the same coupled pairs of agents. Couplings come from the requirements only: formations
couple the agents of their edges, distances their two agents, ``connected`` and the spatial operators the agents that
are linked at their starts. Formations of the same agents at the same steps cannot be satisfied together, and their
times are unknown: each has a separate phase beside that of all pairs together.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import cache
from itertools import groupby
from math import inf
from typing import TypeAlias

import numpy as np
from scipy.sparse.csgraph import connected_components

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.ir import Formation, Graph, Mission, Predicate
from missionc.ir.kernel.analysis import relevance
from missionc.ir.kernel.nodes import Atom, Kernel
from missionc.ir.kernel.walk import graph_of
from missionc.ir.language.margins.connected import spanning_tree
from missionc.ir.language.margins.links import all_links

Edge: TypeAlias = tuple[int, int]
"""Two agents by mission index, the lower index first."""

Offers: TypeAlias = Callable[[frozenset[int]], Sequence[int]]
"""Function from the set of planned agents to the agents that may be planned next."""

NEARLY = 1e-6
"""Difference, metres, up to which edges of a formation count as equally long."""


class Phase(Record):
    """Steps ``first`` … ``last``, both included, and the pairs of agents that are coupled at each of them.

    ``neighbours`` is, by agent, the set of agents coupled to it, and ``part`` the index of its connected component.

    Source:
        [clot] IV-B.1, one G_s of the time-varying constraints.
    """

    first: int
    last: int
    neighbours: tuple[frozenset[int], ...]
    part: tuple[int, ...]

    @property
    def edges(self) -> frozenset[Edge]:
        return frozenset(
            (agent, other) for agent, others in enumerate(self.neighbours) for other in others if agent < other
        )

    def meets(self, planned: Collection[int], agent: int) -> bool:
        """Return true if the agent may be planned next in this phase: it is coupled to a planned agent, or is the first
        of its component.

        An agent without an edge is a separate component, and therefore always allowed.
        """
        if not self.neighbours[agent].isdisjoint(planned):
            return True
        return all(self.part[other] != self.part[agent] for other in planned)


class Couplings(Record):
    """Dependency graph of a mission over time; ``whole`` contains the edges of all phases.

    Source:
        [clot] IV-B.1, {G_s} and the graph of their edges together.
    """

    phases: tuple[Phase, ...]
    whole: Phase

    def neighbours(self, agent: int, phase: int) -> frozenset[int]:
        """Agents coupled to an agent in a phase (an index into ``phases``): N_i.

        Source:
            [clot] IV-B.1.
        """
        return self.phases[phase].neighbours[agent]

    @property
    def components(self) -> tuple[frozenset[int], ...]:
        """Components of agents that depend on each other in any phase, directly or indirectly, ordered by lowest
        agent."""
        groups: dict[int, set[int]] = {}
        for agent, part in enumerate(self.whole.part):
            groups.setdefault(part, set()).add(agent)
        return tuple(frozenset(group) for group in groups.values())

    def may_follow(self, planned: Collection[int], agent: int) -> bool:
        """Return true if a sequence stays valid if ``agent`` is planned after the ``planned`` agents.

        The agent must be coupled to a planned agent, and to a planned agent in each phase that couples it. The paper's
        condition is undefined if a phase's graph is not connected; here the first agent of a component is always
        allowed, in each phase and in the whole graph.

        Source:
            [clot] IV-B.1, the condition below (5) and its strengthened form.
        """
        if agent in planned:
            return False
        return all(phase.meets(planned, agent) for phase in (self.whole, *self.phases))

    def next_agents(self, planned: frozenset[int]) -> tuple[int, ...]:
        """Agents that may be planned next, in mission order; empty only if all are planned.

        If no agent of a component is planned, the result contains all its agents from which a valid sequence covers the
        component. A component that was started is finished first. If no agent of that component is allowed in every
        phase, no valid sequence continues, and the agents allowed in the most phases are returned.

        Source:
            [clot] IV-C.1 (II), N_ext, among the valid sequences of (5).
        """
        others = [agent for agent in range(len(self.whole.part)) if agent not in planned]
        near = [agent for agent in others if not self.whole.neighbours[agent].isdisjoint(planned)]
        if not near:
            return tuple(filter(self._leads_on, others)) or tuple(others)
        met = [sum(phase.meets(planned, agent) for phase in self.phases) for agent in near]
        return tuple(agent for agent, count in zip(near, met, strict=True) if count == max(met))

    def valid_agents(self, planned: frozenset[int]) -> tuple[int, ...]:
        """Agents of ``next_agents`` that keep the sequence valid; all of ``next_agents`` if their component has no
        valid sequence.

        Source:
            [clot] IV-B.1, the strengthened condition below (5).
        """
        offered = self.next_agents(planned)
        valid = tuple(agent for agent in offered if self.may_follow(planned, agent))
        parts = {self.whole.part[agent] for agent in offered}
        component = (agent for agent, part in enumerate(self.whole.part) if part in parts)
        return valid if any(map(self._leads_on, component)) else offered

    def _leads_on(self, first: int) -> bool:
        """Return true if a valid sequence that starts with ``first`` covers the component of ``first``.

        An agent that may follow some agents may also follow more agents of the component, so each is added as soon as
        possible.
        """
        left = {agent for agent, part in enumerate(self.whole.part) if part == self.whole.part[first]} - {first}
        planned = {first}
        while able := {agent for agent in left if self.may_follow(planned, agent)}:
            planned |= able
            left -= able
        return not left

    def breadth_first(self, first: int) -> tuple[int, ...]:
        """Breadth-first sequence of all agents from ``first`` on: each time the neighbour of the earliest planned
        agent.

        Source:
            [clot] (5), κ, for the ablation with a fixed sequence (FSOT).
        """
        place: dict[int, int] = {}

        def earliest(agent: int) -> tuple[int, int]:
            near = self.whole.neighbours[agent] & place.keys()
            return min((place[other] for other in near), default=len(place)), agent

        chosen = first
        while True:
            place[chosen] = len(place)
            offered = self.next_agents(frozenset(place))
            if not offered:
                return tuple(place)
            chosen = min(offered, key=earliest)

    def parent(self, agent: int, planned: Collection[int], positions: Array) -> int | None:
        """Nearest planned agent that is coupled to ``agent`` in some phase; None without such an agent.

        Args:
            positions: positions of all agents, (agents, dim), metres.

        Source:
            [clot] IV-B.1: the preceding robot that i_ℓ is connected to.
        """
        near = sorted(self.whole.neighbours[agent].intersection(planned))
        if not near:
            return None
        return near[int(np.argmin(np.linalg.norm(positions[near] - positions[agent], axis=1)))]


def couplings(mission: Mission, kernel: Kernel, positions: Array, nearest: bool = False) -> Couplings:
    """Dependency graph of a mission's requirements.

    An edge belongs to every step at which the truth of its formula can matter, with nested windows evaluated at step 0.
    Preferences couple no agents.

    Args:
        positions: positions for links, usually the starts, (agents, dim), metres. If a graph is not connected there,
            its nearest agents are coupled until the graph is connected.
        nearest: True if a formation couples only pairs in which one agent is nearest to the other, not all edges.

    Source:
        [clot] IV-B.1, the dependency graph and its phases; III-C, the neighbouring robots of a formation.
    """
    agents, steps = len(mission.agents), int(mission.steps) + 1
    when: dict[frozenset[Edge], Flags] = {}
    shaped: dict[Predicate, tuple[frozenset[Edge], Flags]] = {}

    @cache
    def communicating(graph: Graph) -> frozenset[Edge]:
        return communication(graph, positions)

    for node, where in relevance((goal.formula for goal in kernel.requirements), agents, steps - 1):
        timed_edges: Iterable[tuple[frozenset[Edge], Flags]] = ()
        if graph := graph_of(node):
            timed_edges = [(communicating(graph), _any_agent(where[list(graph.agents)]))]
        elif isinstance(node, Atom) and (linked_over := node.predicate.restricted):
            timed_edges = [(communicating(linked_over), _any_agent(where))]
        elif isinstance(node, Atom):
            timed_edges = list(_coupled_by(node.predicate, where))
            if nearest and node.predicate.formation:
                kept = _nearest(node.predicate.formation)
                timed_edges = [(pairs, at) for pairs, at in timed_edges if pairs <= kept]
            if node.predicate.formation:
                edges, before = shaped.get(node.predicate, (frozenset[Edge](), np.zeros(steps, dtype=np.bool_)))
                shaped[node.predicate] = edges.union(*(pairs for pairs, _ in timed_edges)), before | _any_agent(where)
        for pairs, at in timed_edges:
            when[pairs] = when.get(pairs, at) | at
    nobody: frozenset[Edge] = frozenset()
    by_step = [nobody.union(*(pairs for pairs, at in when.items() if at[step])) for step in range(steps)]
    return of_phases([*_runs(by_step), *_one_at_a_time(list(shaped.values()))], agents)


def _one_at_a_time(shaped: list[tuple[frozenset[Edge], Flags]]) -> Iterator[tuple[int, int, frozenset[Edge]]]:
    """Yield a phase (first step, last step, edges) for each formation that competes with others of the same agents at
    the same steps."""
    members = [frozenset(agent for edge in edges for agent in edge) for edges, _ in shaped]
    nobody: frozenset[Edge] = frozenset()
    for number, (edges, at) in enumerate(shaped):
        beside = np.zeros_like(at)
        for other, (others, its) in enumerate(shaped):
            if others != edges and members[number] & members[other]:
                beside |= its
        runs = _runs([edges if both else nobody for both in (at & beside).tolist()])
        yield from (run for run in runs if run[-1])


def of_phases(phases: Iterable[tuple[int, int, Collection[Edge]]], agents: int) -> Couplings:
    """Dependency graph of ``agents`` agents from the first step, last step and edges of each phase.

    Source:
        [clot] IV-B.1, {G_s}.
    """
    made = tuple(_phase(first, last, edges, agents) for first, last, edges in phases)
    together = frozenset(edge for phase in made for edge in phase.edges)
    return Couplings(made, _phase(made[0].first, max(phase.last for phase in made), together, agents))


def communication(graph: Graph, positions: Array) -> frozenset[Edge]:
    """Pairs of agents linked at these positions; the nearest pairs are added until the graph is connected.

    Args:
        positions: positions of all the mission's agents, (agents, dim), metres.

    Source:
        [clot] IV-B.1: global constraints are modelled by the initial communication graph.
    """
    there = all_links(graph, positions[:, None, :])[0]
    margin = np.maximum(there, there.T)
    first, second, _ = (each[0] for each in spanning_tree(margin[None])) if graph.agents else ((), (), ())
    pairs = [*np.argwhere(margin > 0).tolist(), *zip(first, second, strict=True)]
    return frozenset(_edge(graph.agents[one], graph.agents[other]) for one, other in pairs)


def in_order(sequence: Sequence[int]) -> Offers:
    """Function that offers the agents in this order only.

    Source:
        [clot] V-A.3, FSOT.
    """
    return lambda planned: tuple(sequence[len(planned) : len(planned) + 1])


def in_any_order(agents: int) -> Offers:
    """Function that offers all unplanned agents, coupled or not.

    Source:
        [clot] Remark 2, random orderings.
    """
    return lambda planned: tuple(agent for agent in range(agents) if agent not in planned)


def _coupled_by(predicate: Predicate, where: Flags) -> Iterator[tuple[frozenset[Edge], Flags]]:
    """Yield the pairs of agents that a predicate couples, with the steps, (steps + 1,).

    Args:
        where: agents and steps at which the predicate matters, (agents, steps + 1), as in ``relevance``.
    """
    for agent in np.flatnonzero(where.any(axis=1)).tolist():
        for first, second in predicate.pairs_of(agent):
            if first != second:
                yield frozenset({_edge(first, second)}), where[agent]


def _nearest(formation: Formation) -> frozenset[Edge]:
    """Edges of a formation that are the shortest edge of at least one of their agents."""
    metres = {_edge(each.first, each.second): float(np.linalg.norm(each.target)) for each in formation.edges}
    least = {
        agent: min((far for edge, far in metres.items() if agent in edge), default=inf) for agent in formation.agents
    }
    return frozenset(edge for edge, far in metres.items() if any(far <= least[agent] + NEARLY for agent in edge))


def _any_agent(where: Flags) -> Flags:
    """Steps at which the node is evaluated for some agent, (steps + 1,)."""
    steps: Flags = np.logical_or.reduce(where)
    return steps


def _edge(first: int, second: int) -> Edge:
    return min(first, second), max(first, second)


def _runs(by_step: list[frozenset[Edge]]) -> Iterator[tuple[int, int, frozenset[Edge]]]:
    """Yield runs of consecutive steps with the same edges: first step, last step and edges."""
    first = 0
    for edges, run in groupby(by_step):
        length = len(list(run))
        yield first, first + length - 1, edges
        first += length


def _phase(first: int, last: int, edges: Iterable[Edge], agents: int) -> Phase:
    near = np.zeros((agents, agents), dtype=np.bool_)
    for one, other in edges:
        near[one, other] = near[other, one] = True
    _, part = connected_components(near, directed=False)
    neighbours = tuple(frozenset(np.flatnonzero(row).tolist()) for row in near)
    return Phase(first, last, neighbours, tuple(part.tolist()))
