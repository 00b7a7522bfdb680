"""Analysis of kernel formulas: look-ahead, relevant agents and steps, and the agents of each formula."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import reduce

import numpy as np

from missionc.base.trace import Flags
from missionc.ir import Graph, Predicate
from missionc.ir.kernel.nodes import (
    At,
    Atom,
    Is,
    LinkNode,
    NeighbourNode,
    Node,
    Not,
    PathLength,
    ReachNode,
    RouteNode,
)
from missionc.ir.kernel.walk import Ask, asks, bottom_up, children, postorder


def steps_ahead(
    roots: Iterable[Node], to_end: int = 0, of_predicate: Callable[[Predicate], int] = lambda _: 0
) -> dict[Node, int]:
    """Look-ahead of every node, in steps: how far after the evaluated step the node may read states.

    Args:
        to_end: look-ahead that a window to the mission's end counts, besides its lower bound.
        of_predicate: look-ahead of a predicate, in steps.

    Source:
        [strel] Definition 5.
    """
    known: dict[Node, int] = {}
    for node in postorder(roots):
        if isinstance(node, Atom):
            known[node] = of_predicate(node.predicate)
        else:
            looks = (ask.low + to_end if ask.high is None else ask.high + known[ask.node] for ask in asks(node))
            known[node] = max([0, *looks])  # at least the step of evaluation itself, also for a node that looks back
    return known


def robustness_unit(root: Node) -> str:
    """Unit of a formula's robustness: ``m``; ``m/s`` if the formula compares only speeds; empty if units differ."""
    units = {node.predicate.unit for node in postorder((root,)) if isinstance(node, Atom)} or {"m"}
    return units.pop() if len(units) == 1 else ""


def agents_asked(root: Node) -> dict[Node, set[int]]:
    """For each node, the agents for which the node may be evaluated, if the root is evaluated for agent 0."""
    order = postorder((root,))
    asked: dict[Node, set[int]] = {node: set() for node in order}
    asked[root].add(0)
    for node in reversed(order):
        for ask in asks(node):
            asked[ask.node].update(ask.agents, asked[node] if ask.of_itself else ())
    return asked


def remembering(roots: Iterable[Node]) -> set[int]:
    """Agents for which a predicate of the past (one that depends on earlier steps) may be evaluated."""
    roots = tuple(roots)
    past = {node for node in postorder(roots) if isinstance(node, Atom) and node.predicate.reads_past}
    if not past:
        return set()
    asked = ((node, agents) for root in roots for node, agents in agents_asked(root).items())
    return {agent for node, agents in asked if node in past for agent in agents}


def reads_lengths(node: Node) -> bool:
    """Return true if a node, or the node below its negation, constrains route lengths in metres."""
    return isinstance(node.body if isinstance(node, Not) else node, RouteNode | PathLength)


def linked_by(roots: Iterable[Node]) -> tuple[Graph, ...]:
    """Graphs whose links (not route lengths in metres) the formulas read, without repetition."""
    nodes = (node for node in postorder(roots) if isinstance(node, NeighbourNode | ReachNode))
    return tuple(dict.fromkeys(node.graph for node in nodes))


def helped_by_more(roots: Iterable[Node]) -> dict[Node, bool]:
    """For each node, true if additional agents can make the node true but never false."""

    def is_helped(node: Node, below: tuple[bool, ...]) -> bool:
        hindered = reads_lengths(node) or (isinstance(node, NeighbourNode | ReachNode) and node.every)
        return not hindered and all(below)

    return bottom_up(roots, is_helped)


def same_for_all(roots: Iterable[Node]) -> dict[Node, bool]:
    """For each node, true if its truth does not depend on the agent for which it is evaluated."""

    def is_same(node: Node, below: tuple[bool, ...]) -> bool:
        match node:
            case Atom(predicate):
                return predicate.about_team
            case At():
                return True
            case _:
                return not isinstance(node, Is | LinkNode) and all(below)

    return bottom_up(roots, is_same)


