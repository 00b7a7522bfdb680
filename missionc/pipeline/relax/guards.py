"""Guards: the requirements that keep people and things safe, and the changes that give some of that up.

in   Mission as written, its Kernel, the motion that a change of it made possible
out  whether that motion breaks one of them, or comes nearer than bodies may
"""

from __future__ import annotations

from dataclasses import replace

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.kernel.nodes import All, At, Atom, Kernel, NeighbourNode, Node, Not, UntilNode, WindowNode
from missionc.kernel.walk import bottom_up, children, postorder, rebuilt
from missionc.monitoring.evaluate import Evaluation
from missionc.monitoring.logic import TRUTH
from missionc.verify.verify_plan import verify

ROOM = frozenset(("separation", "obstacle"))
"""Checks of the room between bodies, and between bodies and obstacles."""


def gives_up_safety(mission: Mission, kernel: Kernel, trace: Trace) -> bool:
    """Whether a motion of the same agents breaks a guard of the mission as written.

    In one that lasts longer the guards do too that last to the mission's end.
    """
    agents, states = trace.position.shape[:2]
    if agents != len(mission.agents) or states <= mission.steps:
        return False
    guarding = [goal for goal in kernel.requirements if guards(goal.formula)]
    if states == mission.steps + 1:
        named = {goal.name for goal in guarding}
        failed = verify(mission, kernel, trace).failures
        return any(check.name in ROOM or (check.name == "requirement" and check.subject in named) for check in failed)
    lasting = [_to_the_end(goal.formula, mission.steps) for goal in guarding]
    truths = Evaluation(TRUTH, mission, trace).values(lasting)
    return not all(truths[formula][0, 0] for formula in lasting)


def _to_the_end(formula: Node, last: int) -> Node:
    """The formula with what lasts to the last step lasting to whatever end there is."""

    def lasting(node: Node, below: tuple[Node, ...]) -> Node:
        same = rebuilt(node, below)
        return replace(same, high=None) if isinstance(same, WindowNode) and same.every and same.high == last else same

    return bottom_up((formula,), lasting)[formula]


def guards(formula: Node) -> bool:
    """Whether a requirement asks that something always is, or is not: no event that it waits for makes it true.

    ``always[0, 20 s] not fire`` does, and so does who keeps out of a place until another thing happens;
    ``always eventually[0, 5 s] base`` waits for events.
    """
    match formula:
        case All(parts):
            return any(map(guards, parts))
        case At(_, body):
            return guards(body)
        case NeighbourNode(_, body):
            return formula.every and guards(body)
        case WindowNode(body) if formula.every:
            return not any(_waits(node) for node in postorder((body,)))
        case UntilNode(hold, _) if not formula.every:
            return any(_denies(node) for node in _together(hold))
        case _:
            return _denies(formula)


def _waits(node: Node) -> bool:
    return isinstance(node, WindowNode | UntilNode) and not node.every


def _denies(node: Node) -> bool:
    """That an agent is not in a region."""
    return isinstance(node, Not) and isinstance(node.body, Atom) and bool(node.body.predicate.regions)


def _together(node: Node) -> list[Node]:
    """The formulas that all have to hold for this one to hold."""
    return [each for part in children(node) for each in _together(part)] if isinstance(node, All) else [node]
