"""Strengthening of requirements so that they hold between the steps too, of agents who go straight from state to state.

in   Mission, Kernel, the names of requirements
out  a Kernel in which those ask for more: whatever has to last from one step to the next is so at both, of the same
     agents, over the same links

Two agents who are in a convex region at both ends of a step are in it in between, and two who are in range at both are
so in between: whoever is chosen for a step, as one part of a disjunction or as the next on a route, is chosen for all
of it. What lies around a region, or comes of several links at once, may still fail in between. So it is a plan of the
strengthened requirement that is looked for, and what judges it is the verifier.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

from missionc.ir import Graph, Mission
from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
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

MOST_LINKS = 2000
"""Links that a formula about routes names one by one: agents, times agents, times hops."""


def hold_throughout(mission: Mission, kernel: Kernel, names: Set[str]) -> Kernel:
    """The kernel with the requirements of these names strengthened; the others are the same objects."""
    strengthening = _Strengthening(mission.steps)
    goals = tuple(
        replace(goal, formula=strengthening.at_a_step(goal.formula)) if goal.name in names else goal
        for goal in kernel.requirements
    )
    return replace(kernel, requirements=goals)


class _Strengthening:
    """Formulas that are asked at one step, and formulas that are asked from a step to the next: each is made once."""

    def __init__(self, last: int) -> None:
        self.last = last
        self._lasting: dict[Node, Node] = {}
        self._links: dict[tuple[Graph, int], Node] = {}

    def at_a_step(self, root: Node) -> Node:
        """The formula, asked at step 0."""
        asked = asked_between((root,), self.last)

        def strengthened(node: Node, below: tuple[Node, ...]) -> Node:
            _, latest = asked.get(node, (0, 0))
            return self._at_a_step(node, below, latest)

        return bottom_up((root,), strengthened)[root]

    def _at_a_step(self, node: Node, below: tuple[Node, ...], latest: int) -> Node:
        """What has to last up to the end of a window lasts from the step before it; ``latest``: its last step."""
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
        """``hold`` lasts up to ``end``; from the step before the window's last on it may look past the mission's last.

        Then it is not asked between these two steps, and has to hold at the first of them alone.
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
        """The formula at every moment from the step it is asked at to the next."""
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
                return Always(node, 0, 1, node.span, says_opposite(node))

    def _links_at_most(self, node: Reach) -> int:
        return min(node.hops, len(node.graph.agents) - 1)

    def _beside(self, graph: Graph, body: Node) -> tuple[Node, ...]:
        """For each agent of the graph, that it is linked from this step to the next and has what lasts of the body."""
        return tuple(All((self._linked(graph, agent), At(agent, body))) for agent in graph.agents)

    def _linked(self, graph: Graph, agent: int) -> Node:
        if (graph, agent) not in self._links:
            self._links[graph, agent] = Always(Neighbour(graph, Is(frozenset((agent,)))), 0, 1)
        return self._links[graph, agent]
