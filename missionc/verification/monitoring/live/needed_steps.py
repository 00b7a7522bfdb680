"""Steps at which formulas are evaluated during a flight, and the lifetime of their values.

in   the goals' formulas, the mission's last step
out  StepRange: for each formula, its steps, its look-ahead, and the number of steps for which it is read
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import asked_between, asks, looks_back, postorder


@dataclass(slots=True)
class StepRange:
    """Steps at which a formula is evaluated, and the lifetime of its values.

    Args:
        first, last: range of the steps of evaluation.
        ahead: number of steps after which its value at a step is final.
        kept: number of past steps that are still read.
    """

    first: int
    last: int
    ahead: int
    kept: int = 0

    @property
    def once(self) -> bool:
        """True if the formula is evaluated at one step only."""
        return self.first == self.last


def needed_steps(roots: Iterable[Node], last: int) -> dict[Node, StepRange]:
    """Steps of evaluation for every formula below the roots, operands first; the roots are evaluated at step 0.

    Args:
        last: last step of the mission.
    """
    roots = tuple(roots)
    order = postorder(roots)
    ahead = steps_ahead(roots, to_end=last)
    between = asked_between(roots, last)
    found: dict[Node, StepRange] = {}
    for node in order:
        first, final = between.get(node, (0, 0))
        found[node] = StepRange(min(first, last), min(final, last), min(ahead[node], last))
    for node in order:
        furthest = max((found[ask.node].ahead for ask in asks(node)), default=0)
        for ask in asks(node):
            below = found[ask.node]
            below.kept = max(below.kept, _read_back(node, found[node], furthest))
    return found


def reaches_start(node: WindowNode | UntilNode, asked: StepRange) -> bool:
    """Return whether the window of a past operator always begins at step 0 and advances from step to step."""
    return -node.low >= asked.last and (isinstance(node, WindowNode) or node.high == 0)


def _read_back(node: Node, asked: StepRange, below: int) -> int:
    """Number of past steps that a formula reads of its operands, which look ``below`` steps ahead."""
    if isinstance(node, WindowNode | UntilNode):
        if not looks_back(node):
            return below + 1
        if reaches_start(node, asked):
            return max(asked.ahead - (node.high or 0), below) + 2
        return asked.ahead - node.low + 1
    return asked.ahead