def about_whom(roots: Iterable[Node], agents: int) -> dict[Node, Flags]:
    """Agents whose trajectories may influence each node.

    Args:
        agents: number of agents of the mission.

    Returns:
        (agents, agents), boolean: entry [i, j] is true if agent i's trajectory may matter to the node evaluated for
            agent j.
    """
    known: dict[Node, Flags] = {}
    # Equal results share one array: each node has a flag for every pair of agents.
    nobody, itself = np.zeros((agents, agents), dtype=np.bool_), np.eye(agents, dtype=np.bool_)
    for node in postorder(roots):
        below = [known[child] for child in children(node)]
        about: Flags = reduce(np.logical_or, below) if below else nobody
        match node:
            case Atom(predicate) if predicate.about_team or predicate.others:
                about = itself.copy()
                about[list(range(agents) if predicate.about_team else predicate.others)] = True
            case Atom():
                about = itself
            case At(agent):
                about = np.broadcast_to(about[:, [agent]], nobody.shape)
            case ReachNode(graph) | RouteNode(graph):
                about = below[1] | _among(graph, about)
            case NeighbourNode(graph) | PathLength(graph):
                about = _among(graph, about)
            case _:
                pass
        known[node] = about
    return known


def _among(graph: Graph, about: Flags) -> Flags:
    """Extension of ``about`` to all members of a graph: every member is influenced by all members and by all agents
    that influence a member.

    Shape: (agents, agents), boolean, as in ``about_whom``.
    """
    members = list(graph.agents)
    mover = np.asarray(about[:, members].any(axis=1))
    mover[members] = True
    found = np.zeros_like(about)
    found[:, members] = mover[:, None]
    return found


def relevance(formulas: Iterable[Node], agents: int, last: int) -> Iterator[tuple[Node, Flags]]:
    """Yield every node of team formulas that are evaluated at step 0, with the agents and steps that matter, parents
    first.

    Args:
        agents: number of agents of the mission.
        last: the mission's last step; windows end there.

    Returns:
        Pairs of a node and flags, (agents, steps + 1), boolean: true if the node's truth for that agent at that step
        can decide a formula. A spatial operator may read every agent of its graph.

    Source:
        [clot] II-B, t ⊕ I in the recursive semantics.
    """
    at_start = np.zeros((agents, last + 1), dtype=np.bool_)
    at_start[:, 0] = True
    return relevance_below(dict.fromkeys(formulas, at_start))


def relevance_below(
    begin: Mapping[Node, Flags], within: Mapping[Node, Flags] | None = None
) -> Iterator[tuple[Node, Flags]]:
    """Yield every node with the agents and steps that matter, for formulas evaluated at the agents and steps ``begin``.

    Args:
        begin: agents and steps of each root, (agents, steps + 1), boolean.
        within: agents and steps to which each node is restricted, (agents, steps + 1), boolean; None for no
            restriction.
    """
    asked = dict(begin)
    nowhere = np.zeros_like(next(iter(begin.values()), np.zeros(0, dtype=np.bool_)))
    for node in reversed(postorder(begin)):
        where = asked.pop(node, nowhere)
        if within is not None:
            where = where & within[node]
        yield node, where
        for ask in asks(node):
            there = _asked_there(ask, where)
            asked[ask.node] = asked[ask.node] | there if ask.node in asked else there


def _asked_there(ask: Ask, where: Flags) -> Flags:
    """Agents and steps at which a node evaluates its child, from the agents and steps of the node.

    Shape: (agents, steps + 1), boolean.
    """
    there = where if ask.of_itself else np.zeros_like(where)
    if ask.agents:
        there = there.copy()
        there[list(ask.agents)] |= (where[list(ask.agents)] if ask.linked else where).any(axis=0)
    return there if (ask.low, ask.high) == (0, 0) else _ahead(there, ask)


def _ahead(where: Flags, ask: Ask) -> Flags:
    """Steps inside the window of ``ask`` ahead of the flagged steps: (agents, steps + 1), boolean."""
    steps = where.shape[1]
    high = steps - 1 if ask.high is None else ask.high
    before = np.zeros((len(where), steps + 1), dtype=np.int64)
    np.cumsum(where, axis=1, out=before[:, 1:])
    step = np.arange(steps)
    latest, earliest = (np.clip(edge, 0, steps) for edge in (step - ask.low + 1, step - high))
    ahead: Flags = before[:, latest] > before[:, np.minimum(earliest, latest)]
    if ask.before_last:
        ahead[:, -1] = False
    return ahead
