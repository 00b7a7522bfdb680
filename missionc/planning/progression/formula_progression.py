"""Formula progression: the goals of a mission after its first steps, for the remaining steps and agents.

    in   a mission, its kernel, the trace of its first steps, and the symbol map to the remaining mission
    out  each goal as a formula about the remaining mission

A goal is satisfied by the whole trace if and only if its progression is satisfied by the rest of the trace.

Source:
    Bacchus and Kabanza, "Using temporal logics to express search control knowledge for planning" (2000), section 4.1;
    here over all steps at once, with links, windows and past operators.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeAlias, assert_never

import numpy as np

from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Graph, Mission
from missionc.ir.kernel.evaluate import value_of
from missionc.ir.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    Is,
    Kernel,
    LeafNode,
    NeighbourNode,
    Node,
    Not,
    PathLength,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
)
from missionc.ir.kernel.normal_form import NO, YES, constant
from missionc.ir.kernel.walk import children, looks_back, postorder, rebuilt, same_objects
from missionc.ir.language.margins.links import all_links
from missionc.planning.progression.lattice import Lattice
from missionc.planning.progression.symbol_map import SymbolMap
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import TRUTH

Cell: TypeAlias = "tuple[Node, int, int]"
"""Formula, with the agent and the step at which it is evaluated."""

Look: TypeAlias = "Callable[[Node, int, int], Node | None]"
"""Function from a formula, agent and step to the equivalent formula at the remaining mission's first step."""

ASKED = Is(frozenset())
"""Placeholder for undecided formulas while dependencies are collected."""


class NotProgressableError(Exception):
    """Error for a goal whose progression needs routes at past steps through agents with undecided conditions.

    Args:
        node: the operator that needs the routes.
    """

    def __init__(self, node: Node) -> None:
        super().__init__("no formula says what is left of it")
        self.node = node


def progressed(mission: Mission, kernel: Kernel, trace: Trace, since: SymbolMap) -> list[Node | None]:
    """Progression of each goal, requirements first; None for a goal that only lost agents could satisfy.

    Args:
        trace: (agents, steps + 1): the states of the first steps, and the first state of the remaining mission.
        since: map to agents and symbols of the remaining mission.

    Raises:
        NotProgressableError: no formula expresses the rest of a goal.
    """
    roots = kernel.formulas
    return _Progression(mission, trace, since, postorder(roots)).of(roots)


