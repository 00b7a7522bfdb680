"""Precedence: conditions on some agents until other agents act, split into conditions for separate planning.

    in   conjuncts of the requirements
    out  stronger conjuncts, each about fewer agents

``(not (some barge: chamber)) until[0, 10 min] (keeper: hut)`` couples every barge with the keeper. With a selected
step, it requires each barge to stay away before that step, and the keeper to be in the hut at it. The selected step
makes the requirement stronger, so that failure to find a plan proves nothing.
"""

from __future__ import annotations

from dataclasses import replace

from missionc.backends.smt.prioritized.planning_order import PlanningOrder
from missionc.backends.smt.prioritized.requirement_parts import named_agents, throughout
from missionc.backends.smt.settings import smt_settings
from missionc.ir.kernel.conjuncts import Conjunct, conjuncts
from missionc.ir.kernel.nodes import All, Always, Any, At, AtLeast, Eventually, Goal, Kernel, Node, Until
from missionc.ir.kernel.walk import children, rebuilt, same_objects


def with_steps_chosen(kernel: Kernel, order: PlanningOrder, later: float) -> Kernel:
    """Kernel with a selected step for each ``until`` about several agents; the same kernel without such an ``until``.

    Args:
        later: position of the selected step in its window, 0 to 1.
    """
    requirements = tuple(_goal_chosen(goal, order, later) for goal in kernel.requirements)
    return kernel if same_objects(requirements, kernel.requirements) else replace(kernel, requirements=requirements)


def _goal_chosen(goal: Goal, order: PlanningOrder, later: float) -> Goal:
    parts = list(conjuncts((goal.formula,)))
    if not any(map(is_precedence, parts)):
        return goal
    formulas = [
        part for each in parts for part in (_chosen(each, order, later) if is_precedence(each) else [_formula(each)])
    ]
    return replace(goal, formula=All(tuple(formulas), goal.formula.span))


def is_precedence(conjunct: Conjunct) -> bool:
    """Return true if the conjunct is an ``until`` from the beginning whose sides concern more than one agent."""
    if conjunct.windows or not isinstance(conjunct.formula, Until):
        return False
    formula = _formula(conjunct)
    return len(named_agents((formula,))[formula]) > 1


def _formula(conjunct: Conjunct) -> Node:
    """Conjunct as one formula at step 0."""
    asked = throughout(conjunct.windows, conjunct.formula)
    return asked if conjunct.agent is None else At(conjunct.agent, asked, asked.span)


def _chosen(conjunct: Conjunct, order: PlanningOrder, later: float) -> list[Node]:
    """Conditions of an ``until`` with a selected step: ``end`` at that step, and ``hold`` at all steps before it."""
    settings = smt_settings(order.labels.mission).prioritized
    agent, _, node = conjunct
    assert isinstance(node, Until)
    hold, end = (part if agent is None else At(agent, part, node.span) for part in (node.hold, node.end))
    last = order.labels.mission.steps if node.high is None else node.high
    soon = min(max(node.low, int(settings.wait_factor * order.need(_sometime(end)).steps) + settings.wait_steps), last)
    step = soon + int(later * (last - soon))
    before: list[Node] = [Always(hold, 0, step - 1, node.span)] if step else []
    return [*before, Always(end, step, step, node.span)]


def _sometime(node: Node) -> Node:
    """Formula that a node becomes true for each of its agents separately, at any step."""
    match node:
        case At(agent, body):
            return At(agent, Eventually(body, 0, None, node.span), node.span)
        case All() | Any() | AtLeast():
            return rebuilt(node, tuple(map(_sometime, children(node))))
        case _:
            return node
