"""Exclusions: mutual exclusion and capacities, which bind agents to each other only while they want the same place.

    in   conjuncts of the requirements; the reservations of who is settled
    out  where an agent may be at each step beside the settled

``always[0, end] not (at least 2 truck: bridge)`` names every truck, and yet each can be planned by itself, one after
the other: who is settled is where it is, and whoever is not is taken to be elsewhere (a relaxation). A schedule of
clot excludes by literals over intervals of time instead (``mutex_literals``): it has no states of agents yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.base.trace import Flags
from missionc.ir.kernel.conjuncts import Conjunct
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Node
from missionc.ir.kernel.walk import children, postorder, rebuilt


@dataclass(frozen=True, slots=True, eq=False)
class Exclusion:
    """A team formula that asks each of its agents to keep away from some states, unless enough others do.

    Args:
        conjunct: what must hold of the team, and at which steps.
        own: the nodes in it that one agent's own state decides.
        named: the agents that it asks something of.
    """

    conjunct: Conjunct
    own: frozenset[Node]
    named: frozenset[int]
    labels: Labels

    @staticmethod
    def of(conjunct: Conjunct, labels: Labels) -> Exclusion | None:
        """The conjunct as an exclusion; None where it is something else."""
        elsewhere = 0.5  # share of the states with a property, from which the requirement is to keep away from the rest
        own = frozenset(own_states(postorder((conjunct.formula,)), labels))
        leaves = _leaves(conjunct, own)
        named = frozenset(who for who, _ in leaves)
        if conjunct.steps is None or len(named) < 2:
            return None
        away = all(states_of(node, who, labels).mean() >= elsewhere for who, node in leaves)
        return Exclusion(conjunct, own, named, labels) if away else None

    def allows(self, agent: int, reservations: Reservations) -> Flags:
        """Where the agent may be beside the settled, (steps + 1, states), or one row for all steps.

        It may be there a step before and after, too: between two steps nobody changes places with another.
        """
        now = self._holds(self.conjunct.formula, self.conjunct.agent, agent, reservations)
        before, after = np.concatenate([now[:1], now[:-1]]), np.concatenate([now[1:], now[-1:]])
        return np.asarray(now & before & after)

    def _holds(self, node: Node, who: int | None, agent: int, reservations: Reservations) -> Flags:
        if node in self.own and who is not None:
            if who == agent:
                return states_of(node, who, self.labels)[None, :]
            if who in reservations.agents:
                return np.asarray(states_of(node, who, self.labels)[reservations.states[who]])[:, None]
            return np.ones((1, 1), dtype=np.bool_)
        if isinstance(node, At):
            return self._holds(node.body, node.agent, agent, reservations)
        parts = [self._holds(part, who, agent, reservations) for part in children(node)]
        if isinstance(node, AtLeast):
            return np.asarray(sum(part.astype(np.int64) for part in parts) >= node.count)
        return reduce(np.logical_and if node.every else np.logical_or, parts)

    def among(self, present: frozenset[int]) -> Node | None:
        """What it asks of those who are there while all others keep away; None for nothing."""
        node, who = self.conjunct.formula, self.conjunct.agent
        asked = self._among(node, who, present)
        return asked if asked is None or who is None else At(who, asked, node.span)

    def _among(self, node: Node, who: int | None, present: frozenset[int]) -> Node | None:
        if node in self.own and who is not None:
            return node if who in present else None
        if isinstance(node, At):
            body = self._among(node.body, node.agent, present)
            return None if body is None else rebuilt(node, (body,))
        parts = [self._among(part, who, present) for part in children(node)]
        left = tuple(part for part in parts if part is not None)
        if isinstance(node, AtLeast):
            count = node.count - (len(parts) - len(left))
            return AtLeast(count, left, node.span) if count > 0 else None
        if isinstance(node, Any) and len(left) < len(parts):
            return None
        return rebuilt(node, left) if left else None


def _leaves(conjunct: Conjunct, own: frozenset[Node]) -> list[tuple[int, Node]]:
    """Who is asked something about where it is itself; nobody where anything else is said."""
    leaves: list[tuple[int, Node]] = []
    stack = [(conjunct.agent, conjunct.formula)]
    while stack:
        who, node = stack.pop()
        match node:
            case At(agent, body):
                stack.append((agent, body))
            case _ if node in own and who is not None:
                leaves.append((who, node))
            case All() | Any() | AtLeast():
                stack.extend((who, part) for part in node.parts)
            case _:
                return []
    return leaves


def may_be(exclusions: Sequence[Exclusion], agent: int, reservations: Reservations, may: Flags) -> Flags:
    """Where an agent may be, (steps + 1, states), of where it may be for all else, so that all exclusions hold."""
    bound = [each for each in exclusions if agent in each.named]
    if not bound:
        return may
    may = may.copy()
    for each in bound:
        may[each.conjunct.steps] &= np.broadcast_to(each.allows(agent, reservations), may.shape)[each.conjunct.steps]
    return may
