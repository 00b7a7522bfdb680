"""Constants in kernel formulas: true, false, and and simplification of formulas that contain them.

Folding keeps truth and robustness at every step from which a formula does not look past the mission's last.
"""

from __future__ import annotations

from dataclasses import replace
from typing import assert_never

from missionc.base.source import Span
from missionc.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Eventually,
    Is,
    Kernel,
    LeafNode,
    NeighbourNode,
    Node,
    Not,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
)
from missionc.kernel.walk import bottom_up, children, rebuilt, same_objects

YES, NO = All(()), Any(())


def truth(value: bool) -> Node:
    """The constant formula of that truth, which is always the same object."""
    return YES if value else NO


def constant(node: Node) -> bool | None:
    """The truth of a constant formula; None for any other."""
    match node:
        case All(()):
            return True
        case Any(()):
            return False
        case _:
            return None


def without_constants(kernel: Kernel, agents: int) -> Kernel:
    """The kernel with constants folded: a goal is constant, or contains none except along routes and before windows.

    Args:
        agents: how many the mission has; ``Is`` of all of them is true, of none false.

    Returns:
        The same object if there is nothing to fold.
    """

    def over(node: Node, parts: tuple[Node, ...]) -> Node:
        if isinstance(node, Is) and len(node.agents) in (0, agents):
            return truth(bool(node.agents))
        return folded(node, parts)

    made = bottom_up(kernel.formulas, over)
    if all(new is old for old, new in made.items()):
        return kernel
    meanings = {formula: node for formula, node in kernel.meanings.items() if made.get(node, node) is node}
    return replace(kernel.with_formulas(made.__getitem__), meanings=meanings)


def folded(node: Node, parts: tuple[Node, ...]) -> Node:
    """The same constructor over other nodes, or what it comes to over constants; the same node over its own parts."""
    values = [constant(part) for part in parts]
    value = _value(node, values)
    if value is not None:
        return node if constant(node) is not None else truth(value)
    match node:
        case All() | Any() | AtLeast() if any(each is not None for each in values):
            left = tuple(part for part, each in zip(parts, values, strict=True) if each is None)
            if isinstance(node, AtLeast):
                return at_least(node.count - values.count(True), left, node.span, node.dual)
            return left[0] if len(left) == 1 else replace(node, parts=left)
        case UntilNode(low=low, high=high, span=span, dual=dual) if values[0] is not None:
            window = Always if node.every else Eventually
            return parts[1] if values[0] is node.every else window(parts[1], low, high, span, dual)
        case ReachNode() | RouteNode() if values[0] is node.every:
            return parts[1]
        case _:
            return node if same_objects(parts, children(node)) else rebuilt(node, parts)


def at_least(count: int, parts: tuple[Node, ...], span: Span | None = None, dual: bool = False) -> Node:
    """Formula that at least ``count`` of the parts hold, by the plainest constructor."""
    if not 0 < count <= len(parts):
        return truth(count <= 0)
    if count == len(parts):
        return parts[0] if count == 1 else All(parts, span, dual)
    return Any(parts, span, dual) if count == 1 else AtLeast(count, parts, span, dual)


def _value(node: Node, values: list[bool | None]) -> bool | None:
    """The truth of a node over parts of these truths; None if it depends on those that are open."""
    match node:
        case All() | Any():
            return (not node.every) if (not node.every) in values else None if None in values else node.every
        case AtLeast(count):
            least = values.count(True)
            return True if count <= least else False if count > least + values.count(None) else None
        case At():
            return values[0]
        case Not():
            return None if values[0] is None else not values[0]
        case WindowNode():
            # One that looks back may hold no step.
            return values[0] if node.low >= 0 or _holds_now(node) or values[0] is node.every else None
        case UntilNode():
            hold, end = values
            missed = end is node.every or (hold is node.every and not _holds_now(node))
            return node.every if missed else end if end is not None and _holds_now(node) else None
        case NeighbourNode():
            return values[0] if values[0] is node.every else None
        case ReachNode() | RouteNode():
            through, end = values
            missed = end is node.every or (through is node.every and node.low > 0)
            return node.every if missed else end if node.low <= 0 else None
        case LeafNode():
            return None
        case _:
            assert_never(node)


def _holds_now(node: WindowNode | UntilNode) -> bool:
    """Whether the window includes the step that it is asked at."""
    return node.low <= 0 and (node.high is None or node.high >= 0)
