"""Encoding of kernel formulas: clauses over the agents' states on their roadmaps.

    in   kernel, motion
    out  Lowered: for each goal, the literal that requires it

A cell is a pair of an agent and a step. All cells of a node are encoded together, each once. Literals imply their
formulas (``clauses``), which suffices because the kernel is in negation normal form.

Source:
    [strel] Symbolic Encoding of STREL Specifications.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import assert_never

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, NOTHING, TRUE, Clauses, Literals
from missionc.backends.smt.encode.lower_atoms import Atoms
from missionc.backends.smt.encode.lower_motion import Motion, Occupancy
from missionc.backends.smt.encode.lower_on_demand import Ask, at_least, choose, join
from missionc.backends.smt.encode.lower_places import Places, cheap_first, leads_on
from missionc.backends.smt.encode.lower_windows import Windows
from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.late_dataclass import Record
from missionc.base.trace import Indices
from missionc.ir.kernel.analysis import same_for_all
from missionc.ir.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    Atom,
    Goal,
    LeafNode,
    NeighbourNode,
    Node,
    Not,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
)


class Lowered(Record):
    """Literals to assume, one for each goal in order; if the literal is true, the goal is satisfied.

    ``infeasible``: some goal is satisfied by no motion. ``shortened``: some route has fewer links than the mission
    allows, so a plan is valid, but a refusal is no proof.
    """

    goals: tuple[int, ...]
    infeasible: bool
    shortened: bool


def lower(
    goals: Sequence[Goal], labels: Labels, motion: Motion, clauses: Clauses, occupancy: Occupancy, most_links: int
) -> Lowered:
    """Encode the goals, each implied by its own literal, and return these literals.

    Args:
        labels: labels of the motion's roadmaps.
        most_links: maximum number of links of routes; the number of agents covers all routes.

    Raises:
        TooLarge: the clauses would exceed their limit.
        Unexpressible: a predicate depends on too many agents at once.
    """
    formulas = Formulas(labels, motion, clauses, occupancy, most_links)
    origin = np.zeros(1, dtype=np.int64)
    asked = clauses.fresh(len(goals))
    with deep():
        found = [formulas.holds(goal.formula, origin, origin) for goal in goals]
    held = np.concatenate([*found, np.zeros(0, dtype=np.int32)])
    clauses.add(-asked, held)
    return Lowered(tuple(asked.tolist()), bool((held == FALSE).any()), formulas.places.routes.shortened)


class Formulas:
    """Literals for formulas about agents; a cell is a pair of agent and step, (cells,) each, and has one literal,
    (cells,)."""

    def __init__(self, labels: Labels, motion: Motion, clauses: Clauses, occupancy: Occupancy, most_links: int) -> None:
        self.motion, self.clauses = motion, clauses
        self.atoms = Atoms(labels, motion, clauses)
        self.places = Places(labels, occupancy, self, most_links)
        self.windows = Windows(self, motion.steps, clauses)
        self._tables: dict[Node, Literals] = {}
        self._of_team: dict[Node, bool] = {}

    def holds(self, node: Node, agents: Indices, steps: Indices) -> Literals:
        """For each cell, a literal that implies the formula: (cells,)."""
        match node:
            case At(agent, body):
                return self.holds(body, np.full_like(agents, agent), steps)
            case _ if self.of_team(node):
                agents = np.zeros_like(agents)
            case _:
                pass
        shape = (self.motion.agents, self.motion.steps + 1)
        if node not in self._tables:
            self._tables[node] = np.full(shape, NOTHING, dtype=np.int32)
        table = self._tables[node]
        missing = table[agents, steps] == NOTHING
        if missing.any():
            cells = np.unique(agents[missing] * shape[1] + steps[missing])
            agent_of, step_of = np.divmod(cells, shape[1])
            table[agent_of, step_of] = self._define(node, agent_of, step_of)
        return table[agents, steps]

    def of_team(self, node: Node) -> bool:
        """Return true if the truth of the node is the same for every agent."""
        if node not in self._of_team:
            self._of_team |= same_for_all((node,))
        return self._of_team[node]

    def _define(self, node: Node, agents: Indices, steps: Indices) -> Literals:
        if not self.of_team(node) and self.places.decides(node):
            return self._by_place(lambda agent, *cells: self.places.standing(node, agent, *cells), agents, steps)
        match node:
            case Atom(predicate):
                return self.atoms.holds(predicate, True, agents, steps)
            case Not(Atom(predicate)):
                return self.atoms.holds(predicate, False, agents, steps)
            case All(parts) | Any(parts):
                self._together(parts, agents, steps)
                asks = [self._ask(part, agents, steps) for part in cheap_first(parts)]
                return join(self.clauses, node.every, len(agents), asks)
            case AtLeast(count, parts):
                self._together(parts, agents, steps)
                asks = [self._ask(part, agents, steps) for part in parts]
                return at_least(self.clauses, count, asks)(np.arange(len(agents)))
            case WindowNode():
                return self.windows.window(node, agents, steps)
            case UntilNode():
                return self.windows.until(node, agents, steps)
            case ReachNode() | RouteNode():
                return self._reach(node, agents, steps)
            case LeafNode() | Not() | At() | NeighbourNode():
                raise AssertionError("these cases are handled above")
            case _:
                assert_never(node)

    def _ask(self, node: Node, agents: Indices, steps: Indices) -> Ask:
        return lambda rows: self.holds(node, agents[rows], steps[rows])

    def _together(self, parts: tuple[Node, ...], agents: Indices, steps: Indices) -> None:
        """Encode each formula that the parts evaluate for several agents, for all of those agents at once."""
        asked: dict[Node, list[int]] = defaultdict(list)
        for part in parts:
            if isinstance(part, At):
                asked[part.body].append(part.agent)
        moments = np.unique(steps)
        for body, members in asked.items():
            if len(members) > 1:
                self.holds(body, np.repeat(members, len(moments)), np.tile(moments, len(members)))

    def _reach(self, node: ReachNode | RouteNode, agents: Indices, steps: Indices) -> Literals:
        """Literals of routes with ends that the states do not decide: the agents at which routes start are named;
        (cells,)."""
        some = not node.every
        result = self.holds(node.end, agents, steps)
        rows = np.flatnonzero(np.isin(agents, node.graph.agents) & leads_on(node))
        agents, steps = agents[rows], steps[rows]

        def onward(rows: Indices) -> Literals:
            def beside(agent: int, *cells: Indices) -> Literals:
                return self.places.onward(node, agent, some, *cells)

            return self._by_place(beside, agents[rows], steps[rows])

        here, start = self._ask(node.end, agents, steps), self._ask(node.through, agents, steps)
        result[rows] = choose(self.clauses, some, len(rows), here, start, onward)
        return result

    def _by_place(self, ask: Callable[..., Literals], agents: Indices, steps: Indices) -> Literals:
        """For each cell, a literal that implies the condition ``ask`` on the agent's state: (cells,)."""
        result = np.full(len(agents), FALSE, dtype=np.int32)
        for agent in np.unique(agents).tolist():
            cells = np.flatnonzero(agents == agent)
            able = self.motion.ways[agent][steps[cells]]
            row, state = np.nonzero(able)
            asked = np.full(able.shape, TRUE, dtype=np.int32)
            asked[row, state] = ask(agent, steps[cells][row], state + self.motion.places_of(agent).start)
            result[cells] = self.atoms.where(self.motion.states[agent][steps[cells]], able, asked)
        return result


@contextmanager
def deep() -> Iterator[None]:
    """Context with a higher recursion limit, for deeply nested formulas."""
    deep = 20_000  # stack frames; formulas nest some hundreds deep, with a few frames per level
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, deep))
    try:
        yield
    finally:
        sys.setrecursionlimit(before)
