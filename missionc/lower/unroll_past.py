"""Unrolling of operators that look back: kernel formulas with the same meaning that look ahead alone.

in   Mission, Kernel
out  a Kernel with the same truth and robustness at step 0 of every trace and without constants, or that it would be
     too large

A requirement is asked at step 0, so every formula below it is asked at known steps, and one that looks back
looks at known steps too. What stands around an operator of the past is spelt out for each of those steps; what
has none in it stays as it is, under a window that begins at its step. Planners are given formulas like
that and know one direction of time; the monitor and the verifier judge what was written.

Strengthening of requirements so that they hold between the steps too, of agents who go straight from state to state.

in   Mission, Kernel, the names of requirements
out  a Kernel in which those ask for more: whatever has to last from one step to the next is so at both, of the same
     agents, over the same links

Two agents who are in a convex region at both ends of a step are in it in between, and two who are in range at both are
so in between: whoever is chosen for a step, as one part of a disjunction or as the next on a route, is chosen for all
of it. What lies around a region, or comes of several links at once, may still fail in between. So it is a plan of the
strengthened requirement that is looked for, and what judges it is the verifier.
"""

from __future__ import annotations

from collections.abc import Iterator, Set
from dataclasses import replace
from typing import assert_never

from missionc.ir import Graph, Mission
from missionc.kernel import nodes as k
from missionc.kernel.analysis import steps_ahead
from missionc.kernel.normal_form import constant, without_constants
from missionc.kernel.walk import asked_between, asks, bottom_up, children, looks_back, postorder, rebuilt
from missionc.language.operator import TooLarge

MOST_LINKS = 2000
"""Links that a formula about routes names one by one: agents, times agents, times hops."""


