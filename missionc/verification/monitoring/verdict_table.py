"""Verdict table: every subformula at every agent and step, verdicts of goals over time, and causes of failure.

    in   formulas, their goals, Mission, Trace
    out  a Row for each of the formulas; Blame: each subformula's sign below its operator, and the agents and steps at
         which its falsity makes a goal false

A formula that is evaluated at many steps has its value at each of them. A formula that is evaluated at step 0 alone and
looks ahead has one verdict that emerges over time: at step t, the minimum and the maximum robustness that it can reach,
with the values of its windows up to t.

In negation normal form every operator is monotone: only a false operand can make it false. A goal therefore fails
through the false operands of its false operators, each at the agents and steps where its operator reads it.

Source:
    Deshmukh, Donzé, Ghosh, Jin, Juniwal, Seshia, "Robust online monitoring of signal temporal logic" (2017), robust
    satisfaction intervals. Formulas nested within a window count as known at its step.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import reduce

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Mission
from missionc.ir.kernel.analysis import relevance, relevance_below
from missionc.ir.kernel.evaluate import value_of
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Node, Not
from missionc.ir.kernel.walk import children, looks_back, postorder, window_of
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import ROBUSTNESS, TRUTH, Logic, Values


class Blame:
    """Causes of the failures of goals: the subformulas, agents and steps that make a goal false.

    Args:
        opposites: for formulas whose negation is below a goal, that negation.
    """

    def __init__(self, goals: Iterable[Node], mission: Mission, trace: Trace, opposites: Mapping[Node, Node]) -> None:
        self.opposites = opposites
        self.shape = trace.position.shape[:2]
        self._evaluation = Evaluation(TRUTH, mission, trace)
        self._below: dict[Node, frozenset[Node]] = {}
        self._failing: dict[Node, dict[Node, Flags]] = {}
        self.holds = {goal: bool(value[0, 0]) for goal, value in self._evaluation.values(tuple(goals)).items()}

    def sign(self, parent: Node, sign: int, child: Node) -> int:
        """Sign of a formula's effect on its parent: 1 if its truth helps, -1 if its falsity helps, 0 for both or
        neither.

        Args:
            sign: effect of the parent; 0 gives 0 for every child.
        """
        top = parent if sign >= 0 else self.opposites.get(parent, parent)
        if top not in self._below:
            order = postorder((top,))
            below = (child for node in order if not isinstance(node, Not) for child in children(node))
            self._below[top] = frozenset((top, *below))
        plain, denied = child in self._below[top], self.opposites.get(child) in self._below[top]
        return 0 if plain == denied or not sign else 1 if plain else -1

    def failing(self, goal: Node, formula: Node) -> Flags:
        """Agents and steps at which a formula, or its negation, makes a goal false.

        Shape: (agents, steps + 1), boolean.
        """
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


class Row(Record, eq=False):
    """Values of one formula over time: (agents, steps + 1) each, or (1, steps + 1) for the team.

    Args:
        asked: agents and steps at which the verdict of a goal reads it.
        least, most: its robustness, metres; if it ``unfolds``, the possible values at step 0.
        surely, possibly: its truth; if it ``unfolds``, certain and possible truth at step 0.
        unfolds: True if it has one verdict, at step 0. Otherwise ``least`` is ``most``, and ``surely`` is ``possibly``.
    """

    asked: Flags
    least: Array
    most: Array
    surely: Flags
    possibly: Flags
    unfolds: bool


def table(
    nodes: Iterable[Node], goals: Iterable[Node], mission: Mission, trace: Trace, opposites: Mapping[Node, Node]
) -> dict[Node, Row]:
    """Values of formulas over time, for a table of verdicts; a formula that is not below a goal is evaluated nowhere.

    Args:
        opposites: for formulas whose negation is below a goal, that negation, which counts as the formula.
    """
    wanted, roots = tuple(dict.fromkeys(nodes)), tuple(goals)
    verdict = chain(roots)
    known = {*wanted, *roots, *(child for node in verdict for child in children(node))}
    asked = asked_where(roots, known, trace, opposites)
    by_logic = []
    for logic in (TRUTH, ROBUSTNESS):
        evaluation = Evaluation(logic, mission, trace)
        values = evaluation.values(known)
        unfolded = _unfolded(evaluation, verdict, values)
        known_by_opposite = {n: _denied(unfolded[o], logic) for n, o in opposites.items() if o in unfolded}
        by_logic.append((values, known_by_opposite | unfolded))
    (truths, verdicts), (margins, bounds) = by_logic
    rows = {}
    for node in wanted:
        unfolds = node in verdicts and not asked[node][:, 1:].any()
        surely, possibly = verdicts[node] if unfolds else (truths[node], truths[node])
        least, most = bounds[node] if unfolds else (margins[node], margins[node])
        agents = max(len(truths[node]), len(surely))
        shape = (agents, trace.position.shape[1])
        where = asked[node] if agents > 1 else asked[node].any(axis=0, keepdims=True)
        whole = [np.broadcast_to(each, shape) for each in (where, least, most, surely, possibly)]
        rows[node] = Row(whole[0], whole[1], whole[2], whole[3], whole[4], unfolds)
    return rows


def _same_moment(node: Node) -> bool:
    """Return whether the node evaluates its operands at its own step, each for one agent."""
    return isinstance(node, All | Any | AtLeast | At)


def chain(roots: Iterable[Node]) -> list[Node]:
    """Formulas on the way from the verdict at step 0 down to the first windows, included; operands first.

    Past windows and windows below a spatial operator are excluded: there is nothing before step 0, and values at other
    agents count as known at once.
    """
    order = postorder(roots)
    timed: set[Node] = set()
    for node in order:
        ahead = window_of(node) is not None and not looks_back(node)
        if ahead or (_same_moment(node) and any(child in timed for child in children(node))):
            timed.add(node)
    reached = set(roots)
    for node in reversed(order):
        if node in reached and _same_moment(node):
            reached.update(children(node))
    return [node for node in order if node in reached and node in timed]


def _unfolded(
    evaluation: Evaluation, verdict: list[Node], values: Mapping[Node, Values]
) -> dict[Node, tuple[Values, Values]]:
    """Minimum and maximum robustness at step 0 that each formula of the chain can still reach, as known at every step.

    Shape: (…, steps + 1) each.
    """
    logic, steps = evaluation.logic, evaluation.steps
    bounds: dict[Node, tuple[Values, Values]] = {}
    for node in verdict:
        window = window_of(node)
        if window is not None:
            parts = [logic.negate(values[part]) if node.every else values[part] for part in children(node)]
            some = _at_some_step(parts, *window, steps, logic)
            bounds[node] = _denied(some, logic) if node.every else some
        else:
            below = [bounds.get(child) or (values[child][:, :1],) * 2 for child in children(node)]
            least, most = (value_of(node, [pair[side] for pair in below], evaluation) for side in (0, 1))
            bounds[node] = (least, most)
    return bounds


def _denied(bounds: tuple[Values, Values], logic: Logic) -> tuple[Values, Values]:
    """Bounds of a formula's negation, from the bounds of the formula."""
    least, most = bounds
    return logic.negate(most), logic.negate(least)


