"""The look-ahead and the relevance of kernel formulas: the steps each needs, the agents and steps it matters at."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import assert_never

import numpy as np

from missionc.base.trace import Flags
from missionc.ir import Graph
from missionc.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.kernel.walk import children, postorder


def steps_ahead(roots: Iterable[Node]) -> dict[Node, int]:
    """The look-ahead of every node, where the mission lasts long enough; a window to the end counts to where it begins.

    Source:
        [strel] Definition 5, with ``until``'s left side asked one step less far.
    """
    known: dict[Node, int] = {}
    for node in postorder(roots):
        match node:
            case Always(body, low, high) | Eventually(body, low, high):
                known[node] = low if high is None else high + known[body]
            case Until(hold, end, low, high) | Release(hold, end, low, high):
                ends = low if high is None else high + known[end]
                held = high - 1 + known[hold] if high else 0
                known[node] = max(ends, held)
            case _:
                known[node] = max((known[child] for child in children(node)), default=0)
    return known


def relevance(formulas: Iterable[Node], agents: int, last: int) -> Iterator[tuple[Node, Flags]]:
    """Every node of team formulas judged at step 0, and where it is asked, each node before those below it.

    Args:
        agents: how many the mission has.
        last: the mission's last step; windows end there.

    Returns:
        Pairs of a node and flags, (agents, steps + 1): whether its truth at the
        agent and the step can decide one of the formulas. Windows are nested as
        the formulas nest them. A spatial operator may look at every agent of
        its graph.

    Source:
        [clot] II-B, t ⊕ I in the recursive semantics.
    """
    at_start = np.zeros((agents, last + 1), dtype=np.bool_)
    at_start[:, 0] = True
    return relevance_below(dict.fromkeys(formulas, at_start))


def relevance_below(begin: Mapping[Node, Flags]) -> Iterator[tuple[Node, Flags]]:
    """``relevance`` of formulas that are asked at these agents and steps, (agents, steps + 1)."""
    asked = dict(begin)

    def ask(node: Node, where: Flags) -> None:
        asked[node] = asked[node] | where if node in asked else where

    for node in reversed(postorder(begin)):
        where = asked.pop(node)
        yield node, where
        match node:
            case Atom() | Is() | PathLength():
                pass
            case Not() | All() | Any() | AtLeast():
                for part in children(node):
                    ask(part, where)
            case Always(body, low, high) | Eventually(body, low, high):
                ask(body, _ahead(where, low, high))
            case Until(hold, end, low, high) | Release(hold, end, low, high):
                ask(hold, _before(where, high))
                ask(end, _ahead(where, low, high))
            case At(agent, body):
                ask(body, _at(where, range(len(where)), (agent,)))
            case Neighbour(graph, body) | EveryNeighbour(graph, body):
                ask(body, _of(where, graph))
            case Reach(graph) | EveryReach(graph) | Route(graph) | EveryRoute(graph):
                # A route without links ends where it begins, also outside the graph.
                ask(node.through, _of(where, graph))
                ask(node.end, _of(where, graph) | where)
            case _:
                assert_never(node)


def agents_asked(root: Node) -> dict[Node, set[int]]:
    """The agents that each formula may be asked of, where the root is asked of the first."""
    order = postorder((root,))
    asked: dict[Node, set[int]] = {node: set() for node in order}
    asked[root].add(0)
    for node in reversed(order):
        match node:
            case At(agent, body):
                asked[body].add(agent)
            case Neighbour(graph, body) | EveryNeighbour(graph, body):
                asked[body].update(graph.agents)
            case Reach(graph) | EveryReach(graph) | Route(graph) | EveryRoute(graph):
                asked[node.through].update(graph.agents)
                asked[node.end].update(graph.agents, asked[node])
            case _:
                for child in children(node):
                    asked[child] |= asked[node]
    return asked


def _ahead(where: Flags, low: int, high: int | None) -> Flags:
    """The steps from ``low`` to ``high`` ahead of these."""
    steps = where.shape[1]
    high = steps - 1 if high is None else high
    before = np.zeros((len(where), steps + 1), dtype=np.int64)
    np.cumsum(where, axis=1, out=before[:, 1:])
    step = np.arange(steps)
    latest, earliest = np.maximum(step - low + 1, 0), np.maximum(step - high, 0)
    ahead: Flags = before[:, latest] > before[:, np.minimum(earliest, latest)]
    return ahead


def _before(where: Flags, high: int | None) -> Flags:
    """The steps from these up to, not at, the last of a window."""
    ahead = _ahead(where, 0, None if high is None else high - 1)
    if high is None:
        ahead[:, -1] = False
    return ahead


def _of(where: Flags, graph: Graph) -> Flags:
    """At every agent of the graph, at the steps at which one of them is asked."""
    return _at(where, graph.agents, graph.agents)


def _at(where: Flags, asked: Iterable[int], agents: Iterable[int]) -> Flags:
    """At ``agents``, at the steps at which one of ``asked`` is."""
    moved = np.zeros_like(where)
    moved[list(agents)] = where[list(asked)].any(axis=0)
    return moved
