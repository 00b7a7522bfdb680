"""Violations: the step that decides a false formula, and the agents it is decided at."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TypeAlias

from missionc.base.trace import Flags, Trace
from missionc.ir import Mission
from missionc.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    Atom,
    Node,
    Not,
    UntilNode,
    WindowNode,
)
from missionc.kernel.walk import asks, children, looks_back, postorder
from missionc.language.margins.predicate_margins import formation_margin
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.logic import TRUTH


@dataclass(frozen=True, slots=True)
class Decision:
    """The step at which a verdict is beyond change, and the agents (mission indices) it is about."""

    step: int
    agents: frozenset[int]


def first_violation(formula: Node, mission: Mission, trace: Trace) -> Decision:
    """Where a formula that is false at step 0 fails: as early as any step is sure to break it.

    An *always* fails at the first step that breaks its body, an *eventually* at
    the last step of its window. A spatial operator speaks of now, so its
    operands are not looked into.
    """
    order = postorder((formula,))
    truths = Evaluation(TRUTH, mission, trace).values(order)
    return _Search(truths, mission, trace).decided((formula, 0, 0))


Question: TypeAlias = tuple[Node, int, int]
"""What decides this node, at this agent and step."""

Inquiry: TypeAlias = Generator[Question, Decision, Decision]
"""Asks what it must know of the nodes below, and ends with its own decision; so no formula is too deep."""


class _Search:
    """Follows the verdict of a formula down to what decides it."""

    def __init__(self, truths: dict[Node, Flags], mission: Mission, trace: Trace) -> None:
        self.truths, self.mission, self.trace = truths, mission, trace
        self.last = trace.position.shape[1] - 1

    def decided(self, question: Question) -> Decision:
        known: dict[Question, Decision] = {}
        open_questions = [(question, self._inquiry(*question))]
        answer: Decision | None = None
        while open_questions:
            asked, inquiry = open_questions[-1]
            try:
                below = next(inquiry) if answer is None else inquiry.send(answer)
            except StopIteration as end:
                answer = known[asked] = end.value
                open_questions.pop()
                continue
            answer = known.get(below)
            if answer is None:
                open_questions.append((below, self._inquiry(*below)))
        return known[question]

    def truth(self, node: Node, agent: int, step: int) -> bool:
        values = self.truths[node]
        return bool(values[agent if len(values) > 1 else 0, step if values.shape[1] > 1 else 0])

    def _inquiry(self, node: Node, agent: int, step: int) -> Inquiry:
        verdict = self.truth(node, agent, step)
        match node:
            case Atom():
                return Decision(step, self._agents_of(node, agent, step))
            case Not(body):
                return (yield body, agent, step)
            case At(other, body):
                return (yield body, other, step)
            case All(parts) | Any(parts):
                return (yield from self._by_count(parts, agent, step, verdict, len(parts) if node.every else 1))
            case AtLeast(count, parts):
                return (yield from self._by_count(parts, agent, step, verdict, count))
            case WindowNode() | UntilNode():
                below = self._in_time(node, agent, step)
                return Decision(step, frozenset((agent,))) if below is None else (yield below)
            case _:
                return Decision(step, frozenset((agent,)))

    def _by_count(self, parts: tuple[Node, ...], agent: int, step: int, verdict: bool, count: int) -> Inquiry:
        """``count`` true parts decide for true, one too many false parts decide for false; the earliest do."""
        enough = count if verdict else len(parts) - count + 1
        if not 0 < enough <= len(parts):
            return Decision(step, frozenset())
        decisions: list[Decision] = []
        for part in parts:
            if self.truth(part, agent, step) is verdict:
                decision = yield part, agent, step
                decisions.append(decision)
        when = sorted(decision.step for decision in decisions)[enough - 1]
        return Decision(when, frozenset().union(*(each.agents for each in decisions if each.step <= when)))

    def _in_time(self, node: Node, agent: int, step: int) -> Question | None:
        """The first step with the verdict where one is enough, or before it one that breaks what has to hold up to it.

        Where it takes all steps of the window, the last. In reverse of one that looks back; None of one without steps.
        """
        verdict, back = self.truth(node, agent, step), looks_back(node)
        *holds, end = children(node)
        window = asks(node)[-1].steps_from(step, self.last)
        if not window:
            return None
        if verdict is not node.every:
            steps = reversed(window) if back else window
            return end, agent, next(now for now in steps if self.truth(end, agent, now) is verdict)
        for hold in holds:
            for now in range(step, window[0], -1) if back else range(step, window[-1]):
                if self.truth(hold, agent, now) is verdict:
                    return hold, agent, now
        return end, agent, window[-1]

    def _agents_of(self, atom: Atom, agent: int, step: int) -> frozenset[int]:
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
