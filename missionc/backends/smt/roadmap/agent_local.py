"""Agent-local formulas: those that one agent's state on its roadmap decides, and the states that satisfy them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce

import numpy as np

from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.trace import Flags
from missionc.ir.kernel.nodes import All, Any, Atom, Is, Node, Not
from missionc.ir.kernel.walk import children


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


def states_of(node: Node, agent: int, labels: Labels) -> Flags:
    """In which states, (states,), an agent's own state makes it true."""
    number = labels.roadmap_of[agent]
    shape = len(labels.roadmaps[number].position)
    match node:
        case Atom(predicate):
            return labels.states(predicate, number)
        case Is(members):
            return np.full(shape, agent in members)
        case Not(body):
            return ~states_of(body, agent, labels)
        case All() | Any():
            join = np.logical_and if node.every else np.logical_or
            return reduce(join, (states_of(part, agent, labels) for part in node.parts), np.full(shape, node.every))
        case _:
            raise AssertionError(node)
