"""Planning order: the agents that requirements need, in groups that must be planned together.

The order follows from the mission and its roadmaps: agents with the longest path come first.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from missionc.backends.smt.prioritized.requirement_parts import NOBODY, Agents, Part, agents_named_by
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.ir.kernel.nodes import Any, At, AtLeast, Atom, Is, Node, Not, ReachNode
from missionc.ir.kernel.walk import awaited, children, postorder


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
