"""The look-ahead and the relevance of kernel formulas: the steps each needs, the agents and steps it matters at."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from missionc.base.trace import Flags
from missionc.kernel.nodes import Node
from missionc.kernel.walk import Ask, asks, postorder


def steps_ahead(roots: Iterable[Node]) -> dict[Node, int]:
    """The look-ahead of every node, where the mission lasts long enough; a window to the end counts to where it begins.

    Source:
        [strel] Definition 5.
    """
    known: dict[Node, int] = {}
    for node in postorder(roots):
        known[node] = max(
            (ask.low if ask.high is None else ask.high + known[ask.node] for ask in asks(node)), default=0
        )
    return known


def agents_asked(root: Node) -> dict[Node, set[int]]:
    """The agents that each formula may be asked of, where the root is asked of the first."""
    order = postorder((root,))
    asked: dict[Node, set[int]] = {node: set() for node in order}
    asked[root].add(0)
    for node in reversed(order):
        for ask in asks(node):
            asked[ask.node].update(ask.agents, asked[node] if ask.of_itself else ())
    return asked


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
    for node in reversed(postorder(begin)):
        where = asked.pop(node)
        yield node, where
        for ask in asks(node):
            there = _asked_there(ask, where)
            asked[ask.node] = asked[ask.node] | there if ask.node in asked else there


def _asked_there(ask: Ask, where: Flags) -> Flags:
    """Where a node is asked by one that is asked at these agents and steps: (agents, steps + 1)."""
    there = where if ask.of_itself else np.zeros_like(where)
    if ask.agents:
        there = there.copy()
        there[list(ask.agents)] |= (where[list(ask.agents)] if ask.linked else where).any(axis=0)
    return there if (ask.low, ask.high) == (0, 0) else _ahead(there, ask)


def _ahead(where: Flags, ask: Ask) -> Flags:
    """The steps of the window ahead of these."""
    steps = where.shape[1]
    high = steps - 1 if ask.high is None else ask.high
    before = np.zeros((len(where), steps + 1), dtype=np.int64)
    np.cumsum(where, axis=1, out=before[:, 1:])
    step = np.arange(steps)
    latest, earliest = np.maximum(step - ask.low + 1, 0), np.maximum(step - high, 0)
    ahead: Flags = before[:, latest] > before[:, np.minimum(earliest, latest)]
    if ask.before_last:
        ahead[:, -1] = False
    return ahead
