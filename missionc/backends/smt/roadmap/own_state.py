"""Own-state formulas: those that one agent's state on its roadmap decides, and in which states they hold."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce

import numpy as np

from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.trace import Flags
from missionc.kernel.nodes import All, Any, Atom, Is, Node, Not
from missionc.kernel.walk import children, postorder


def own_state(node: Node, labels: Labels) -> bool:
    """Whether an agent's own state decides it."""
    return node in own_states(postorder((node,)), labels)


def own_states(order: Iterable[Node], labels: Labels) -> set[Node]:
    """The ones of these nodes, each after those below it, that an agent's own state decides."""
    own: set[Node] = set()
    for node in order:
        match node:
            case Atom(predicate):
                known = labels.of_places(predicate)
            case Is():
                known = True
            case Not() | All() | Any():
                known = all(part in own for part in children(node))
            case _:
                known = False
        if known:
            own.add(node)
    return own


def states_of(node: Node, agent: int, number: int, labels: Labels) -> Flags:
    """In which states, (states,), an agent's own state makes it true."""
    shape = len(labels.roadmaps[number].position)
    match node:
        case Atom(predicate):
            return labels.states(predicate, number)
        case Is(members):
            return np.full(shape, agent in members)
        case Not(body):
            return ~states_of(body, agent, number, labels)
        case All(parts):
            everywhere = np.ones(shape, dtype=np.bool_)
            return reduce(np.logical_and, (states_of(part, agent, number, labels) for part in parts), everywhere)
        case Any(parts):
            nowhere = np.zeros(shape, dtype=np.bool_)
            return reduce(np.logical_or, (states_of(part, agent, number, labels) for part in parts), nowhere)
        case _:
            raise AssertionError(node)