def _at_some_step(parts: list[Values], low: int, high: int | None, steps: int, logic: Logic) -> tuple[Values, Values]:
    """Bounds of "the last part holds at some step of a window, and the other parts until then", as known at every step.

    The minimum value is the value so far; until the window has passed, the maximum is the value of the hold condition.
    """
    *holds, end = np.broadcast_arrays(*parts, np.empty((1, steps)))[:-1]
    held = reduce(np.minimum, (np.minimum.accumulate(hold, axis=1) for hold in holds), np.full(end.shape, logic.top))
    before = np.concatenate([np.full((len(end), 1), logic.top), held[:, :-1]], axis=1)
    last = steps - 1 if high is None else min(high, steps - 1)
    least = np.full(end.shape, logic.bottom)
    if low <= last:
        least[:, low : last + 1] = np.maximum.accumulate(np.minimum(before, end)[:, low : last + 1], axis=1)
        least[:, last + 1 :] = least[:, last : last + 1]
    most = np.maximum(least, held)
    most[:, last:] = least[:, last:]
    return least, most


def asked_where(
    roots: Iterable[Node], known: Collection[Node], trace: Trace, opposites: Mapping[Node, Node]
) -> dict[Node, Flags]:
    """Agents and steps at which the verdicts of the roots at step 0 read each known formula.

    Args:
        opposites: negations of formulas that the roots may contain instead.

    Returns:
        Flags (agents, steps + 1) for each known formula.
    """
    agents, steps = trace.position.shape[:2]
    nowhere = np.zeros((agents, steps), dtype=np.bool_)
    wanted = {*known, *opposites.values()}
    masks = {node: where for node, where in relevance(roots, agents, steps - 1) if node in wanted}
    begin = {node: masks[opposite] for node, opposite in opposites.items() if opposite in masks}
    for node, where in relevance_below(begin):
        if node in known:
            masks[node] = masks.get(node, nowhere) | where
    return {node: masks.get(node, nowhere) for node in known}
