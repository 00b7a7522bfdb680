"""Strengthening of requirements so that they also hold between steps, for agents that move straight between states.

in   Mission, Kernel, the names of requirements
out  a Kernel with stronger requirements: a condition that must last between two steps holds at both, for the
     same agents and links

Two agents that are in a convex region at both ends of a step are in it in between; likewise two agents in range. The
same agent must therefore be chosen for the whole step, as one part of a disjunction or as the next on a route. For
planners on roadmaps, the place of an agent is judged along its whole motion, so the outside of a region counts too.
Conditions on several links may still fail in between. The planner therefore searches with the strengthened requirement,
and the verifier judges the plan.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

from missionc.ir import Altitude, Compare, Coordinate, DuringMotion, Graph, Mission, Predicate
from missionc.ir.distances.convex_pieces import count_pieces
from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    Is,
    Kernel,
    Neighbour,
    Node,
    Not,
    Reach,
    Release,
    Until,
    says_opposite,
)
from missionc.ir.kernel.walk import asked_between, bottom_up, children, postorder, rebuilt
from missionc.ir.predicates.during_motion import decided_by_place

MOST_LINKS = 2000
"""Maximum number of links in a strengthened formula about routes: agents times agents times hops."""


def hold_throughout(mission: Mission, kernel: Kernel, names: Set[str], *, motions: bool = False) -> Kernel:
    """Strengthen the requirements of these names; the others are the same objects.

    Args:
        motions: True to require ``DuringMotion`` of places, which only planners on roadmaps know.
    """
    straight = not any(agent.dynamics.has_momentum for agent in mission.agents)
    strengthening = _Strengthening(mission.steps, motions, straight)
    goals = tuple(
        replace(goal, formula=strengthening.at_a_step(goal.formula)) if goal.name in names else goal
        for goal in kernel.requirements
    )
    return replace(kernel, requirements=goals)


class _Strengthening:
    """Cache of strengthened formulas, for one step and for the time from one step to the next."""

    def __init__(self, last: int, motions: bool, straight: bool) -> None:
        self.last, self.motions, self.straight = last, motions, straight
        self._lasting: dict[Node, Node] = {}
        self._links: dict[tuple[Graph, int], Node] = {}

    def at_a_step(self, root: Node) -> Node:
        """Strengthened form of a formula that is evaluated at step 0."""
        asked = asked_between((root,), self.last)

        def strengthened(node: Node, below: tuple[Node, ...]) -> Node:
            _, latest = asked.get(node, (0, 0))
            return self._at_a_step(node, below, latest)

        return bottom_up((root,), strengthened)[root]

    def _at_a_step(self, node: Node, below: tuple[Node, ...], latest: int) -> Node:
        """Strengthened form of a node at one step: a condition that ends with a window holds from the step before the
        window's end.

        Args:
            below: strengthened children.
            latest: last step at which the node is evaluated.
        """
        match node:
            case Always(body, low, high) | Release(_, body, low, high) if low >= 0:
                end = self.last if high is None and not latest else high
                if end is None:
                    return node
                if end <= low:
                    return rebuilt(node, below)
                if end == 1:
                    return self.lasting(body)
                return rebuilt(replace(node, high=end - 1), (*children(node)[:-1], self.lasting(body)))
            case Until() if node.low >= 0:
                return self._until(node, below[1], latest)
            case All() | Any() | AtLeast() | At() | Eventually():
                return rebuilt(node, below)
            case _:
                return node

    def _until(self, node: Until, end: Node, latest: int) -> Node:
        """Strengthened ``until``: ``hold`` lasts up to ``end``.

        From the step before the window's last, ``hold`` may look past the mission's last step. It is then evaluated
        only at the first of these two steps.
        """
        high = self.last - latest if node.high is None else node.high
        lasting = self.lasting(node.hold)
        if latest + high - 1 + steps_ahead((lasting,))[lasting] <= self.last:
            return rebuilt(node, (lasting, end))
        if node.high is None and latest:
            return rebuilt(node, (node.hold, end))
        stop = All((node.hold, Eventually(end, 1, 1)))
        at_last = replace(node, hold=lasting, end=stop, low=high - 1, high=high - 1)
        if node.low == high:
            return at_last
        return Any((replace(node, hold=lasting, end=end, high=high - 1), at_last), node.span, node.dual)

    def lasting(self, root: Node) -> Node:
        """Strengthened formula that holds at all times from the evaluated step to the next."""
        for node in postorder((root,)):
            if node not in self._lasting:
                below = tuple(self._lasting[child] for child in children(node))
                self._lasting[node] = self._made_lasting(node, below)
        return self._lasting[root]

    def _made_lasting(self, node: Node, below: tuple[Node, ...]) -> Node:
        match node:
            case Is() | Not(Is()) | All(()) | Any(()):
                return node
            case All() | Any() | AtLeast() | At():
                return rebuilt(node, below)
            case Always(low=low, high=high) if low >= 0 and high is not None:
                return rebuilt(node, below)
            case Eventually(_, low, high) if low >= 0 and high is not None:
                return replace(node, low=low + 1) if low < high else replace(node, body=below[0])
            case Until(_, _, low, high) if low >= 0 and high is not None:
                if low < high:
                    return replace(node, hold=below[0], low=low + 1)
                return replace(node, hold=below[0], end=below[1])
            case Neighbour(graph) if len(graph.agents) ** 2 <= MOST_LINKS:
                return Any(self._beside(graph, below[0]), node.span, node.dual)
            case Reach(graph) if len(graph.agents) ** 2 * self._links_at_most(node) <= MOST_LINKS:
                through, end = below
                found = end
                for _ in range(self._links_at_most(node)):
                    onward = Any(self._beside(graph, found), node.span, node.dual)
                    found = Any((end, All((through, onward), node.span)), node.span, node.dual)
                return found
            case _:
                both = Always(node, 0, 1, node.span, says_opposite(node))
                leaf = node.body if isinstance(node, Not) else node
                if not self.motions or not isinstance(leaf, Atom) or self._as_at_ends(leaf.predicate, leaf is node):
                    return both
                return All((both, Atom(DuringMotion(leaf.predicate, leaf is node), node.span)), node.span)

    def _as_at_ends(self, predicate: Predicate, truth: bool) -> bool:
        """Return whether the two ends of a motion decide it, or the places between say nothing of it."""
        if not decided_by_place(predicate):
            return True
        if predicate.region is not None:
            return self.straight and truth and count_pieces(predicate.region.shape)[0] == 1
        coordinates = isinstance(predicate, Compare) and all(
            isinstance(feature, Coordinate | Altitude) for _, feature in predicate.terms
        )
        return self.straight and coordinates

    def _links_at_most(self, node: Reach) -> int:
        return min(node.hops, len(node.graph.agents) - 1)

    def _beside(self, graph: Graph, body: Node) -> tuple[Node, ...]:
        """For each agent of the graph, the formula that it is linked from this step to the next and satisfies the
        strengthened body."""
        return tuple(All((self._linked(graph, agent), At(agent, body))) for agent in graph.agents)

    def _linked(self, graph: Graph, agent: int) -> Node:
        if (graph, agent) not in self._links:
            self._links[graph, agent] = Always(Neighbour(graph, Is(frozenset((agent,)))), 0, 1)
        return self._links[graph, agent]
