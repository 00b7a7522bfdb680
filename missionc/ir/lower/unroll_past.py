"""Unrolling of past operators: equivalent kernel formulas that only look ahead.

in   Mission, Kernel
out  a Kernel with the same truth and robustness at step 0 of every trace and without constants, or a report
     that it would be too large

A requirement is evaluated at step 0, so every formula below it is evaluated at known steps, including past operators. A
formula with bounded windows that is evaluated from a step on is the same formula with all windows moved ahead,
evaluated earlier (``earlier``), unless a window reaches before step 0. Others around a past operator are expanded for
each step. Formulas without past operators stay the same, under a window that begins at their step. Planners get such
formulas and support one direction of time only; the monitor and the verifier judge the original.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import assert_never

from missionc.ir import Graph, Mission
from missionc.ir.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Eventually,
    EveryNeighbour,
    Is,
    Kernel,
    LeafNode,
    Neighbour,
    NeighbourNode,
    Node,
    Not,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
    says_opposite,
)
from missionc.ir.kernel.normal_form import constant, without_constants
from missionc.ir.kernel.walk import asks, children, looks_back, postorder, rebuilt
from missionc.ir.language.operator import TooLarge


def looking_ahead(mission: Mission, kernel: Kernel, room: int) -> Kernel | TooLarge:
    """Kernel for planners: without past operators and without constants; the same object if nothing changes.

    A constant goal keeps its name, with ``All(())`` or ``Any(())``: every plan satisfies the first, and none the
    second.

    Args:
        room: maximum number of nodes; ``TooLarge`` is returned beyond it.
    """
    order = postorder(kernel.formulas)
    past: set[Node] = set()
    for node in order:
        if looks_back(node) or any(child in past for child in children(node)):
            past.add(node)
    agents = len(mission.agents)
    if not past:
        return without_constants(kernel, agents)
    unrolling = _Unrolling(past, mission.steps, _looks(order, past))
    asked: dict[Node, set[int]] = {node: set() for node in past}
    for formula in past.intersection(kernel.formulas):
        asked[formula].add(0)
    size = 0
    for node in reversed(order):
        for ask in asks(node) if node in past else ():
            for step in asked[node]:
                window = ask.steps_from(step, mission.steps)
                if isinstance(node, WindowNode):
                    window = window[: len(window) - len(unrolling.moved(node, window))]
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
    """Fewest ranges of 1, 2, 4, … steps, each beginning at a multiple of its length, that partition a window."""
    first = window.start
    while first < window.stop:
        size = first & -first or 1 << window.stop.bit_length()
        while first + size > window.stop:
            size //= 2
        yield range(first, first + size)
        first += size


def _parts(node: Node, window: int) -> int:
    """Maximum number of formulas into which an expanded node splits, for each of its children."""
    match node:
        case UntilNode():
            return 1 if looks_back(node) else window
        case NeighbourNode(graph):
            return 3 * len(graph.agents)
        case ReachNode(graph):
            return 3 * len(graph.agents) ** 2
        case _:
            return 1


def _looks(order: Iterable[Node], past: set[Node]) -> dict[Node, tuple[int, int]]:
    """Steps back and ahead that the value of a formula depends on, for those whose windows can be moved.

    Args:
        order: formulas, each after its children.
        past: those that contain a past operator; others need no move.
    """
    found: dict[Node, tuple[int, int]] = {}
    for node in order:
        below = [found.get(child) for child in children(node)]
        known = [each for each in below if each is not None]
        if len(known) < len(below):
            continue
        back, ahead = (max((each[end] for each in known), default=0) for end in (0, 1))
        match node:
            case WindowNode(low=low, high=int(high)):
                found[node] = max(back - low, 0), max(ahead + high, 0)
            case Is() | LeafNode() | Not() | All() | Any() | AtLeast() | At():
                found[node] = back, ahead
            case _ if node not in past:
                found[node] = 0, 0
    return found


class _Unrolling:
    """Formulas at a step, evaluated at step 0; ``past`` are those that contain a past operator.

    ``looks``: steps back and ahead, as of ``_looks``.
    """

    def __init__(self, past: set[Node], last: int, looks: dict[Node, tuple[int, int]]) -> None:
        self.past, self.last, self.looks = past, last, looks
        self.moves: dict[tuple[Node, int], Node] = {}
        self.known: dict[tuple[Node, int], Node] = {}
        self.stretches: dict[tuple[object, ...], Node] = {}
        self.links: dict[tuple[Graph, int, bool], Node] = {}

    def window(self, node: WindowNode | UntilNode, step: int) -> range:
        """Steps of the node's window if the node is evaluated at ``step``."""
        return asks(node)[-1].steps_from(step, self.last)

    def at(self, node: Node, step: int) -> Node:
        """Formula, evaluated at step 0, that ``node`` holds at ``step``; nodes with past operators are already
        expanded."""
        if node not in self.past and (node, step) not in self.known:
            self.known[node, step] = self.later(node, step)
        return self.known[node, step]

    def later(self, node: Node, step: int) -> Node:
        """Formula, evaluated at step 0, that a node without past operators holds at ``step``."""
        if step == 0 or isinstance(node, Is) or constant(node) is not None:
            return node
        if isinstance(node, WindowNode):
            return replace(node, low=node.low + step, high=None if node.high is None else node.high + step)
        return Eventually(node, step, step, node.span, says_opposite(node))

    def each(self, node: Node, steps: range, every: bool) -> Node:
        """Formula that the node holds at every (or if not ``every``, at some) of the steps."""
        if node not in self.past and steps:
            return (Always if every else Eventually)(node, steps[0], steps[-1], node.span, says_opposite(node))
        return (All if every else Any)(tuple(self.at(node, step) for step in steps), node.span, says_opposite(node))

    def made(self, node: Node, step: int) -> Node:
        """Expansion of a node that contains a past operator, evaluated at ``step``, from its children."""
        match node:
            case All() | Any() | AtLeast() | At():
                return rebuilt(node, tuple(self.at(child, step) for child in children(node)))
            case WindowNode(body):
                window = self.window(node, step)
                moved = self.moved(node, window)
                if not moved:
                    whole = self.each(body, window, node.every)
                    return replace(whole, span=node.span, dual=node.dual) if isinstance(whole, All | Any) else whole
                back = self.looks[body][0]
                rest = replace(node, body=self.earlier(body, back), low=moved[0] - back, high=moved[-1] - back)
                first = tuple(self.at(body, each) for each in window[: len(window) - len(moved)])
                return (All if node.every else Any)((*first, rest), node.span, node.dual) if first else rest
            case UntilNode():
                return self.since(node, step) if looks_back(node) else self.until(node, step)
            case NeighbourNode(graph, body):
                return self.pair(
                    node, tuple(self.linked(node, agent, self.at(body, step), step) for agent in graph.agents)
                )
            case ReachNode():
                return self.reach(node, step)
            case RouteNode():
                raise AssertionError("no backend offers to look back below a route in metres")
            case LeafNode() | Not():
                raise AssertionError("a leaf has no operator of the past in it")
            case _:
                assert_never(node)

    def moved(self, node: WindowNode, window: range) -> range:
        """Last steps of a window at which the body can be evaluated earlier; the others are expanded."""
        if node.body not in self.past or node.body not in self.looks:
            return range(0)
        back, ahead = self.looks[node.body]
        first = max(window.start, back)
        return range(first, window.stop) if first < window.stop and window[-1] + ahead <= self.last else range(0)

    def earlier(self, node: Node, by: int) -> Node:
        """Formula that has some steps earlier the value that ``node`` has now; no window reaches over an end."""
        if node not in self.past:
            return self.later(node, by)
        if (node, by) not in self.moves:
            match node:
                case WindowNode(body, low, int(high)):
                    back = self.looks[body][0] if body in self.past else 0
                    inner = self.earlier(body, back) if body in self.past else body
                    made: Node = replace(node, body=inner, low=low + by - back, high=high + by - back)
                case _:
                    made = rebuilt(node, tuple(self.earlier(child, by) for child in children(node)))
            self.moves[node, by] = made
        return self.moves[node, by]

    def pair(self, node: Node, parts: tuple[Node, ...], *, contrary: bool = False) -> Node:
        """Disjunction of the parts, or conjunction if ``node`` is universal; ``contrary`` exchanges the two cases."""
        assert not isinstance(node, LeafNode | Not)
        return (All if node.every is not contrary else Any)(parts, node.span, node.dual)

    def until(self, node: UntilNode, step: int) -> Node:
        """Expansion of ``until`` at ``step``: ``end`` at some step of the window, with ``hold`` before it; or its
        dual."""
        parts = []
        for when in self.window(node, step):
            held = (self.each(node.hold, range(step, when), not node.every),) if when > step else ()
            parts.append(self.pair(node, (self.at(node.end, when), *held), contrary=True))
        return self.pair(node, tuple(parts))

    def since(self, node: UntilNode, step: int) -> Node:
        """Expansion of ``since`` at ``step``: ``end`` at some step of the window, with ``hold`` after it; or its dual.

        The window is split into ranges that several steps share, so that few formulas are needed.
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

    def after(self, node: UntilNode, before: Node, stretch: range) -> Node:
        """Formula that ``end`` holds in the range ``stretch`` with ``hold`` after it, or that ``before`` holds with
        ``hold`` in the whole range; or its dual."""
        lasting = self.pair(node, (self.held(node, stretch), before), contrary=True)
        return self.pair(node, (self.within(node, stretch), lasting))

    def within(self, node: UntilNode, stretch: range) -> Node:
        """Formula that ``end`` holds at some step of a range with ``hold`` at the later steps, from the two halves of
        the range; or its dual."""
        if len(stretch) == 1:
            return self.at(node.end, stretch[0])
        key = node, stretch
        if key not in self.stretches:
            half = len(stretch) // 2
            self.stretches[key] = self.after(node, self.within(node, stretch[:half]), stretch[half:])
        return self.stretches[key]

    def held(self, node: UntilNode, steps: range) -> Node:
        """Formula that ``hold`` is true at all of these steps; or its dual."""
        key = node.hold, steps, node.every
        if key not in self.stretches:
            self.stretches[key] = self.each(node.hold, steps, not node.every)
        return self.stretches[key]

    def linked(self, node: NeighbourNode | ReachNode, agent: int, body: Node, step: int) -> Node:
        """Formula that ``agent`` is linked to the evaluated agent at the step and satisfies ``body``; or its dual."""
        key = (node.graph, agent, node.every)
        if key not in self.links:
            it = Is(frozenset((agent,)))
            self.links[key] = EveryNeighbour(node.graph, Not(it)) if node.every else Neighbour(node.graph, it)
        return self.pair(node, (self.at(self.links[key], step), At(agent, body, node.span)), contrary=True)

    def reach(self, node: ReachNode, step: int) -> Node:
        """Expansion of ``Reach`` at ``step``: routes without a link, then with one more link at a time; or its dual."""
        end, through = self.at(node.end, step), self.at(node.through, step)
        found = end
        for _ in range(min(node.hops, len(node.graph.agents) - 1)):
            onward = self.pair(node, tuple(self.linked(node, each, found, step) for each in node.graph.agents))
            found = self.pair(node, (end, self.pair(node, (through, onward), contrary=True)))
        return found
