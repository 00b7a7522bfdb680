"""Runtime monitoring of a trace: satisfaction, robustness, and first violation of every requirement.

The results are independent of the backends: they follow from the kernel formula and the trace alone.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from missionc.base.trace import Array, Flags, Judgement, Judgements, Trace
from missionc.ir import Mission
from missionc.ir.kernel.analysis import robustness_unit
from missionc.ir.kernel.nodes import Goal, Kernel, Node
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import ROBUSTNESS, TRUTH, Logic, Values
from missionc.verification.monitoring.violation import first_violation


def monitor(mission: Mission, kernel: Kernel, trace: Trace) -> Judgements:
    """Judgement of every requirement and every preference at step 0: satisfaction, robustness and first violation.

    Raises:
        ValueError: the trace has different agents from the mission, or fewer steps.
    """
    if trace.position.shape[1] <= mission.steps:
        raise ValueError(f"the trace has {trace.position.shape[1]} states, the mission {mission.steps + 1}")
    truths = Evaluation(TRUTH, mission, trace).values(kernel.formulas)
    robustness = Evaluation(ROBUSTNESS, mission, trace).values(kernel.formulas)

    def judged(goal: Goal) -> Judgement:
        of = goal.formula
        return _judged(goal, bool(truths[of][0, 0]), float(robustness[of][0, 0]), mission, trace)

    return Judgements(tuple(map(judged, kernel.requirements)), tuple(map(judged, kernel.preferences)))


def least_robustness(mission: Mission, kernel: Kernel, trace: Trace) -> float:
    """Smallest robustness over all requirements, each in its own unit.

    Requirements that no motion can change are left out; ``inf`` if none remains.
    """
    judged = monitor(mission, kernel, trace).requirements
    return min((each.robustness for each in judged if np.isfinite(each.robustness)), default=np.inf)


def truth(node: Node, mission: Mission, trace: Trace) -> Flags:
    """Truth of a formula for each agent and step: (agents, steps + 1), boolean.

    It is False at a step from which a window runs past the last step. No goal of a checked mission reads such a step.
    """
    return _everywhere(TRUTH, node, mission, trace)


def truths(nodes: Iterable[Node], mission: Mission, trace: Trace) -> dict[Node, Flags]:
    """Truth of several formulas, (agents, steps + 1), boolean, computed together; the arrays are read-only."""
    values = Evaluation(TRUTH, mission, trace).values(nodes)
    return {node: np.broadcast_to(value, trace.position.shape[:2]) for node, value in values.items()}


def robustness(node: Node, mission: Mission, trace: Trace) -> Array:
    """Robustness of a formula for each agent and step, negative if it fails.

    Shape: (agents, steps + 1), metres for spatial formulas.

    It is ``-inf`` if ``truth`` is False because of missing steps. ``inf`` and ``-inf`` also stand for facts that no
    motion can change, such as the identity of an agent.
    """
    return _everywhere(ROBUSTNESS, node, mission, trace)


def _everywhere(logic: Logic, node: Node, mission: Mission, trace: Trace) -> Values:
    value = Evaluation(logic, mission, trace).values((node,))[node]
    return np.broadcast_to(value, trace.position.shape[:2]).copy()


def _judged(goal: Goal, satisfied: bool, robustness: float, mission: Mission, trace: Trace) -> Judgement:
    unit = robustness_unit(goal.formula)
    if satisfied:
        return Judgement(goal.name, satisfied, robustness, unit=unit)
    where = first_violation(goal.formula, mission, trace)
    names = tuple(agent.name for agent in mission.agents if agent.index in where.agents)
    return Judgement(goal.name, satisfied, robustness, where.step, names, unit)
