"""Witnesses: the agents and links that make a formula true or false at each step.

in   a formula, the truth of all its subformulas
out  Witness

A true *or* is followed to its first true part, a false *and* to all its false parts. A route is the route with the
fewest links, or the shortest route if bounded in metres. Windows are skipped: the witness at a step shows the truth at
that step.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Graph, Mission
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, NeighbourNode, Node, PathLength, ReachNode, RouteNode
from missionc.ir.kernel.walk import children, postorder
from missionc.ir.language.margins.links import all_links, link_pieces
from missionc.ir.pair_ranges import directed
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import TRUTH, Values
from missionc.verification.monitoring.verdict_table import asked_where, chain

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
