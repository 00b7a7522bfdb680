"""Exclusions: mutual exclusion and capacity requirements, which couple agents only when they need the same region.

    in   conjuncts of the requirements; the reservations of planned agents
    out  allowed states of an agent at each step, given the planned agents

``always[0, end] not (at least 2 truck: bridge)`` names every truck, but each truck can be planned separately, one after
the other. Planned agents follow their trajectories, and all others count as absent (a relaxation). A schedule of clot
uses literals over time intervals instead (``mutex_literals``), since it has no agent states yet.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce

import numpy as np

from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.roadmap.labels import Labels, own_states, states_of
from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags
from missionc.ir.kernel.conjuncts import Conjunct
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Node
from missionc.ir.kernel.walk import children, postorder, rebuilt


class Exclusion(Record, eq=False):
    """Team formula that requires each agent to avoid some states unless enough other agents avoid their states.

    Args:
        conjunct: formula of the team, with its steps.
        own: its nodes that one agent's own state decides.
        named: agents that it restricts.
    """

    conjunct: Conjunct
    own: frozenset[Node]
    named: frozenset[int]
    labels: Labels

    @staticmethod
    def of(conjunct: Conjunct, labels: Labels) -> Exclusion | None:
        """Conjunct as an exclusion; None if the conjunct has another form."""
        elsewhere = 0.5  # share of states with a property, from which the requirement is to avoid the remaining states
        own = frozenset(own_states(postorder((conjunct.formula,)), labels))
        leaves = _leaves(conjunct, own)
        named = frozenset(who for who, _ in leaves)
        if conjunct.steps is None or len(named) < 2:
            return None
        away = all(states_of(node, who, labels).mean() >= elsewhere for who, node in leaves)
        return Exclusion(conjunct, own, named, labels) if away else None

    def allows(self, agent: int, reservations: Reservations) -> Flags:
        """Allowed states of the agent beside the planned agents, (steps + 1, states), or one row for all steps.

        A state must be allowed one step before and after too: between two steps, no two agents exchange their
        positions.
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
        """Requirement on the present agents if all others avoid the states; None if nothing is required."""
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
    """Agents and nodes about their own states; empty if the conjunct has other parts."""
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
    """Allowed states of an agent, (steps + 1, states), within ``may``, for which all exclusions are satisfied."""
    bound = [each for each in exclusions if agent in each.named]
    if not bound:
        return may
    may = may.copy()
    for each in bound:
        may[each.conjunct.steps] &= np.broadcast_to(each.allows(agent, reservations), may.shape)[each.conjunct.steps]
    return may