def hold_throughout(mission: Mission, kernel: k.Kernel, names: Set[str]) -> k.Kernel:
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
        self._lasting: dict[k.Node, k.Node] = {}
        self._links: dict[tuple[Graph, int], k.Node] = {}

    def at_a_step(self, root: k.Node) -> k.Node:
        """The formula, asked at step 0."""
        asked = asked_between((root,), self.last)

        def strengthened(node: k.Node, below: tuple[k.Node, ...]) -> k.Node:
            _, latest = asked.get(node, (0, 0))
            return self._at_a_step(node, below, latest)

        return bottom_up((root,), strengthened)[root]

    def _at_a_step(self, node: k.Node, below: tuple[k.Node, ...], latest: int) -> k.Node:
        """What has to last up to the end of a window lasts from the step before it; ``latest``: its last step."""
        match node:
            case k.Always(body, low, high) | k.Release(_, body, low, high) if low >= 0:
                end = self.last if high is None and not latest else high
                if end is None:
                    return node
                if end <= low:
                    return rebuilt(node, below)
                if end == 1:
                    return self.lasting(body)
                return rebuilt(replace(node, high=end - 1), (*children(node)[:-1], self.lasting(body)))
            case k.Until() if node.low >= 0:
                return self._until(node, below[1], latest)
            case k.All() | k.Any() | k.AtLeast() | k.At() | k.Eventually():
                return rebuilt(node, below)
            case _:
                return node

    def _until(self, node: k.Until, end: k.Node, latest: int) -> k.Node:
        """``hold`` lasts up to ``end``; from the step before the window's last on it may look past the mission's last.

        Then it is not asked between these two steps, and has to hold at the first of them alone.
        """
        high = self.last - latest if node.high is None else node.high
        lasting = self.lasting(node.hold)
        if latest + high - 1 + steps_ahead((lasting,))[lasting] <= self.last:
            return rebuilt(node, (lasting, end))
        if node.high is None and latest:
            return rebuilt(node, (node.hold, end))
        stop = k.All((node.hold, k.Eventually(end, 1, 1)))
        at_last = replace(node, hold=lasting, end=stop, low=high - 1, high=high - 1)
        if node.low == high:
            return at_last
        return k.Any((replace(node, hold=lasting, end=end, high=high - 1), at_last), node.span, node.dual)

    def lasting(self, root: k.Node) -> k.Node:
        """The formula at every moment from the step it is asked at to the next."""
        for node in postorder((root,)):
            if node not in self._lasting:
                below = tuple(self._lasting[child] for child in children(node))
                self._lasting[node] = self._made_lasting(node, below)
        return self._lasting[root]

    def _made_lasting(self, node: k.Node, below: tuple[k.Node, ...]) -> k.Node:
        match node:
            case k.Is() | k.Not(k.Is()) | k.All(()) | k.Any(()):
                return node
            case k.All() | k.Any() | k.AtLeast() | k.At():
                return rebuilt(node, below)
            case k.Always(low=low, high=high) if low >= 0 and high is not None:
                return rebuilt(node, below)
            case k.Eventually(_, low, high) if low >= 0 and high is not None:
                return replace(node, low=low + 1) if low < high else replace(node, body=below[0])
            case k.Until(_, _, low, high) if low >= 0 and high is not None:
                if low < high:
                    return replace(node, hold=below[0], low=low + 1)
                return replace(node, hold=below[0], end=below[1])
            case k.Neighbour(graph) if len(graph.agents) ** 2 <= MOST_LINKS:
                return k.Any(self._beside(graph, below[0]), node.span, node.dual)
            case k.Reach(graph) if len(graph.agents) ** 2 * self._links_at_most(node) <= MOST_LINKS:
                through, end = below
                found = end
                for _ in range(self._links_at_most(node)):
                    onward = k.Any(self._beside(graph, found), node.span, node.dual)
                    found = k.Any((end, k.All((through, onward), node.span)), node.span, node.dual)
                return found
            case _:
                return k.Always(node, 0, 1, node.span, k.says_opposite(node))

    def _links_at_most(self, node: k.Reach) -> int:
        return min(node.hops, len(node.graph.agents) - 1)

    def _beside(self, graph: Graph, body: k.Node) -> tuple[k.Node, ...]:
        """For each agent of the graph, that it is linked from this step to the next and has what lasts of the body."""
        return tuple(k.All((self._linked(graph, agent), k.At(agent, body))) for agent in graph.agents)

    def _linked(self, graph: Graph, agent: int) -> k.Node:
        if (graph, agent) not in self._links:
            self._links[graph, agent] = k.Always(k.Neighbour(graph, k.Is(frozenset((agent,)))), 0, 1)
        return self._links[graph, agent]


def looking_ahead(mission: Mission, kernel: k.Kernel, room: int) -> k.Kernel | TooLarge:
    """The kernel as planners get it: without operators of the past and, after that, without constants.

    A goal that is constant stays a goal of its name, ``All(())`` or ``Any(())``: a backend satisfies the first by any
    plan, and finds none for the second. The same object if there is nothing to rewrite.

    Args:
        room: how many nodes it may have.
    """
    order = postorder(kernel.formulas)
    past: set[k.Node] = set()
    for node in order:
        if looks_back(node) or any(child in past for child in children(node)):
            past.add(node)
    agents = len(mission.agents)
    if not past:
        return without_constants(kernel, agents)
    unrolling = _Unrolling(past, mission.steps)
    asked: dict[k.Node, set[int]] = {node: set() for node in past}
    for formula in past.intersection(kernel.formulas):
        asked[formula].add(0)
    size = 0
    for node in reversed(order):
        for ask in asks(node) if node in past else ():
            for step in asked[node]:
                window = ask.steps_from(step, mission.steps)
                size += len(window) * _parts(node, len(window))
                if ask.node in past:
                    asked[ask.node].update(window)
            if size > room:
                return TooLarge(size)
    for node in order:
        for step in sorted(asked.get(node, ())):
            unrolling.known[node, step] = unrolling.made(node, step)
    ahead = kernel.with_formulas(lambda formula: unrolling.at(formula, 0))
    ahead = replace(ahead, meanings={text: node for text, node in kernel.meanings.items() if node not in past})
    return without_constants(ahead, agents)


