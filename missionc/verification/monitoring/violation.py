"""Violations of a formula: the step at which it becomes irrevocably false, and the agents concerned.

Witnesses: the agents and links that make a formula true or false at each step.

in   a formula, the truth of all its subformulas
out  Witness

A true *or* is followed to its first true part, a false *and* to all its false parts. A route is the route with the
fewest links, or the shortest route if bounded in metres. Windows are skipped: the witness at a step shows the truth at
that step.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Graph, Mission, Predicate
from missionc.ir.couplings import directed
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, NeighbourNode, Node, PathLength, ReachNode, RouteNode
from missionc.ir.kernel.walk import asks, children, looks_back, postorder
from missionc.ir.language.margins.links import all_links, link_pieces
from missionc.ir.language.margins.predicate_margins import formation_margin
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import TRUTH, Values
from missionc.verification.monitoring.verdict_table import asked_where, chain


class Decision(Record):
    """Step at which a verdict becomes final, and the agents (mission indices) concerned."""

    step: int
    agents: frozenset[int]


def first_violation(formula: k.Node, mission: Mission, trace: Trace) -> Decision:
    """Step after which no continuation can make a formula true that is false at step 0, and the agents concerned.

    An *always* is violated at the first step that violates its body, an *eventually* at the last step of its window.
    For a spatial operator, the operands decide the step, but the reported agent is the evaluated agent.
    """
    hopeful = _Hopeful(mission, trace)
    step = bisect_left(
        range(trace.position.shape[1] - 1), True, key=lambda now: not hopeful.after(now, (formula,))[formula][0, 0]
    )
    return Decision(step, _AgentSearch(hopeful.after(step, postorder((formula,))), mission, trace).agents(formula))


class _Hopeful(Evaluation):
    """Evaluation of truth that assumes every leaf and link to become favourable after some step, if it can still
    change.

    In negation normal form, truth is monotone in the leaves: a formula that is false here stays false.
    """

    def __init__(self, mission: Mission, trace: Trace) -> None:
        super().__init__(TRUTH, mission, trace)
        self.hopeful = np.zeros(self.steps, dtype=np.bool_)

    def after(self, now: int, formulas: Iterable[k.Node]) -> dict[k.Node, Values]:
        """Truth of the formulas if the assumption applies after the step ``now``."""
        self.hopeful = np.arange(self.steps) > now
        return self.values(formulas)

    def atom(self, predicate: Predicate, holds: bool) -> Values:
        found = super().atom(predicate, holds)
        changes = predicate.others or predicate.reads_past or predicate.reads_oneself(self.mission.dimension)
        return found | self.hopeful if changes else found

    def path_length(self, node: k.PathLength, holds: bool) -> Values:
        return super().path_length(node, holds) | self.hopeful

    def neighbour(self, node: k.NeighbourNode, body: Values) -> Values:
        return super().neighbour(node, body) | self.hopeful

    def reach(self, node: k.ReachNode, through: Values, end: Values) -> Values:
        return super().reach(node, through, end) | self.hopeful

    def route(self, node: k.RouteNode, through: Values, end: Values) -> Values:
        return super().route(node, through, end) | self.hopeful


class _AgentSearch:
    """Search from a false formula down to the agents that violate it."""

    def __init__(self, truths: dict[k.Node, Flags], mission: Mission, trace: Trace) -> None:
        self.truths, self.mission, self.trace = truths, mission, trace
        self.last = trace.position.shape[1] - 1

    def agents(self, formula: k.Node) -> frozenset[int]:
        """Agents of all violated subformulas of a formula that is false for the first agent at step 0."""
        found: set[int] = set()
        asked: dict[tuple[k.Node, int, int], None] = {(formula, 0, 0): None}
        waiting = list(asked)
        while waiting:
            node, agent, step = waiting.pop()
            below = self._below(node, agent, step)
            if below is None:
                found |= self._agents_of(node, agent, step) if isinstance(node, k.Atom) else {agent}
                continue
            fresh = [each for each in below if each not in asked]
            asked.update(dict.fromkeys(fresh))
            waiting += fresh
        return frozenset(found)

    def is_lost(self, node: k.Node, agent: int, step: int) -> bool:
        values = self.truths[node]
        return not values[agent if len(values) > 1 else 0, step if values.shape[1] > 1 else 0]

    def _below(self, node: k.Node, agent: int, step: int) -> list[tuple[k.Node, int, int]] | None:
        """Violated children of a false formula, each with its agent and step.

        None if the formula itself is violated.
        """
        match node:
            case k.Not(body) if isinstance(body, k.Atom):
                return [(body, agent, step)]
            case k.At(other, body):
                return [(body, other, step)]
            case k.All(parts) | k.Any(parts) | k.AtLeast(_, parts):
                return [(part, agent, step) for part in parts if self.is_lost(part, agent, step)]
            case k.WindowNode() | k.UntilNode():
                return self._in_time(node, agent, step)
            case _:
                return None

    def _in_time(self, node: k.WindowNode | k.UntilNode, agent: int, step: int) -> list[tuple[k.Node, int, int]] | None:
        """The violated child of a temporal operator, with its agent and step.

        If one failing step suffices, it is the first of the window, or an earlier step that violates the hold
        condition. If all steps of the window must fail, it is the last. For past windows the order is reversed.
        """
        *holds, end = children(node)
        window = asks(node)[-1].steps_from(step, self.last)
        if not window:
            return None
        steps, before = window, range(step, self.last)
        if looks_back(node):
            steps, before = window[::-1], range(step, window[0], -1)
        if node.every:
            return [(end, agent, next(now for now in steps if self.is_lost(end, agent, now)))]
        for hold in holds:
            for now in before:
                if self.is_lost(hold, agent, now):
                    return [(hold, agent, now)]
        return [(end, agent, steps[-1])]

    def _agents_of(self, atom: k.Atom, agent: int, step: int) -> frozenset[int]:
        formation = atom.predicate.formation
        if formation is None:
            named = frozenset(end for pair in atom.predicate.pairs for end in pair)
            return named or frozenset((agent,))
        position = self.trace.position[:, step]
        margins = {
            edge: float(formation_margin(formation, edge, position[edge.first], position[edge.second]))
            for edge in formation.edges
        }
        worst = min(margins.values(), default=0.0)
        broken = [edge for edge, margin in margins.items() if margin < 0 or margin == worst]
        return frozenset(end for edge in broken for end in (edge.first, edge.second))


MOST_NODES, MOST_LINKS = 5000, 1 << 25
"""Maximum numbers of kernel nodes, and of pairs of agents over all steps; above them there is no witness, to save
memory.
"""


class Witness(Record, eq=False):
    """Agents, links and formations that make a formula true or false at each step.

    Args:
        holds, fails: (agents, steps + 1): agents that a true, or a false, formula depends on.
        links: links of the routes of true formulas: (number, 3), step and the mission indices of both ends, from
            and to for directed links.
        formations: names of its formations.
    """

    holds: Flags
    fails: Flags
    links: Values
    formations: tuple[str, ...]


class Witnesses:
    """Computes the witnesses of the formulas below some goals, along one trace."""

    def __init__(self, goals: Iterable[Node], mission: Mission, trace: Trace, opposites: Mapping[Node, Node]) -> None:
        """Prepare the truth of all formulas below the goals.

        Args:
            opposites: for formulas whose negation is below a goal, that negation.
        """
        self.mission, self.trace = mission, trace
        self.shape = trace.position.shape[:2]
        roots = tuple(goals)
        self.order = postorder((*roots, *opposites))
        self.truths: Mapping[Node, Values] = {}
        self.asked: Mapping[Node, Flags] = {}
        agents, steps = self.shape
        if len(self.order) <= MOST_NODES and agents * agents * steps <= MOST_LINKS:
            self.truths = Evaluation(TRUTH, mission, trace).values(self.order)
            self.asked = asked_where(roots, frozenset(self.order), trace, opposites)
        self.linked: dict[Graph, Flags] = {}
        self.onward: dict[Node, Values] = {}

    def of(self, node: Node, unfolds: bool) -> Witness | None:
        """Witness of a formula where it is evaluated; None if formulas are too large, or it is below no goal.

        Args:
            unfolds: True if its verdict is for step 0 only, so that the witness uses its parts at each step.
        """
        if node not in self.truths:
            return None
        search = _Search(self)
        search.follow(node, unfolds)
        links = np.unique(np.concatenate(search.links), axis=0) if search.links else np.zeros((0, 3), dtype=np.int64)
        return Witness(search.lit[0], search.lit[1], links, tuple(dict.fromkeys(search.formations)))

    def truth(self, node: Node) -> Flags:
        """Truth of a formula for each agent and step: (agents, steps + 1), boolean."""
        return np.broadcast_to(self.truths[node], self.shape)

    def links(self, graph: Graph) -> Flags:
        """Flags of the links of a graph: (steps + 1, agents, agents), boolean."""
        if graph not in self.linked:
            agents, steps = self.shape
            whole = np.zeros((steps, agents, agents), dtype=np.bool_)
            members = np.array(graph.agents, dtype=np.int64)
            for piece in link_pieces(steps, len(members)) if len(members) else ():
                whole[np.ix_(np.arange(steps)[piece], members, members)] = (
                    all_links(graph, self.trace.position[:, piece]) > 0
                )
            self.linked[graph] = whole
        return self.linked[graph]

    def next_hops(self, node: ReachNode | RouteNode) -> Values:
        """Next agent on each agent's best route: (steps + 1, agents), -1 at the end of a route or without a route.

        For the dual operator, the route is the best of the forbidden routes.
        """
        if node not in self.onward:
            sought = not node.every
            through, end = (np.equal(self.truth(part).T, sought) for part in (node.through, node.end))
            links = self.links(node.graph) & through[:, :, None]
            position = self.trace.position.swapaxes(0, 1)
            lengths: Array = np.where(links, 1.0, np.inf)
            if isinstance(node, RouteNode):
                lengths = np.where(links, distance_between(np, position[:, :, None], position[:, None, :]), np.inf)
            best = np.where(end, 0.0, np.inf)
            while True:
                ways = lengths + best[:, None, :]
                better = np.minimum(best, ways.min(axis=2))
                if np.array_equal(better, best):
                    break
                best = better
            self.onward[node] = np.where((best > 0) & np.isfinite(best), ways.argmin(axis=2), -1)
        return self.onward[node]


class _Search:
    """Search for a witness, which passes masks from a formula to the parts that decide it.

    Masks have shape (2, agents, steps + 1): agents and steps at which a part matters by its truth, and by its falsity.
    """

    def __init__(self, known: Witnesses) -> None:
        self.known = known
        self.lit = np.zeros((2, *known.shape), dtype=np.bool_)
        self.links: list[Values] = []
        self.formations: list[str] = []
        self.open: dict[Node, Flags] = {}
        self.entered: dict[Node, Flags] = {}
        self.looked_through: set[Node] = set()

    def follow(self, root: Node, unfolds: bool) -> None:
        self.looked_through = set(chain((root,))) if unfolds else set()
        begin = self.open if root in self.looked_through else self.entered
        begin[root] = np.ones((2, *self.known.shape), dtype=np.bool_)
        for node in reversed(postorder((root,))):
            mask, entered = self.open.pop(node, None), self.entered.pop(node, None)
            if mask is not None and node in self.looked_through:
                self.hand_down(node, mask, self.entered)
                continue
            if entered is not None:
                truth = self.known.truth(node)
                entered = entered & self.known.asked[node] & np.stack([truth, ~truth])
                mask = entered if mask is None else mask | entered
            if mask is not None:
                self.decide(node, mask)

    def hand_down(self, node: Node, mask: Flags, entered: dict[Node, Flags] | None = None) -> None:
        """Add the agents and steps to visit below a node.

        ``entered`` collects those of the children of skipped nodes.
        """
        there = mask
        if isinstance(node, At):
            there = np.zeros_like(mask)
            there[:, node.agent] = mask.any(axis=1)
        for child in children(node):
            self.ask(child, there, self.open if entered is None or child in self.looked_through else entered)

    def ask(self, node: Node, mask: Flags, open_: dict[Node, Flags] | None = None) -> None:
        open_ = self.open if open_ is None else open_
        if mask.any():
            open_[node] = open_[node] | mask if node in open_ else mask

    def decide(self, node: Node, mask: Flags) -> None:
        truth = self.known.truth(node)
        match node:
            case All(parts) | Any(parts) if isinstance(node, Any) is not node.dual:
                # An *or* of the text, possibly negated: one of its true parts suffices.
                true = isinstance(node, Any)
                enough = truth == true
                rest = mask & enough
                for part in parts:
                    decides = self.known.truth(part) == true
                    self.ask(part, (rest & decides) | (mask & ~enough))
                    rest = rest & ~decides
            case All(parts) | Any(parts) | AtLeast(_, parts):
                for part in parts:
                    self.ask(part, mask & (self.known.truth(part) == truth))
            case Atom(predicate):
                self.light(mask, tuple(predicate.others))
                if predicate.formation:
                    self.formations.append(predicate.formation.name)
            case NeighbourNode(graph, body):
                self.light(mask)
                found = self.known.links(graph) & (self.known.truth(body) != node.every).T[:, None, :]
                self.walk(graph, np.where(found.any(axis=2), found.argmax(axis=2), -1), mask & (truth != node.every), 1)
            case ReachNode() | RouteNode():
                self.light(mask)
                onward = self.known.next_hops(node)
                self.walk(node.graph, onward, mask & (truth != node.every), self.known.shape[0])
            case PathLength(_, agent):
                self.light(mask, (agent,))
            case _ if children(node):
                self.hand_down(node, mask)
            case _:
                self.light(mask)

    def light(self, mask: Flags, partners: tuple[int, ...] = ()) -> None:
        """Mark the agents of the mask, and their partners at the same steps.

        Args:
            partners: agent indices.
        """
        self.lit |= mask
        self.lit[:, list(partners)] |= mask.any(axis=1, keepdims=True)

    def walk(self, graph: Graph, onward: Values, mask: Flags, most: int) -> None:
        """Mark the agents and links on the route of every agent of the mask.

        Args:
            onward: next agent of each route, (steps + 1, agents), -1 at its end.
            most: maximum number of links of a route.
        """
        one_way = directed(graph)
        for side in (0, 1):
            agent, step = np.nonzero(mask[side])
            for _ in range(most):
                after = onward[step, agent]
                agent, after, step = agent[after >= 0], after[after >= 0], step[after >= 0]
                if not len(agent):
                    break
                ends = (agent, after) if one_way else (np.minimum(agent, after), np.maximum(agent, after))
                self.links.append(np.stack([step, *ends], axis=1))
                agent = after
                self.lit[side, agent, step] = True
