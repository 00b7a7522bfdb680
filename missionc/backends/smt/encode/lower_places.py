"""Lifted encoding: formulas about roadmap states instead of agents, so that the size is independent of the number of
agents.

No two agents are ever in one state. "Some linked agent" can therefore be encoded over the states linked to the agent's
state, at a cost independent of the number of agents. Literals imply their meaning:

    among     some of these agents is in the state and satisfies the formula; or each of them in the state satisfies it
    standing  if this agent is in the state, it satisfies the formula

Since a state contains at most one agent, both kinds of literals distribute over *and* and *or*.

Source:
    [strel] Symbolic Encoding of STREL Specifications, without its list of routes.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import numpy as np

from missionc.backends.smt.encode.clauses import FALSE, TRUE, Literals
from missionc.backends.smt.encode.lower_motion import Agents, Occupancy, Tables
from missionc.backends.smt.encode.lower_on_demand import Ask, at_least, choose, join
from missionc.backends.smt.encode.lower_routes import MetricRoutes, Route, Routes, kind_of, kinds_of
from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.trace import Indices
from missionc.ir import Graph
from missionc.ir.kernel.nodes import All, Any, AtLeast, Atom, Is, NeighbourNode, Node, Not, ReachNode, RouteNode
from missionc.ir.kernel.walk import children


class OfAgents(Protocol):
    """Interface of the encoding of formulas about an agent, by index, at a step: (cells,) twice -> literals,
    (cells,)."""

    def holds(self, node: Node, agents: Indices, steps: Indices) -> Literals: ...

    def of_team(self, node: Node) -> bool: ...


class Places:
    """Literals for roadmap states (places), created on demand; a cell is a pair of step and place, (cells,) each."""

    def __init__(self, labels: Labels, occupancy: Occupancy, of_agents: OfAgents, most_links: int) -> None:
        self.labels, self.occupancy, self.of_agents = labels, occupancy, of_agents
        self.motion, self.clauses = occupancy.motion, occupancy.clauses
        self.routes = Routes(occupancy, self, most_links)
        self.metric_routes = MetricRoutes(occupancy, self)
        self._tables = Tables(self.motion.steps + 1, self.motion.places)
        self._decides: dict[Node, bool] = {}
        self._told_apart: dict[Node, tuple[Agents, ...]] = {}

    # ----------------------------------------------- any agent there

    def among(self, node: Node, some: bool, agents: Agents, steps: Indices, places: Indices) -> Literals:
        """Literals that some agent of ``agents`` is in the state and satisfies the formula: (cells,).

        Without ``some``, the literals imply that each agent of ``agents`` in the state satisfies the formula.
        """

        def define(steps: Indices, places: Indices) -> Literals:
            return self._among(node, some, agents, steps, places)

        if not children(node) or isinstance(node, Not):  # a table gains nothing
            return define(steps, places)
        return self._tables.look_up((node, some, agents), steps, places, define)

    def _among(self, node: Node, some: bool, agents: Agents, steps: Indices, places: Indices) -> Literals:
        def present(agents: Agents) -> Ask:
            whether = self.occupancy.occupied if some else self.occupancy.vacant
            return lambda rows: whether(agents, steps[rows], places[rows])

        def ask(node: Node, some: bool, agents: Agents) -> Ask:
            return lambda rows: self.among(node, some, agents, steps[rows], places[rows])

        def both(*asks: Ask) -> Literals:
            return join(self.clauses, some, len(steps), asks)

        match node:
            case Atom(predicate) | Not(Atom(predicate)) if self.labels.of_places(predicate):
                holds = self._labelled(node, places)
                return both(lambda rows: holds[rows], present(agents))
            case Is(members) | Not(Is(members)):
                left = agents & members if isinstance(node, Is) is some else agents - members
                return present(left)(np.arange(len(steps)))
            case All((only,)) | Any((only,)):
                return self.among(only, some, agents, steps, places)
            case All(parts) | Any(parts) if node.every is some:
                fewer, rest = _narrowed(node, parts, agents)
                return both(present(fewer), *(ask(part, some, fewer) for part in cheap_first(rest)))
            case All(parts) | Any(parts):
                asks = [ask(part, some, agents) for part in cheap_first(parts)]
                return join(self.clauses, not some, len(steps), asks)
            case AtLeast(count, parts):
                return both(present(agents), at_least(self.clauses, count, [ask(part, some, agents) for part in parts]))
            case NeighbourNode() | ReachNode() | RouteNode() if node.every is some:
                return both(present(agents), ask(node, not some, agents))
            case NeighbourNode(graph) | ReachNode(graph) | RouteNode(graph) if (
                len(apart := _by_kind(graph, agents)) > 1
            ):
                return join(self.clauses, not some, len(steps), [ask(node, some, kind) for kind in apart])
            case NeighbourNode(graph, body):
                linked = agents.intersection(graph.agents)
                return both(
                    present(linked),
                    lambda rows: self._agent_beside(graph, min(linked), body, some, steps[rows], places[rows]),
                )
            case ReachNode() | RouteNode():
                linked = agents.intersection(node.graph.agents)
                start = ask(node.through, some, linked)
                here = ask(node.end, some, agents)
                return self._reach(node, min(linked, default=None), some, here, start, steps, places)
            case _ if self.of_agents.of_team(node):
                return both(present(agents), self._of_team(node, steps))
            case _:
                return both(present(agents), lambda rows: self._of_whoever(node, agents, steps[rows], places[rows]))

    def _of_whoever(self, node: Node, agents: Agents, steps: Indices, places: Indices) -> Literals:
        """Literals that if an agent of ``agents`` is in the state, the agent satisfies the formula: (cells,)."""
        names = self.clauses.fresh(len(steps))
        for agent in sorted(agents):
            of_agent = self.motion.places_of(agent)
            inside = np.flatnonzero((places >= of_agent.start) & (places < of_agent.stop))
            there = self.motion.states[agent][steps[inside], places[inside] - of_agent.start]
            inside, there = inside[there != FALSE], there[there != FALSE]
            literals = self.of_agents.holds(node, np.full_like(inside, agent), steps[inside])
            self.clauses.add(-names[inside], -there, literals)
        return names

    def _labelled(self, node: Atom | Not, places: Indices) -> Literals:
        """Constant literals for the truth of a predicate, or of its negation, in states: (cells,)."""
        leaf, positive = (node.body, False) if isinstance(node, Not) else (node, True)
        assert isinstance(leaf, Atom)
        return np.where(self.labels.places_where(leaf.predicate, positive)[places], TRUE, FALSE).astype(np.int32)

    # ------------------------------------------- a named agent

    def decides(self, node: Node) -> bool:
        """Return true if an agent's state decides the formula, given the states of the other agents at the same
        step."""
        if node not in self._decides:
            match node:
                case Atom(predicate):
                    known = self.labels.of_places(predicate)
                case Is() | NeighbourNode():
                    known = True
                case Not() | All() | Any() | AtLeast() | ReachNode() | RouteNode():
                    known = all(map(self.decides, children(node)))
                case _:
                    known = False
            self._decides[node] = known or self.of_agents.of_team(node)
        return self._decides[node]

    def standing(self, node: Node, agent: int, steps: Indices, places: Indices) -> Literals:
        """Literals that if the agent is in the state, the agent satisfies the formula: (cells,); states must decide the
        formula (``decides``)."""

        def define(steps: Indices, places: Indices) -> Literals:
            return self._standing(node, agent, steps, places)

        if not children(node) or isinstance(node, Not):
            return define(steps, places)
        alike = tuple(agent in members for members in self._apart(node))
        return self._tables.look_up(("standing", node, alike), steps, places, define)

    def _standing(self, node: Node, agent: int, steps: Indices, places: Indices) -> Literals:
        def ask(node: Node) -> Ask:
            return lambda rows: self.standing(node, agent, steps[rows], places[rows])

        def constant(truth: bool) -> Literals:
            return np.full(len(steps), TRUE if truth else FALSE, dtype=np.int32)

        match node:
            case Atom(predicate) | Not(Atom(predicate)) if self.labels.of_places(predicate):
                return self._labelled(node, places)
            case Is(members):
                return constant(agent in members)
            case Not(Is(members)):
                return constant(agent not in members)
            case All(parts) | Any(parts):
                return join(self.clauses, node.every, len(steps), map(ask, cheap_first(parts)))
            case AtLeast(count, parts):
                return at_least(self.clauses, count, [ask(part) for part in parts])(np.arange(len(steps)))
            case NeighbourNode(graph, body):
                if agent not in graph.agents:
                    return constant(node.every)
                return self._agent_beside(graph, agent, body, not node.every, steps, places)
            case ReachNode() | RouteNode():
                if agent not in node.graph.agents:
                    return self.standing(node.end, agent, steps, places)
                return self._reach(node, agent, not node.every, ask(node.end), ask(node.through), steps, places)
            case _:
                return self._of_team(node, steps)(np.arange(len(steps)))

    def _apart(self, node: Node) -> tuple[Agents, ...]:
        """Sets of agents that the formula distinguishes: agents in the same sets may share literals."""
        if node not in self._told_apart:
            match node:
                case Is(members):
                    own: tuple[Agents, ...] = (members,)
                case NeighbourNode(graph) | ReachNode(graph) | RouteNode(graph):
                    own = kinds_of(graph)
                case _:
                    own = ()
            # The condition on linked agents is the same for every agent.
            below = () if isinstance(node, NeighbourNode) else children(node)
            self._told_apart[node] = tuple(dict.fromkeys(own + sum(map(self._apart, below), ())))
        return self._told_apart[node]

    # ---------------------------------------------------------------- conditions

    def onward(self, node: ReachNode | RouteNode, agent: int, some: bool, steps: Indices, places: Indices) -> Literals:
        """Literals that some route continues from the agent in the state to a linked agent, or without ``some``, that
        all such routes satisfy the conditions: (cells,)."""
        route, senders = Route(node.graph, node.through, node.end), kind_of(node.graph, agent)
        if isinstance(node, RouteNode):
            assert node.low <= 0, "`metric_bounds` leaves none"
            return self.metric_routes.route_beside(route, senders, node.high, some, steps, places)
        links = min(node.hops, len(node.graph.agents) - 1) - 1
        return self.routes.route_beside(route, senders, links, some, steps, places)

    def _agent_beside(
        self, graph: Graph, agent: int, body: Node, some: bool, steps: Indices, places: Indices
    ) -> Literals:
        return self.routes.agent_beside(graph, kind_of(graph, agent), body, some, steps, places)

    def _of_team(self, node: Node, steps: Indices) -> Ask:
        return lambda rows: self.of_agents.holds(node, np.zeros_like(rows), steps[rows])

    def _reach(
        self,
        node: ReachNode | RouteNode,
        agent: int | None,
        some: bool,
        here: Ask,
        start: Ask,
        steps: Indices,
        places: Indices,
    ) -> Literals:
        """Literals of routes from an agent in the state, with condition ``here`` for their end and ``start`` for their
        continuation.

        Agents of the graph that may be in the state are of the kind of ``agent``; None means that there are none.
        """
        if agent is None or not leads_on(node):
            return here(np.arange(len(steps)))

        def onward(rows: Indices) -> Literals:
            return self.onward(node, agent, some, steps[rows], places[rows])

        return choose(self.clauses, some, len(steps), here, start, onward)


def leads_on(node: ReachNode | RouteNode) -> bool:
    """Return true if routes of the operator may have a link."""
    return len(node.graph.agents) > 1 and (isinstance(node, RouteNode) or node.hops > 0)


def _by_kind(graph: Graph, agents: Agents) -> list[Agents]:
    """Partition of the agents by the kinds of agents on the graph."""
    parts = [agents.intersection(kind) for kind in kinds_of(graph)]
    return [part for part in (*parts, agents.difference(graph.agents)) if part] if len(parts) > 1 else [agents]


def _narrowed(node: All | Any, parts: tuple[Node, ...], agents: Agents) -> tuple[Agents, list[Node]]:
    """Agents that remain after the membership parts of a node, and the other parts.

    An *and* keeps the agents in all named sets, an *or* the agents in no named set.
    """
    kind = type(node)
    rest: list[Node] = []
    for part in parts:
        match part:
            case Is(members) | Not(Is(members)):
                agents = agents & members if isinstance(part, Is) is node.every else agents - members
            case All(inner) | Any(inner) if isinstance(part, kind):
                agents, more = _narrowed(node, inner, agents)
                rest += more
            case _:
                rest.append(part)
    return agents, rest


def cheap_first(parts: Iterable[Node]) -> list[Node]:
    """Parts of a node with the cheapest to encode first, which may make others unnecessary."""

    def cost(node: Node) -> int:
        match node:
            case Is() | Not(Is()):
                return 0
            case Atom() | Not(Atom()):
                return 1
            case _:
                return 2

    return sorted(parts, key=cost)