class _Progression:
    """Progression of a mission's formulas: decided by bounds on their truth, or expanded if undecided.

    Args:
        order: every formula, children first.
    """

    def __init__(self, mission: Mission, trace: Trace, since: SymbolMap, order: list[Node]) -> None:
        self.mission, self.since, self.order = mission, since, order
        self.elapsed, self.last = trace.position.shape[1] - 1, int(mission.steps)
        self.position = trace.position
        self.lattice = Lattice()
        self.linked: dict[tuple[Graph, int], Array] = {}
        self.ways: dict[tuple[Node, int], tuple[Node | None, ...]] = {}
        self.least, self.most = self._bounds(_lasting(trace, self.last))
        self.until = self._explicit_steps()
        self.later: dict[Node, Node | None] = {}
        for node in order:
            self.later[node] = self._later(node)
        self.known: dict[Cell, Node | None] = {}

    def of(self, roots: Sequence[Node]) -> list[Node | None]:
        """Progressions of formulas about the team that are evaluated at the first step."""
        agent = next((each for each in range(len(self.mission.agents)) if self.since.agent(each) is not None), 0)
        asked: dict[Node, dict[Cell, None]] = {node: {} for node in self.order}

        def ask(node: Node, who: int, step: int) -> Node | None:
            asked[node].setdefault((node, who, step))
            return ASKED

        for root in roots:
            self._look(root, agent, 0, ask)
        collecting, self.lattice = self.lattice, Lattice()
        for node in reversed(self.order):
            for _, who, step in asked[node]:
                self._spelt(node, who, step, ask)
        self.lattice = collecting
        self.ways.clear()
        for node in self.order:
            for cell in asked[node]:
                self.known[cell] = self._spelt(*cell, self._recall)
        return [self._look(root, agent, 0, self._recall) for root in roots]

    def _recall(self, node: Node, agent: int, step: int) -> Node | None:
        return self.known[node, agent, step]

    # ------------------------------------------------------------------ certain cells

    def _bounds(self, trace: Trace) -> tuple[dict[Node, Flags], dict[Node, Flags]]:
        """Certain truth and possible truth of each formula after the first steps: (agents or 1, steps + 1), boolean
        each."""
        evaluation = Evaluation(TRUTH, self.mission, trace)
        least: dict[Node, Flags] = {}
        most: dict[Node, Flags] = {}
        for node in self.order:
            below = children(node)
            open_from = isinstance(node, LeafNode | Not | NeighbourNode | ReachNode | RouteNode)
            for bound, surely in ((least, True), (most, False)):
                value = value_of(node, [bound[child] for child in below], evaluation)
                spread = np.broadcast_to(value, (len(value), self.last + 1))
                if open_from:
                    spread = spread.copy()
                    spread[:, self.elapsed :] = not surely
                bound[node] = spread
        return least, most

    def _explicit_steps(self) -> dict[Node, int]:
        """For each formula, the first step from which the formula depends on the remaining mission only.

        At earlier steps the formula is expanded step by step.
        """
        until: dict[Node, int] = {}
        for node in self.order:
            until[node] = max((until[child] for child in children(node)), default=self.elapsed)
            if looks_back(node):
                assert isinstance(node, WindowNode | UntilNode)
                until[node] = min(until[node] - node.low, self.last + 1)
        return until

    # ------------------------------------------------------------------ the remaining steps

    def _later(self, node: Node) -> Node | None:
        """Equivalent of a formula in the remaining mission; None if it concerns lost agents only."""
        below = children(node)
        parts = [self.later[child] for child in below]
        match node:
            case Atom(predicate):
                found = self.since.atom(predicate, True)
                return self._worded(found, node)
            case Not(Atom(predicate)):
                return self._worded(self.since.atom(predicate, False), node)
            case Not(body):
                only = self.later[body]
                return None if only is None else node if only is body else Not(only, node.span)
            case Is(agents, span):
                left = frozenset(self.since.agents(agents))
                return node if left == agents else Is(left, span)
            case PathLength(graph, agent, low, high, span):
                new = self.since.agent(agent)
                return None if new is None else PathLength(self.since.graph(graph), new, low, high, span)
            case All() | Any():
                if same_objects(parts, below):
                    return node
                return self.lattice.whole(node, parts, quantified=_quantifies(node))
            case AtLeast():
                return node if same_objects(parts, below) else self.lattice.at_least(node, parts)
            case _ if None in parts:
                return None
            case At(agent):
                new = self.since.agent(agent)
                same = new == agent and same_objects(parts, below)
                return None if new is None else node if same else replace(node, agent=new, body=_there(parts[0]))
            case NeighbourNode(graph) | ReachNode(graph) | RouteNode(graph):
                now = self.since.graph(graph)
                if now is graph and same_objects(parts, below):
                    return node
                return rebuilt(node, tuple(map(_there, parts)), now)
            case _:
                return node if same_objects(parts, below) else rebuilt(node, tuple(map(_there, parts)))

    def _worded(self, found: Node | None, node: Node) -> Node | None:
        """Leaf of the remaining mission with the span of the original leaf; the original node if it is unchanged."""
        match found, node:
            case Atom(predicate), Atom(before) if predicate == before:
                return node
            case Not(Atom(predicate)), Not(Atom(before)) if predicate == before:
                return node
            case Atom() | Not() as leaf, _:
                return replace(leaf, span=node.span)
            case _:
                return found

    def _ahead(self, node: Node, agent: int, like: WindowNode | None, low: int, high: int | None) -> Node | None:
        """Formula about the remaining mission that ``node`` holds for an agent in a window of steps, with the operator
        of ``like``."""
        later, new = self.later[node], self.since.agent(agent)
        if later is None or (len(self.least[node]) > 1 and new is None):
            return None
        if like is None:
            low = high = low - self.elapsed
            found = later if not low or constant(later) is not None else Eventually(later, low, low, later.span)
        else:
            until = None if high is None else high - self.elapsed
            found = replace(like, body=later, low=low - self.elapsed, high=until)
        return found if len(self.least[node]) == 1 or new is None else At(new, found, found.span)

    # ------------------------------------------------------------------ single cells

    def _look(self, node: Node, agent: int, step: int, ask: Look) -> Node | None:
        """Progression of a cell: a constant if decided, a formula about the remaining mission, or the result of
        ``ask``."""
        row = agent if len(self.least[node]) > 1 else 0
        if self.least[node][row, step]:
            return YES
        if not self.most[node][row, step]:
            return NO
        if step >= self.until[node]:
            return self._ahead(node, agent, None, step, step)
        return ask(node, row, step)

    def _spelt(self, node: Node, agent: int, step: int, look: Look) -> Node | None:
        """Progression of an undecided cell, expanded from its children."""

        def cell(below: Node, who: int, when: int) -> Node | None:
            return self._look(below, who, when, look)

        match node:
            case All(parts) | Any(parts):
                return self.lattice.whole(
                    node, [cell(part, agent, step) for part in parts], quantified=_quantifies(node)
                )
            case AtLeast(_, parts):
                return self.lattice.at_least(node, [cell(part, agent, step) for part in parts])
            case At(other, body):
                return cell(body, other, step)
            case WindowNode():
                return self._window(node, agent, step, cell)
            case UntilNode(low=low) if low < 0:
                return self._since(node, agent, step, cell)
            case UntilNode():
                return self._until(node, agent, step, cell)
            case NeighbourNode() if step < self.elapsed:
                linked = self._links(node.graph, step)[node.graph.agents.index(agent)]
                members = [other for other, near in zip(node.graph.agents, linked, strict=True) if near]
                return self.lattice.whole(node, [cell(node.body, other, step) for other in members], quantified=True)
            case ReachNode() if step < self.elapsed:
                return self._reach(node, agent, step, cell)
            case NeighbourNode() | ReachNode() | RouteNode():
                raise NotProgressableError(node)
            case LeafNode() | Not():
                raise AssertionError("leaves are decided at steps that are over")
            case _:
                assert_never(node)

    def _window(self, node: WindowNode, agent: int, step: int, cell: Look) -> Node | None:
        low, high = max(step + node.low, 0), self.last if node.high is None else step + node.high
        spelt = self.until[node.body]
        parts = [cell(node.body, agent, when) for when in range(low, min(high, spelt - 1) + 1)]
        if high >= spelt:
            to_end = None if node.high is None else high
            parts.append(self._ahead(node.body, agent, node, max(low, spelt), to_end))
        return self.lattice.whole(node, parts)

    def _until(self, node: UntilNode, agent: int, step: int, cell: Look) -> Node | None:
        """Progression of ``until``, built from the window's last step backwards."""
        low, high = step + node.low, self.last if node.high is None else step + node.high
        spelt = max(self.until[node.hold], self.until[node.end])
        found: Node | None = YES if node.every else NO
        if high >= spelt:
            found = self._until_ahead(node, agent, spelt, max(low, spelt), None if node.high is None else high)
        for when in range(min(high, spelt - 1), step - 1, -1):
            found = self._onward(node, cell, agent, when, low <= when <= high, found)
        return found

    def _since(self, node: UntilNode, agent: int, step: int, cell: Look) -> Node | None:
        """Progression of ``since``, built from the window's first step forwards."""
        assert node.high is not None
        low, high = max(step + node.low, 0), step + node.high
        found: Node | None = YES if node.every else NO
        for when in range(low, step + 1):
            found = self._onward(node, cell, agent, when, when <= high, found)
        return found

    def _onward(
        self, node: UntilNode, cell: Look, agent: int, when: int, in_window: bool, found: Node | None
    ) -> Node | None:
        """Formula ``end or (hold and found)`` at step ``when`` (without ``end`` outside the window), or its dual."""
        one, other = (YES, NO) if node.every else (NO, YES)
        held = self.lattice.whole(replace(other, span=node.span), [cell(node.hold, agent, when), found])
        parts = [cell(node.end, agent, when), held] if in_window else [held]
        return self.lattice.whole(replace(one, span=node.span), parts)

    def _until_ahead(self, node: UntilNode, agent: int, at: int, low: int, high: int | None) -> Node | None:
        hold, end, new = self.later[node.hold], self.later[node.end], self.since.agent(agent)
        of_one = len(self.least[node.hold]) > 1 or len(self.least[node.end]) > 1
        if hold is None or end is None or (of_one and new is None):
            return None
        until: Node = replace(node, hold=hold, end=end, low=low - at, high=None if high is None else high - at)
        ahead = at - self.elapsed
        found = Eventually(until, ahead, ahead, node.span) if ahead else until
        return At(new, found, node.span) if of_one and new is not None else found

    def _links(self, graph: Graph, step: int) -> Array:
        """Linked pairs of a graph's members at a step: (members, members), boolean; margins are in metres."""
        if (graph, step) not in self.linked:
            self.linked[graph, step] = all_links(graph, self.position[:, step : step + 1])[0] > 0
        return self.linked[graph, step]

    def _reach(self, node: ReachNode, agent: int, step: int, cell: Look) -> Node | None:
        """Progression of ``Reach`` for an agent, from routes with an increasing number of links for all members at
        once."""
        members = node.graph.agents
        if agent not in members:
            return cell(node.end, agent, step)
        if (node, step) not in self.ways:
            self.ways[node, step] = self._routes(node, step, cell)
        return self.ways[node, step][members.index(agent)]

    def _routes(self, node: ReachNode, step: int, cell: Look) -> tuple[Node | None, ...]:
        members, links = node.graph.agents, self._links(node.graph, step)
        one, other = (YES, NO) if node.every else (NO, YES)
        through = [cell(node.through, each, step) for each in members]
        ends = best = tuple(cell(node.end, each, step) for each in members)
        for _ in range(min(node.hops, len(members) - 1)):
            onward = []
            for index in range(len(members)):
                near = [best[next_] for next_ in np.flatnonzero(links[index]).tolist()]
                beyond = self.lattice.whole(one, near, quantified=True)
                further = self.lattice.whole(other, [through[index], beyond])
                onward.append(self.lattice.whole(one, [ends[index], further], quantified=True))
            if same_objects(onward, best):
                break
            best = tuple(onward)
        return best


def _quantifies(node: All | Any) -> bool:
    """Return true if every part is about one indexed agent, as in an expanded quantifier."""
    return all(isinstance(part, At) for part in node.parts)


def _there(part: Node | None) -> Node:
    assert part is not None, "what is about nobody was passed over before"
    return part


def _lasting(trace: Trace, last: int) -> Trace:
    """Trace extended by its last state up to step ``last``; the added states are placeholders."""
    steps = np.minimum(np.arange(last + 1), trace.position.shape[1] - 1)
    return Trace(trace.step, trace.position[:, steps], trace.velocity[:, steps], trace.heading[:, steps])
