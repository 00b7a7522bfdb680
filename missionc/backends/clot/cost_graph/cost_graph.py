"""The kernel as a graph of terms that a planner can push on: negations at the leaves, routes unrolled into links.

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
    known = _terms([goal.formula for goal in goals])
    wanted = [Wanted(goal.name, known[goal.formula, True], goal.weight) for goal in goals]
    count = len(formulas.requirements)
    return CostGraph(tuple(wanted[:count]), tuple(wanted[count:]), postorder(each.term for each in wanted))


def _terms(roots: list[kernel.Node]) -> dict[tuple[kernel.Node, bool], Term]:
    """The term of each formula below the roots, in the polarities that are needed of it."""
    needed: dict[kernel.Node, set[bool]] = {root: {True} for root in roots}
    order = kernel_postorder(roots)
    for node in reversed(order):
        for child in kernel_children(node):
            signs = needed[node]
            needed.setdefault(child, set()).update(
                {not sign for sign in signs} if isinstance(node, kernel.Not) else signs
            )
    known: dict[tuple[kernel.Node, bool], Term] = {}
    for node in order:
        for sign in needed[node]:
            known[node, sign] = _term(node, sign, known)
    return known


def _term(node: kernel.Node, holds: bool, known: dict[tuple[kernel.Node, bool], Term]) -> Term:
    def of(child: kernel.Node) -> Term:
        return known[child, holds]

    match node:
        case kernel.Atom(predicate, span):
            return Margin(predicate, holds, span)
        case kernel.Is(agents):
            return Member(agents, holds)
        case kernel.Not(body):
            return known[body, not holds]
        case kernel.All() if (connected := _connected(node)) is not None:
            return Margin(connected, holds, node.span)
        case kernel.All(parts) | kernel.Any(parts):
            terms = tuple(of(part) for part in parts)
            if len(terms) == 1:
                return terms[0]
            return Least(terms) if isinstance(node, kernel.All) == holds else Greatest(terms)
        case kernel.AtLeast(count, parts):
            return _ranked(count if holds else len(parts) - count + 1, tuple(of(part) for part in parts))
        case kernel.Always(body, low, high):
            return LeastOver(of(body), low, high) if holds else GreatestOver(of(body), low, high)
        case kernel.Eventually(body, low, high):
            return GreatestOver(of(body), low, high) if holds else LeastOver(of(body), low, high)
        case kernel.Until(hold, end, low, high):
            return (Until if holds else Release)(of(hold), of(end), low, high)
        case kernel.At(agent, body):
            return Of(agent, of(body))
        case kernel.Neighbour(graph, body):
            return SomeLinked(graph, of(body)) if holds else EveryLinked(graph, of(body))
        case kernel.Reach(graph, through, end, hops):
            return _unrolled(graph, of(through), of(end), min(hops, max(len(graph.agents) - 1, 0)), holds)
        case kernel.Route(graph, through, end, low, high):
            return Length(graph, of(through), of(end), low, high, holds)
        case kernel.PathLength(graph, agent, low, high):
            return _apart(graph, agent, low, high, holds)
        case _:
            assert_never(node)


def _connected(node: kernel.All) -> Connected | None:
    """The predicate that a conjunction of routes amounts to: every member of a graph reaches one and the same of them.

    As one term it has a spanning tree to push on, and its value takes one pass instead of one for each link of a route.
    """
    ends: set[int] = set()
    starts: set[int] = set()
    graph: Graph | None = None
    for part in node.parts:
        match part:
            case kernel.At(start, kernel.Reach(links, kernel.All(()), kernel.Is(agents), hops)) if (
                len(agents) == 1 and hops >= len(links.agents) - 1 and graph in (None, links)
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