def _stretches(window: range) -> Iterator[range]:
    """A window in stretches of 1, 2, 4, … steps that begin at a multiple of their length, as few as there are."""
    first = window.start
    while first < window.stop:
        size = first & -first or 1 << window.stop.bit_length()
        while first + size > window.stop:
            size //= 2
        yield range(first, first + size)
        first += size


def _parts(node: k.Node, window: int) -> int:
    """How many formulas a node comes to, at most, for each that it asks."""
    match node:
        case k.UntilNode():
            return 1 if looks_back(node) else window
        case k.NeighbourNode(graph):
            return 3 * len(graph.agents)
        case k.ReachNode(graph):
            return 3 * len(graph.agents) ** 2
        case _:
            return 1


class _Unrolling:
    """Formulas at a step, as they are asked at step 0; ``past`` are those with an operator of the past in them."""

    def __init__(self, past: set[k.Node], last: int) -> None:
        self.past, self.last = past, last
        self.known: dict[tuple[k.Node, int], k.Node] = {}
        self.stretches: dict[tuple[object, ...], k.Node] = {}
        self.links: dict[tuple[Graph, int, bool], k.Node] = {}

    def window(self, node: k.WindowNode | k.UntilNode, step: int) -> range:
        """The steps of a window that stands at a step."""
        return asks(node)[-1].steps_from(step, self.last)

    def at(self, node: k.Node, step: int) -> k.Node:
        """The formula at that step; of one with the past in it, it is known."""
        if node not in self.past and (node, step) not in self.known:
            self.known[node, step] = self.later(node, step)
        return self.known[node, step]

    def later(self, node: k.Node, step: int) -> k.Node:
        """The same of a formula that looks ahead alone."""
        if step == 0 or isinstance(node, k.Is) or constant(node) is not None:
            return node
        if isinstance(node, k.WindowNode):
            return replace(node, low=node.low + step, high=None if node.high is None else node.high + step)
        return k.Eventually(node, step, step, node.span, k.says_opposite(node))

    def each(self, node: k.Node, steps: range, every: bool) -> k.Node:
        """The formula at every, or at some, of these steps."""
        if node not in self.past and steps:
            return (k.Always if every else k.Eventually)(node, steps[0], steps[-1], node.span, k.says_opposite(node))
        return (k.All if every else k.Any)(
            tuple(self.at(node, step) for step in steps), node.span, k.says_opposite(node)
        )

    def made(self, node: k.Node, step: int) -> k.Node:
        """A formula with the past in it, of those below it."""
        match node:
            case k.All() | k.Any() | k.AtLeast() | k.At():
                return rebuilt(node, tuple(self.at(child, step) for child in children(node)))
            case k.WindowNode(k.WindowNode() as inner) if self.may_begin_earlier(inner, self.window(node, step)):
                window = self.window(node, step)
                ahead = replace(inner, low=0, high=(inner.high or 0) - inner.low)
                return replace(node, body=ahead, low=window[0] + inner.low, high=window[-1] + inner.low)
            case k.WindowNode(body):
                whole = self.each(body, self.window(node, step), node.every)
                return replace(whole, span=node.span, dual=node.dual) if isinstance(whole, k.All | k.Any) else whole
            case k.UntilNode():
                return self.since(node, step) if looks_back(node) else self.until(node, step)
            case k.NeighbourNode(graph, body):
                return self.pair(
                    node, tuple(self.linked(node, agent, self.at(body, step), step) for agent in graph.agents)
                )
            case k.ReachNode():
                return self.reach(node, step)
            case k.RouteNode():
                raise AssertionError("no backend offers to look back below a route in metres")
            case k.LeafNode() | k.Not():
                raise AssertionError("a leaf has no operator of the past in it")
            case _:
                assert_never(node)

    def may_begin_earlier(self, node: k.WindowNode, steps: range) -> bool:
        """Whether windows that look back from these steps look ahead from earlier ones: none reaches before 0."""
        return looks_back(node) and node.body not in self.past and bool(steps) and steps[0] + node.low >= 0

    def pair(self, node: k.Node, parts: tuple[k.Node, ...], *, contrary: bool = False) -> k.Node:
        """Some of the parts, or all of them where ``node`` asks for every one; ``contrary``, the other way round."""
        assert not isinstance(node, k.LeafNode | k.Not)
        return (k.All if node.every is not contrary else k.Any)(parts, node.span, node.dual)

    def until(self, node: k.UntilNode, step: int) -> k.Node:
        """``end`` at some step of the window, with ``hold`` from here up to it; or the dual."""
        parts = []
        for when in self.window(node, step):
            held = (self.each(node.hold, range(step, when), not node.every),) if when > step else ()
            parts.append(self.pair(node, (self.at(node.end, when), *held), contrary=True))
        return self.pair(node, tuple(parts))

    def since(self, node: k.UntilNode, step: int) -> k.Node:
        """``end`` at some step of the window, with ``hold`` after it; or the dual.

        The window falls into stretches that other steps look back at too, so that few formulas do for all of them.
        """
        window = self.window(node, step)
        if not window:
            return self.pair(node, ())
        first, *others = _stretches(window)
        found = self.within(node, first)
        for stretch in others:
            found = self.after(node, found, stretch)
        rest = range(window.stop, step + 1)
        return self.pair(node, (found, self.held(node, rest)), contrary=True) if rest else found

    def after(self, node: k.UntilNode, before: k.Node, stretch: range) -> k.Node:
        """``end`` within a stretch of steps and ``hold`` after it, or what was so before and ``hold`` throughout."""
        lasting = self.pair(node, (self.held(node, stretch), before), contrary=True)
        return self.pair(node, (self.within(node, stretch), lasting))

    def within(self, node: k.UntilNode, stretch: range) -> k.Node:
        """``end`` at some step of a stretch and ``hold`` at those after it: of its halves, each known once."""
        if len(stretch) == 1:
            return self.at(node.end, stretch[0])
        key = node, stretch
        if key not in self.stretches:
            half = len(stretch) // 2
            self.stretches[key] = self.after(node, self.within(node, stretch[:half]), stretch[half:])
        return self.stretches[key]

    def held(self, node: k.UntilNode, steps: range) -> k.Node:
        """``hold`` at all of these steps; or the dual."""
        key = node.hold, steps, node.every
        if key not in self.stretches:
            self.stretches[key] = self.each(node.hold, steps, not node.every)
        return self.stretches[key]

    def linked(self, node: k.NeighbourNode | k.ReachNode, agent: int, body: k.Node, step: int) -> k.Node:
        """That agent is linked to this one at the step, and has what stands for the body then; or the dual."""
        key = (node.graph, agent, node.every)
        if key not in self.links:
            it = k.Is(frozenset((agent,)))
            self.links[key] = k.EveryNeighbour(node.graph, k.Not(it)) if node.every else k.Neighbour(node.graph, it)
        return self.pair(node, (self.at(self.links[key], step), k.At(agent, body, node.span)), contrary=True)

    def reach(self, node: k.ReachNode, step: int) -> k.Node:
        """Routes of no link, then of one more at a time."""
        end, through = self.at(node.end, step), self.at(node.through, step)
        found = end
        for _ in range(min(node.hops, len(node.graph.agents) - 1)):
            onward = self.pair(node, tuple(self.linked(node, each, found, step) for each in node.graph.agents))
            found = self.pair(node, (end, self.pair(node, (through, onward), contrary=True)))
        return found
