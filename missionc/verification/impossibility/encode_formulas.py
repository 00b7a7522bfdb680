"""Clauses for motion over cells and for formulas: variables for positions, literals for possible formulas.

    in   the kernel's goals, ClaimedCover, the last step, labels of leaves
    out  clauses

A variable states that an agent is in a cell at a step, and clauses state the cover's exclusions. The literal of a
formula, agent and step implies that the formula may hold there. The encoding follows from the meaning of each operator,
and is independent of the search for plans. A leaf that cells do not determine, such as a heading or a resource, may
hold and may fail.

Source:
    [strel] Definitions 4 and 5, with "may hold" in place of "holds".
"""

from __future__ import annotations

import math
import sys
from collections.abc import Hashable, Sequence
from itertools import combinations, product
from typing import Protocol, assert_never

import numpy as np
from numpy.typing import NDArray

from missionc.base.trace import Flags
from missionc.ir import BeaconCover, Compare, DistanceBetween, Flag, Flagged, Graph, Inside, Mission, Predicate
from missionc.ir.couplings import all_ranges
from missionc.ir.kernel import nodes as k
from missionc.verification.certificate import MOTION
from missionc.verification.impossibility.cnf import FALSE, TRUE, Cnf
from missionc.verification.impossibility.cover_document import CellsOfKind, ClaimedCover

States = NDArray[np.int64]
"""Literals that an agent is in a cell at a step, (steps + 1, cells); FALSE for impossible cells."""

FEW = 4
"""Maximum number of excluded cells that get one clause each; for more, one clause lists the remaining cells."""


def encode_motion(cover: ClaimedCover, cnf: Cnf) -> dict[int, States]:
    """Add clauses that each agent is in one cell at each step and never makes an excluded move.

    Returns:
        For each agent of the cover, the literals of its cells, (steps + 1, cells).
    """
    states: dict[int, States] = {}
    for agent in cover.asked:
        absent, kind = cover.absent[agent], cover.kind_of(agent)
        own = np.full(absent.shape, FALSE, dtype=np.int64)
        own[~absent] = [cnf.fresh() for _ in range(int((~absent).sum()))]
        for row in own:
            cnf.add(row.tolist())
            cnf.at_most_one(row.tolist())
        for steps, never in sorted(kind.no_move.items()):
            for step in range(len(own) - steps):
                add_support(cnf, own[step], own[step + steps], ~never)
                if steps == 1:
                    add_support(cnf, own[step + steps], own[step], ~never.T)
        for steps, never in sorted(kind.no_turn.items()):
            _add_turns(cnf, own, steps, ~never)
        states[agent] = own
    for agent, never in cover.not_both.items():
        if agent in states:
            _add_visits(cnf, states[agent], never)
    if cover.apart:
        for (first, second), never in cover.not_together.items():
            if first in states and second in states:
                for one, other in zip(states[first], states[second], strict=True):
                    add_support(cnf, one, other, ~never)
        _add_rooms(cnf, cover, states)
    return states


def add_support(cnf: Cnf, here: States, there: States, fits: Flags, condition: int = FALSE) -> None:
    """Add clauses that if the first agent is in a cell, the second is in a compatible cell, unless the condition holds.

    Args:
        here, there: literals of the cells of the first and of the second, (cells,) each.
        fits: compatible cells, (cells, cells), boolean.
        condition: literal that disables the clauses.
    """
    columns = np.flatnonzero(there != FALSE)
    for row in np.flatnonzero(here != FALSE).tolist():
        able = fits[row, columns]
        if able.all():
            continue
        ruled_out = columns[~able]
        if len(ruled_out) <= FEW:
            for column in ruled_out.tolist():
                cnf.add((condition, -int(here[row]), -int(there[column])))
        else:
            cnf.add((condition, -int(here[row]), *there[columns[able]].tolist()))


def _add_turns(cnf: Cnf, own: States, steps: int, fits: NDArray[np.bool_]) -> None:
    for step in range(steps, len(own) - steps):
        for cell in np.flatnonzero(own[step - steps] != FALSE).tolist():
            add_support(cnf, own[step], own[step + steps], fits[cell], -int(own[step - steps, cell]))


def _add_visits(cnf: Cnf, own: States, never: Flags) -> None:
    """Add clauses that an agent never visits both cells of an excluded pair."""
    wanted = np.flatnonzero(never.any(axis=0) | never.any(axis=1))
    ever = {}
    for cell in wanted.tolist():
        ever[cell] = cnf.fresh()
        for literal in own[:, cell].tolist():
            cnf.add((-literal, ever[cell]))
    for first, second in np.argwhere(never | never.T).tolist():
        if first <= second:
            cnf.add((-ever[first], -ever[second]))


