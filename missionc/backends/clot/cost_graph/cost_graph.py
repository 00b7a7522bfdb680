"""The kernel as a graph of terms that a planner can push on, its routes unrolled into links.

    in   Kernel
    out  CostGraph

Every term has a value for each candidate, agent and step: its space robustness,
positive where it holds. Which of the terms below must hold for it to hold is
plain from its kind, which is what makes the graph more useful to a planner
than the formula.

Source:
    [clot] IV-A.1, the tree of a formula; here a graph, for shared terms are one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias, assert_never

from missionc.base.source import Span
from missionc.ir import Connected, Graph, Predicate
from missionc.kernel import nodes as kernel
from missionc.kernel.walk import children as kernel_children
from missionc.kernel.walk import postorder as kernel_postorder


@dataclass(frozen=True, slots=True, eq=False)
class Margin:
    """A predicate's margin; negated where it must not hold."""

    predicate: Predicate
    holds: bool
    span: Span | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Member:
    """Holds at these agents and at no other; the other way round where ``among`` is False."""

    agents: frozenset[int]
    among: bool


@dataclass(frozen=True, slots=True, eq=False)
class Least:
    """All parts hold: the least of them; without limit where there are none."""

    parts: tuple[Term, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Greatest:
    """Some part holds: the greatest of them."""

    parts: tuple[Term, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Ranked:
    """``count`` of the parts hold: the ``count``-th largest."""

    count: int
    parts: tuple[Term, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LeastOver:
    """At every step from ``low`` to ``high`` ahead; ``high`` None is the mission's last step."""

    body: Term
    low: int
    high: int | None


@dataclass(frozen=True, slots=True, eq=False)
class GreatestOver:
    """At some step from ``low`` to ``high`` ahead; ``high`` None is the mission's last step."""

    body: Term
    low: int
    high: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Until:
    """``end`` at some step of the window, ``hold`` at every step before it."""

    hold: Term
    end: Term
    low: int
    high: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Release:
    """An ``Until`` that must not be: at each step of the window ``end``, or ``free`` at one before it."""

    free: Term
    end: Term
    low: int
    high: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Of:
    """At that agent."""

    agent: int
    body: Term


@dataclass(frozen=True, slots=True, eq=False)
class SomeLinked:
    """At some agent linked to this one: the greatest, over the others, of the lesser of link and body."""

    graph: Graph
    body: Term


@dataclass(frozen=True, slots=True, eq=False)
class EveryLinked:
    """At every agent linked to this one: the least, over the others, of the greater of no link and body."""

    graph: Graph
    body: Term


@dataclass(frozen=True, slots=True, eq=False)
class Length:
    """Some route of ``low`` to ``high`` metres over ``through`` agents ends at an ``end`` agent: the best of them.

    Where it must not be, ``holds`` is False and all is the other way round: every
    such route has a link that is not there, a ``through`` before its end or an
    ``end`` at it, or is too short or too long.
    """

    graph: Graph
    through: Term
    end: Term
    low: float
    high: float
    holds: bool


Term: TypeAlias = (
    "Margin | Member | Least | Greatest | Ranked | LeastOver | GreatestOver | Until | Release | Of | SomeLinked "
    "| EveryLinked | Length"
)


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """A requirement, or a preference by ``weight``, as a term that must hold at step 0."""

    name: str
    term: Term
    weight: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class CostGraph:
    """``order``: every term once, each after those below it."""

    requirements: tuple[Wanted, ...]
    preferences: tuple[Wanted, ...]
    order: tuple[Term, ...]


def below(term: Term) -> tuple[Term, ...]:
    """The terms directly below."""
    match term:
        case Margin() | Member():
            return ()
        case Least(parts) | Greatest(parts) | Ranked(_, parts):
            return parts
        case LeastOver(body) | GreatestOver(body) | Of(_, body) | SomeLinked(_, body) | EveryLinked(_, body):
            return (body,)
        case Until(first, second) | Release(first, second) | Length(_, first, second):
            return (first, second)
        case _:
            assert_never(term)


def postorder(roots: Iterable[Term]) -> tuple[Term, ...]:
    """Every term of these graphs once, each after the terms below it."""
    order: list[Term] = []
    seen: set[Term] = set()
    stack: list[tuple[Term, bool]] = [(root, False) for root in reversed(tuple(roots))]
    while stack:
        term, done = stack.pop()
        if done:
            order.append(term)
        elif term not in seen:
            seen.add(term)
            stack.append((term, True))
            stack.extend((part, False) for part in reversed(below(term)))
    return tuple(order)


def build(formulas: kernel.Kernel) -> CostGraph:
    """The cost graph of a mission's requirements and preferences."""
    goals = formulas.requirements + formulas.preferences
    known: dict[kernel.Node, Term] = {}
    for node in kernel_postorder(goal.formula for goal in goals):
        known[node] = _term(node, tuple(known[child] for child in kernel_children(node)))
    wanted = [Wanted(goal.name, known[goal.formula], goal.weight) for goal in goals]
    count = len(formulas.requirements)
    return CostGraph(tuple(wanted[:count]), tuple(wanted[count:]), postorder(each.term for each in wanted))


def _term(node: kernel.Node, parts: tuple[Term, ...]) -> Term:
    """The term of a formula, of those of the formulas below it."""
    match node:
        case kernel.Atom(predicate, span):
            return Margin(predicate, True, span)
        case kernel.Is(agents):
            return Member(agents, True)
        case kernel.Not(body):
            return _denied(body)
        case kernel.All() | kernel.Any() if (connected := _connected(node)) is not None:
            return Margin(connected, isinstance(node, kernel.All), node.span)
        case kernel.All() | kernel.Any():
            if len(parts) == 1:
                return parts[0]
            return Least(parts) if isinstance(node, kernel.All) else Greatest(parts)
        case kernel.AtLeast(count):
            return _ranked(count, parts)
        case kernel.Always(_, low, high):
            return LeastOver(parts[0], low, high)
        case kernel.Eventually(_, low, high):
            return GreatestOver(parts[0], low, high)
        case kernel.Until(_, _, low, high):
            return Until(parts[0], parts[1], low, high)
        case kernel.Release(_, _, low, high):
            return Release(parts[0], parts[1], low, high)
        case kernel.At(agent):
            return Of(agent, parts[0])
        case kernel.Neighbour(graph):
            return SomeLinked(graph, parts[0])
        case kernel.EveryNeighbour(graph):
            return EveryLinked(graph, parts[0])
        case kernel.Reach(graph, _, _, hops) | kernel.EveryReach(graph, _, _, hops):
            most = min(hops, max(len(graph.agents) - 1, 0))
            return _unrolled(graph, parts[0], parts[1], most, isinstance(node, kernel.Reach))
        case kernel.Route(graph, _, _, low_m, high_m) | kernel.EveryRoute(graph, _, _, low_m, high_m):
            return Length(graph, parts[0], parts[1], low_m, high_m, isinstance(node, kernel.Route))
        case kernel.PathLength(graph, agent, low_m, high_m):
            return _apart(graph, agent, low_m, high_m, True)
        case _:
            assert_never(node)


def _denied(leaf: kernel.Node) -> Term:
    match leaf:
        case kernel.Atom(predicate, span):
            return Margin(predicate, False, span)
        case kernel.Is(agents):
            return Member(agents, False)
        case kernel.PathLength(graph, agent, low, high):
            return _apart(graph, agent, low, high, False)
        case _:
            raise AssertionError("not in negation normal form")


def _connected(node: kernel.All | kernel.Any) -> Connected | None:
    """The predicate that a conjunction of routes amounts to: every member of a graph reaches one and the same of them.

    As one term it has a spanning tree to push on, and its value takes one pass instead of one for each link of a route.
    A disjunction of the duals of such routes denies it.
    """
    ends: set[int] = set()
    starts: set[int] = set()
    graph: Graph | None = None
    for part in node.parts:
        match part:
            case kernel.At(start, kernel.Reach(links, kernel.All(()), kernel.Is(agents), hops)) | kernel.At(
                start, kernel.EveryReach(links, kernel.Any(()), kernel.Not(kernel.Is(agents)), hops)
            ) if (
                len(agents) == 1
                and hops >= len(links.agents) - 1
                and graph in (None, links)
                and isinstance(part.body, kernel.Reach) is isinstance(node, kernel.All)
            ):
                graph = links
                starts.add(start)
                ends |= agents
            case _:
                return None
    if graph is None or len(ends) != 1 or starts | ends != set(graph.agents):
        return None
    return Connected(graph, graph.agents)


def _ranked(count: int, parts: tuple[Term, ...]) -> Term:
    if count <= 0:
        return Least(())
    if count > len(parts):
        return Greatest(())
    if count == len(parts):
        return Least(parts)
    return Greatest(parts) if count == 1 else Ranked(count, parts)


def _apart(graph: Graph, agent: int, low: float, high: float, holds: bool) -> Term:
    """The shortest way to an agent: some route is at most ``high`` long, and none is shorter than ``low``."""

    def way(most: float, holds: bool) -> Term:
        anyone: Term = Least(()) if holds else Greatest(())
        return Length(graph, anyone, Member(frozenset((agent,)), holds), 0.0, most, holds)

    near = way(high, holds)
    if low <= 0:
        return near
    far = way(math.nextafter(low, 0.0), not holds)
    return Least((near, far)) if holds else Greatest((near, far))


def _unrolled(graph: Graph, through: Term, end: Term, hops: int, holds: bool) -> Term:
    """A route of at most so many links, one link at a time. Walks do: with no lower bound they reach what routes do."""
    reached = end
    for _ in range(hops):
        further: Term = SomeLinked(graph, reached) if holds else EveryLinked(graph, reached)
        reached = Greatest((end, Least((through, further)))) if holds else Least((end, Greatest((through, further))))
    return reached
