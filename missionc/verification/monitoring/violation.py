"""Violations of a formula: the step at which it becomes irrevocably false, and the agents concerned."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Flags, Trace
from missionc.ir import Mission, Predicate
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import asks, children, looks_back, postorder
from missionc.ir.language.margins.predicate_margins import formation_margin
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import TRUTH, Values


class Decision(Record):
    """Step at which a verdict becomes final, and the agents (mission indices) concerned."""

    step: int
    agents: frozenset[int]


def first_violation(formula: k.Node, mission: Mission, trace: Trace) -> Decision:
    """Step after which no continuation can make a formula true that is false at step 0, and the agents concerned.

    An *always* is violated at the first step that violates its body, an *eventually* at the last step of its window.
    For a spatial operator, the operands decide the step, but the reported agent is the evaluated agent.
    """
    hopeful = _Hopeful(mission, trace)
    step = bisect_left(
        range(trace.position.shape[1] - 1), True, key=lambda now: not hopeful.after(now, (formula,))[formula][0, 0]
    )
    return Decision(step, _Search(hopeful.after(step, postorder((formula,))), mission, trace).agents(formula))


class _Hopeful(Evaluation):
    """Evaluation of truth that assumes every leaf and link to become favourable after some step, if it can still
    change.

    In negation normal form, truth is monotone in the leaves: a formula that is false here stays false.
    """

    def __init__(self, mission: Mission, trace: Trace) -> None:
        super().__init__(TRUTH, mission, trace)
        self.hopeful = np.zeros(self.steps, dtype=np.bool_)

    def after(self, now: int, formulas: Iterable[k.Node]) -> dict[k.Node, Values]:
        """Truth of the formulas if the assumption applies after the step ``now``."""
        self.hopeful = np.arange(self.steps) > now
        return self.values(formulas)

    def atom(self, predicate: Predicate, holds: bool) -> Values:
        found = super().atom(predicate, holds)
        changes = predicate.others or predicate.reads_past or predicate.reads_oneself(self.mission.dimension)
        return found | self.hopeful if changes else found

    def path_length(self, node: k.PathLength, holds: bool) -> Values:
        return super().path_length(node, holds) | self.hopeful

    def neighbour(self, node: k.NeighbourNode, body: Values) -> Values:
        return super().neighbour(node, body) | self.hopeful

    def reach(self, node: k.ReachNode, through: Values, end: Values) -> Values:
        return super().reach(node, through, end) | self.hopeful

    def route(self, node: k.RouteNode, through: Values, end: Values) -> Values:
        return super().route(node, through, end) | self.hopeful


class _Search:
    """Search from a false formula down to the agents that violate it."""

    def __init__(self, truths: dict[k.Node, Flags], mission: Mission, trace: Trace) -> None:
        self.truths, self.mission, self.trace = truths, mission, trace
        self.last = trace.position.shape[1] - 1

    def agents(self, formula: k.Node) -> frozenset[int]:
        """Agents of all violated subformulas of a formula that is false for the first agent at step 0."""
        found: set[int] = set()
        asked: dict[tuple[k.Node, int, int], None] = {(formula, 0, 0): None}
        waiting = list(asked)
        while waiting:
            node, agent, step = waiting.pop()
            below = self._below(node, agent, step)
            if below is None:
                found |= self._agents_of(node, agent, step) if isinstance(node, k.Atom) else {agent}
                continue
            fresh = [each for each in below if each not in asked]
            asked.update(dict.fromkeys(fresh))
            waiting += fresh
        return frozenset(found)

    def is_lost(self, node: k.Node, agent: int, step: int) -> bool:
        values = self.truths[node]
        return not values[agent if len(values) > 1 else 0, step if values.shape[1] > 1 else 0]

    def _below(self, node: k.Node, agent: int, step: int) -> list[tuple[k.Node, int, int]] | None:
        """Violated children of a false formula, each with its agent and step.

        None if the formula itself is violated.
        """
        match node:
            case k.Not(body) if isinstance(body, k.Atom):
                return [(body, agent, step)]
            case k.At(other, body):
                return [(body, other, step)]
            case k.All(parts) | k.Any(parts) | k.AtLeast(_, parts):
                return [(part, agent, step) for part in parts if self.is_lost(part, agent, step)]
            case k.WindowNode() | k.UntilNode():
                return self._in_time(node, agent, step)
            case _:
                return None

    def _in_time(self, node: k.WindowNode | k.UntilNode, agent: int, step: int) -> list[tuple[k.Node, int, int]] | None:
        """The violated child of a temporal operator, with its agent and step.

        If one failing step suffices, it is the first of the window, or an earlier step that violates the hold
        condition. If all steps of the window must fail, it is the last. For past windows the order is reversed.
        """
        *holds, end = children(node)
        window = asks(node)[-1].steps_from(step, self.last)
        if not window:
            return None
        steps, before = window, range(step, self.last)
        if looks_back(node):
            steps, before = window[::-1], range(step, window[0], -1)
        if node.every:
            return [(end, agent, next(now for now in steps if self.is_lost(end, agent, now)))]
        for hold in holds:
            for now in before:
                if self.is_lost(hold, agent, now):
                    return [(hold, agent, now)]
        return [(end, agent, steps[-1])]

    def _agents_of(self, atom: k.Atom, agent: int, step: int) -> frozenset[int]:
        formation = atom.predicate.formation
        if formation is None:
            named = frozenset(end for pair in atom.predicate.pairs for end in pair)
            return named or frozenset((agent,))
        position = self.trace.position[:, step]
        margins = {
            edge: float(formation_margin(formation, edge, position[edge.first], position[edge.second]))
            for edge in formation.edges
        }
        worst = min(margins.values(), default=0.0)
        broken = [edge for edge, margin in margins.items() if margin < 0 or margin == worst]
        return frozenset(end for edge in broken for end in (edge.first, edge.second))
