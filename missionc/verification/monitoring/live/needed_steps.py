"""Steps at which formulas are asked while a mission is flown, and how long their values have to be kept.

in   the goals' formulas, the mission's last step
out  StepRange: of each formula, the steps it is asked at, how far it looks ahead, and for how many steps it is read
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import Node, UntilNode, WindowNode
from missionc.ir.kernel.walk import asked_between, asks, looks_back, postorder


@dataclass(slots=True)
class StepRange:
    """
    Args:
        first, last: the steps between which the formula is asked.
        ahead: after so many steps its value at a step is final.
        kept: how many steps before the present one are still read.
    """

    first: int
    last: int
    ahead: int
    kept: int = 0

    @property
    def once(self) -> bool:
        """Whether it is asked at one step alone."""
        return self.first == self.last


def needed_steps(roots: Iterable[Node], last: int) -> dict[Node, StepRange]:
    """When every formula below the roots is asked, which are asked at step 0 themselves; operands first.

    Args:
        last: the mission's last step.
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
    """Whether a window that looks back begins at step 0 wherever it is asked, and goes on from step to step."""
    return -node.low >= asked.last and (isinstance(node, WindowNode) or node.high == 0)


def _read_back(node: Node, asked: StepRange, below: int) -> int:
    """How many steps before the present one a formula reads of operands that look up to ``below`` steps ahead."""
    if isinstance(node, WindowNode | UntilNode):
        if not looks_back(node):
            return below + 1
        if reaches_start(node, asked):
            return max(asked.ahead - (node.high or 0), below) + 2
        return asked.ahead - node.low + 1
    return asked.ahead