def _add_rooms(cnf: Cnf, cover: ClaimedCover, states: dict[int, States]) -> None:
    for low, high, most in cover.at_most:
        inside: list[list[int]] = []
        for agent, own in states.items():
            kind = cover.kind_of(agent)
            within = within_box(kind, low, high)
            inside.append([_seen(cnf, row[within].tolist()) for row in own])
        for at_once in zip(*inside, strict=True):
            for chosen in combinations(at_once, most + 1):
                cnf.add(-literal for literal in chosen)


def within_box(kind: CellsOfKind, low: NDArray[np.float64], high: NDArray[np.float64]) -> Flags:
    """Flags of cells within a box from ``low`` to ``high``, (dim,), metres: (cells,), boolean."""
    inside: Flags = np.all((kind.boxes[0] >= low) & (kind.boxes[1] <= high), axis=1)
    return inside


def _seen(cnf: Cnf, literals: Sequence[int]) -> int:
    """A literal that each of the given literals implies."""
    able = [literal for literal in literals if literal != FALSE]
    if len(able) < 2:
        return able[0] if able else FALSE
    name = cnf.fresh()
    for literal in able:
        cnf.add((-literal, name))
    return name


DEEP = 20_000
"""Recursion limit: formulas nest some hundreds deep, with a few frames per level."""

Never = tuple[Flags, Flags]
"""Flags of cells in which a leaf of a formula never holds, and of cells in which it never fails."""


class Labels(Protocol):
    """Cells of agents in which leaves of a formula never hold, and in which they never fail."""

    def own(self, predicate: Predicate, agent: int) -> Never:
        """Cells of one agent in which the predicate never holds, and never fails: (cells,) each."""

    def moves(self, predicate: Predicate, agent: int) -> Never:
        """Moves of one agent, from its cell at a step to its next cell, in which the predicate never holds, and never
        fails.

        Shape: (cells, cells) each.
        """

    def pair(self, predicate: Predicate, first: int, second: int) -> Never:
        """Cells of two agents in which the predicate of the first never holds, and never fails: (cells, cells) each."""

    def link(self, graph: Graph, sender: int, receiver: int) -> Never:
        """Cells of sender and receiver in which the link never exists, and is never missing: (cells, cells) each."""


def refutation(mission: Mission, goals: tuple[k.Goal, ...], cover: ClaimedCover, labels: Labels) -> Cnf:
    """Clauses that every motion satisfying the goals satisfies; if they are unsatisfiable, no such motion exists."""
    cnf = Cnf()
    formulas = _Formulas(mission, encode_motion(cover, cnf), cnf, labels)
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, DEEP))
    try:
        for goal in goals:
            cnf.add((formulas.holds(goal.formula, 0, 0),))
    finally:
        sys.setrecursionlimit(before)
    return cnf


