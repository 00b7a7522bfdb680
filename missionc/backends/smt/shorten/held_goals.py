"""Goals that hold of a joint motion, and the properties of their formulas that no motion changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import reduce

import numpy as np

from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.roadmap.labels import Labels, others
from missionc.backends.smt.roadmap.own_state import own_states, states_of
from missionc.base.trace import Flags
from missionc.ir import Graph, Mission, Predicate
from missionc.kernel.nodes import (
    Always,
    At,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.kernel.walk import children, postorder

LINKED = Neighbour | EveryNeighbour | Reach | EveryReach
"""What reads the links of a graph, and no lengths."""


@dataclass(slots=True)
class Goals:
    """Asked of step 0.

    ``instant``: nodes that the states at the step they are asked at decide.
    ``own``: of those, the ones that an agent's own state decides where it is asked.
    ``ahead``: by how many steps the others look ahead, the motion from the last included.
    """

    formulas: tuple[Node, ...]
    mission: Mission
    motion: Motion
    labels: Labels
    order: list[Node] = field(init=False)
    instant: set[Node] = field(default_factory=set)
    own: set[Node] = field(init=False)
    ahead: dict[Node, int] = field(default_factory=dict)
    work: int = 0
    """Pairs of agents looked at so far, which is what most of the time goes into."""
    _concerned: dict[int, dict[Node, Flags]] = field(default_factory=dict)
    _states: dict[tuple[Node, int], Flags] = field(default_factory=dict)
    _read: dict[Node, tuple[tuple[Predicate, ...], tuple[Graph, ...]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.order = postorder(self.formulas)
        self.own = own_states(self.order, self.labels)
        for node in self.order:
            self.ahead[node] = self._looks(node)
            if self.ahead[node] == 0 and not _measures(node):
                self.instant.add(node)

    def read_by(self, node: Node) -> tuple[tuple[Predicate, ...], tuple[Graph, ...]]:
        """The predicates and the graphs that a formula reads."""
        if node not in self._read:
            below = postorder((node,))
            atoms = dict.fromkeys(each.predicate for each in below if isinstance(each, Atom))
            graphs = dict.fromkeys(each.graph for each in below if isinstance(each, LINKED))
            self._read[node] = tuple(atoms), tuple(graphs)
        return self._read[node]

    def states(self, node: Node, agent: int) -> Flags:
        """In which states of its roadmap, (states,), the agent's own state makes such a node true."""
        if (node, agent) not in self._states:
            number = int(self.motion.roadmap_of[agent])
            self._states[node, agent] = states_of(node, agent, number, self.labels)
        return self._states[node, agent]

    def concerned(self, agent: int) -> dict[Node, Flags]:
        """For each node, of whom it can be asked so that the agent's motion may matter: (agents,)."""
        if agent not in self._concerned:
            known: dict[Node, Flags] = {}
            for node in self.order:
                known[node] = self._matters(node, agent, known)
            self._concerned[agent] = known
        return self._concerned[agent]

    def _looks(self, node: Node) -> int:
        last, ahead = self.motion.steps, self.ahead
        match node:
            case Atom(predicate):
                numbers = range(len(self.motion.roadmaps))
                return int(any(self.labels.of_moves(predicate, number) for number in numbers))
            case Always(body, _, high) | Eventually(body, _, high):
                # A window counts even where it is of this step alone: it is seen to by itself.
                return max(1, last if high is None else high + ahead[body])
            case Until(hold, end, _, high) | Release(hold, end, _, high):
                held = high - 1 + ahead[hold] if high else 0
                return max(1, held, last if high is None else high + ahead[end])
            case _:
                return max((ahead[part] for part in children(node)), default=0)

    def _matters(self, node: Node, agent: int, known: dict[Node, Flags]) -> Flags:
        agents = len(self.mission.agents)
        nobody = np.zeros(agents, dtype=np.bool_)
        match node:
            case Atom(predicate):
                it = np.arange(agents) == agent
                return np.ones(agents, dtype=np.bool_) if predicate.about_team or agent in others(predicate, -1) else it
            case At(asked, body):
                return np.full(agents, known[body][asked])
            case Neighbour(graph, body) | EveryNeighbour(graph, body):
                return self._in_graph(graph.agents, agent, known[body])
            case Reach(graph, _, end) | EveryReach(graph, _, end) | Route(graph, _, end) | EveryRoute(graph, _, end):
                below = [known[part] for part in children(node)]
                return known[end] | self._in_graph(graph.agents, agent, np.logical_or(*below))
            case PathLength(graph):
                return self._in_graph(graph.agents, agent, nobody)
            case _:
                return reduce(np.logical_or, (known[part] for part in children(node)), nobody)

    def _in_graph(self, members: Sequence[int], agent: int, below: Flags) -> Flags:
        result = np.zeros(len(self.mission.agents), dtype=np.bool_)
        result[list(members)] = agent in members or bool(below[list(members)].any())
        return result


def _measures(node: Node) -> bool:
    """Whether it is about lengths in metres, itself or what it denies."""
    return isinstance(node.body if isinstance(node, Not) else node, Route | EveryRoute | PathLength)
