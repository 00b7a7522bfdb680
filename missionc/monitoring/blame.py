"""Blame: which values of a goal's subformulas speak for the goal, and which make it fail.

in   the goals, Mission, Trace
out  Blame: each subformula's sign below its operator, and where its falsity makes a goal false

In negation normal form every operator is monotone: only a false operand can make it false. So a goal fails through the
false operands of its false operands, each where its operator looks at it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from missionc.base.trace import Flags, Trace
from missionc.ir import Mission
from missionc.kernel.analysis import relevance_below
from missionc.kernel.nodes import Node, Not
from missionc.kernel.walk import children, postorder
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.logic import TRUTH


class Blame:
    """The failures of some goals.

    Args:
        opposites: of formulas whose negation is below a goal, that negation.
    """

    def __init__(self, goals: Iterable[Node], mission: Mission, trace: Trace, opposites: Mapping[Node, Node]) -> None:
        self.opposites = opposites
        self.shape = trace.position.shape[:2]
        self._evaluation = Evaluation(TRUTH, mission, trace)
        self._below: dict[Node, frozenset[Node]] = {}
        self._failing: dict[Node, dict[Node, Flags]] = {}
        self.holds = {goal: bool(value[0, 0]) for goal, value in self._evaluation.values(tuple(goals)).items()}

    def sign(self, parent: Node, sign: int, child: Node) -> int:
        """How a formula counts below another: 1 by its truth, -1 by its falsity, 0 by both or neither.

        Args:
            sign: how the other counts; below one that counts both ways everything does.
        """
        top = parent if sign >= 0 else self.opposites.get(parent, parent)
        if top not in self._below:
            order = postorder((top,))
            below = (child for node in order if not isinstance(node, Not) for child in children(node))
            self._below[top] = frozenset((top, *below))
        plain, denied = child in self._below[top], self.opposites.get(child) in self._below[top]
        return 0 if plain == denied or not sign else 1 if plain else -1

    def failing(self, goal: Node, formula: Node) -> Flags:
        """Where a formula, or its negation where that is asked for, makes a goal false: (agents, steps + 1)."""
        where = self._failures(goal)
        none = np.zeros(self.shape, dtype=np.bool_)
        denied = self.opposites.get(formula)
        found: Flags = where.get(formula, none) | (where.get(denied, none) if denied is not None else none)
        return found

    def _failures(self, goal: Node) -> dict[Node, Flags]:
        if self.holds[goal]:
            return {}
        if goal not in self._failing:
            values = self._evaluation.values(postorder((goal,)))
            false = {node: np.broadcast_to(np.logical_not(value), self.shape) for node, value in values.items()}
            begin = np.zeros(self.shape, dtype=np.bool_)
            begin[:, 0] = True
            self._failing[goal] = dict(relevance_below({goal: begin}, false))
        return self._failing[goal]