class _Formulas:
    def __init__(self, mission: Mission, states: dict[int, States], cnf: Cnf, labels: Labels) -> None:
        self.mission, self.last, self.states = mission, mission.steps, states
        self.cnf, self.labels = cnf, labels
        self._known: dict[Hashable, int] = {}

    def holds(self, node: k.Node, agent: int, step: int) -> int:
        """A literal that implies that the formula may hold for an agent at a step."""
        key = node, agent, step
        if key not in self._known:
            self._known[key] = self._define(node, agent, step)
        return self._known[key]

    def _define(self, node: k.Node, agent: int, step: int) -> int:
        match node:
            case k.Atom(predicate):
                return self._atom(predicate, True, agent, step)
            case k.Not(k.Atom(predicate)):
                return self._atom(predicate, False, agent, step)
            case k.Is(agents):
                return TRUE if agent in agents else FALSE
            case k.Not(k.Is(agents)):
                return FALSE if agent in agents else TRUE
            case k.PathLength() | k.Not():
                return TRUE
            case k.All(parts):
                return self.cnf.all_of(self.holds(part, agent, step) for part in parts)
            case k.Any(parts):
                return self.cnf.any_of(self.holds(part, agent, step) for part in parts)
            case k.AtLeast(count, parts):
                return self.cnf.at_least(count, [self.holds(part, agent, step) for part in parts])
            case k.At(other, body):
                return self.holds(body, other, step)
            case k.WindowNode(body):
                return self._window(node, body, agent, step)
            case k.UntilNode():
                return self._until(node, agent, step)
            case k.NeighbourNode(graph, body):
                return self._neighbour(graph, body, node.every, agent, step)
            case k.ReachNode():
                return self._route(node, node.hops, math.inf, agent, step)
            case k.RouteNode():
                return TRUE if node.every else self._route(node, len(node.graph.agents), node.high, agent, step)
            case _:
                assert_never(node)

    # ---------------------------------------------------------------- time

    def _steps(self, low: int, high: int | None, step: int) -> range | None:
        """Steps of a window; None if it runs past the last step, where no truth is known."""
        final = self.last if high is None else step + high
        if final > self.last or (low >= 0 and step + low > final):
            return None
        return range(max(step + low, 0), final + 1)

    def _window(self, node: k.WindowNode, body: k.Node, agent: int, step: int) -> int:
        steps = self._steps(node.low, node.high, step)
        if steps is None:
            return TRUE
        join = self.cnf.all_of if node.every else self.cnf.any_of
        return join(self.holds(body, agent, each) for each in steps)

    def _until(self, node: k.UntilNode, agent: int, step: int) -> int:
        steps = self._steps(node.low, node.high, step)
        if steps is None:
            return TRUE
        cnf = self.cnf
        inner, outer = (cnf.any_of, cnf.all_of) if node.every else (cnf.all_of, cnf.any_of)
        cases = []
        for end in steps:
            held = self._held(node, agent, step, end)
            cases.append(inner((self.holds(node.end, agent, end), held)))
        return outer(cases)

    def _held(self, node: k.UntilNode, agent: int, step: int, end: int) -> int:
        """Literal that ``hold`` may be true at every step from ``step`` to ``end``, excluded, in either direction of
        time.

        For universal nodes (``every``), it may be true at some of these steps.
        """
        join = self.cnf.any_of if node.every else self.cnf.all_of
        result = FALSE if node.every else TRUE
        way = range(step, end) if end >= step else range(step, end, -1)
        for each in way:
            key = "held", node, agent, step, each
            if key not in self._known:
                self._known[key] = join((result, self.holds(node.hold, agent, each)))
            result = self._known[key]
        return result

    # --------------------------------------------------------------- space

    def _neighbour(self, graph: Graph, body: k.Node, every: bool, agent: int, step: int) -> int:
        if agent not in graph.agents:
            return TRUE if every else FALSE
        inner, outer = (self.cnf.any_of, self.cnf.all_of) if every else (self.cnf.all_of, self.cnf.any_of)
        return outer(
            inner((self._link(graph, agent, other, not every, step), self.holds(body, other, step)))
            for other in graph.agents
            if other != agent
        )

    def _route(self, node: k.ReachNode | k.RouteNode, hops: int, metres: float, agent: int, step: int) -> int:
        """Literal that a route of bounded length may exist.

        Its end is no further than ``hops`` longest links, or ``metres``.
        """
        graph = node.graph
        hops = min(hops, max(len(graph.agents) - 1, 0))
        leads = self._reach(node, hops, agent, step)
        if not isinstance(graph, BeaconCover):
            metres = min(metres, hops * float(max(all_ranges(graph), default=0.0)))
        if node.every or hops < 2 or agent not in graph.agents or math.isinf(metres):
            return leads
        ends = [self.holds(node.end, agent, step)]
        for other in graph.agents:
            if other != agent:
                near = Compare(((-1.0, DistanceBetween(*sorted((agent, other)))),), metres + MOTION, False)
                ends.append(self.cnf.all_of((self.holds(node.end, other, step), self._leaf(near, True, agent, step))))
        return self.cnf.all_of((leads, self.cnf.any_of(ends)))

    def _reach(self, node: k.ReachNode | k.RouteNode, hops: int, agent: int, step: int) -> int:
        """Literal that a route of at most ``hops`` links over ``through`` to ``end`` may exist.

        For universal nodes, the dual.
        """
        key = "reach", node, hops, agent, step
        if key not in self._known:
            on_way = node.graph.agents if agent in node.graph.agents else ()
            for fewer, other in product(range(hops), on_way):
                shorter = "reach", node, fewer, other, step
                if shorter not in self._known:
                    self._known[shorter] = self._define_reach(node, fewer, other, step)
            self._known[key] = self._define_reach(node, hops, agent, step)
        return self._known[key]

    def _define_reach(self, node: k.ReachNode | k.RouteNode, hops: int, agent: int, step: int) -> int:
        here = self.holds(node.end, agent, step)
        if hops == 0 or agent not in node.graph.agents:
            return here
        every = node.every
        inner, outer = (self.cnf.any_of, self.cnf.all_of) if every else (self.cnf.all_of, self.cnf.any_of)
        onward = outer(
            inner((self._link(node.graph, agent, other, not every, step), self._reach(node, hops - 1, other, step)))
            for other in node.graph.agents
            if other != agent
        )
        return outer((here, inner((self.holds(node.through, agent, step), onward))))

    # -------------------------------------------------------------- leaves

    def _atom(self, predicate: Predicate, truth: bool, agent: int, step: int) -> int:
        """Literal that an atom may hold, or with ``truth`` False may fail.

        A predicate with parts is split into them.
        """
        if isinstance(predicate, Flagged):
            return self._flag(predicate.flag, truth, agent, step)
        if predicate.reads_past or predicate.reads_heading or predicate.graph is not None:
            return TRUE
        parts = predicate.parts
        if parts == (predicate,):
            return self._leaf(predicate, truth, agent, step)
        join = self.cnf.all_of if truth else self.cnf.any_of
        return join(self._leaf(part, truth, part.pairs[0][0], step) for part in parts)

    def _leaf(self, predicate: Predicate, truth: bool, agent: int, step: int) -> int:
        predicate = predicate.asked_of(agent)
        own = predicate.reads_oneself(self.mission.dimension)
        match sorted(predicate.others - {agent}):
            case []:
                agents: tuple[int, ...] = (agent,)
            case [other]:
                agents = agent, other
            case [first, second] if not own and agent not in predicate.others:
                agents = first, second
            case _:
                return TRUE
        if not self.states.keys() >= set(agents):
            return TRUE
        if predicate.reads_speed:
            if len(agents) > 1 or self.mission.agents[agent].dynamics.has_momentum or self.last == 0:
                return TRUE
            begin = min(step, self.last - 1)  # at the last step the last motion counts
            if begin < step and not predicate.is_of_speed:
                return TRUE
            here, there = self.states[agent][begin], self.states[agent][begin + 1]
            return self._truth((predicate, agents), truth, step, here, there, self.labels.moves(predicate, agent))
        if len(agents) == 1:
            here = self.states[agent][step]
            return self._truth_of_one((predicate, agents), truth, step, here, self.labels.own(predicate, agent))
        here, there = (self.states[each][step] for each in agents)
        return self._truth((predicate, agents), truth, step, here, there, self.labels.pair(predicate, *agents))

    def _link(self, graph: Graph, sender: int, receiver: int, holds: bool, step: int) -> int:
        if not self.states.keys() >= {sender, receiver}:
            return TRUE
        here, there = self.states[sender][step], self.states[receiver][step]
        return self._truth(
            (graph, sender, receiver), holds, step, here, there, self.labels.link(graph, sender, receiver)
        )

    def _truth(self, leaf: Hashable, truth: bool, step: int, here: States, there: States, never: Never) -> int:
        """Literal that a leaf may hold, or fail, given the cells of two agents, or of one agent at two steps."""
        name, asked = self._name(leaf, truth, step)
        if not asked:
            add_support(self.cnf, here, there, ~never[0 if truth else 1], -name)
        return name

    def _truth_of_one(self, leaf: Hashable, truth: bool, step: int, here: States, never: Never) -> int:
        able = here != FALSE
        if never[1 if truth else 0][able].all():
            return TRUE
        if never[0 if truth else 1][able].all():
            return FALSE
        name, asked = self._name(leaf, truth, step)
        if not asked:
            for literal in here[able & never[0 if truth else 1]].tolist():
                self.cnf.add((-name, -literal))
        return name

    def _name(self, leaf: Hashable, truth: bool, step: int) -> tuple[int, bool]:
        """Literal that a leaf holds, or fails, at a step, and True if the literal was requested before."""
        key = "leaf", leaf, step
        if key not in self._known:
            self._known[key] = self.cnf.fresh()
        name = self._known[key] if truth else -self._known[key]
        asked = ("asked", leaf, step, truth) in self._known
        self._known["asked", leaf, step, truth] = name
        return name, asked

    def _flag(self, flag: Flag, truth: bool, agent: int, step: int) -> int:
        """Literal that a flag may be set, or clear: set in the setting region, kept until the clearing region."""
        if agent not in flag.agents:
            return FALSE if truth else TRUE
        key = "flag", flag, truth, agent
        if (*key, step) not in self._known:
            first = step
            while first > 0 and (*key, first - 1) not in self._known:
                first -= 1
            for each in range(first, step + 1):
                self._known[*key, each] = self._flag_at(flag, truth, agent, each)
        return self._known[*key, step]

    def _flag_at(self, flag: Flag, truth: bool, agent: int, step: int) -> int:
        sets = self._leaf(Inside(flag.set_in, body=False), truth, agent, step)
        if step == 0:
            return sets
        before = self._known["flag", flag, truth, agent, step - 1]
        kept = TRUE if truth else FALSE
        if flag.cleared_in is not None:
            kept = self._leaf(Inside(flag.cleared_in, body=False), not truth, agent, step)
        both, either = (self.cnf.all_of, self.cnf.any_of) if truth else (self.cnf.any_of, self.cnf.all_of)
        return either((sets, both((before, kept))))
