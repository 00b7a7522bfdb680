"""Negation normal form of kernel formulas (``Not`` only on leaves), and constant folding.

    in   formulas from the operators
    out  for each formula and polarity, the formula or its negation

A formula that is used twice remains one node for each polarity of its uses. A node without a negation below it remains
the same object.

Constant folding preserves truth and robustness at every step from which a formula does not read past the mission's last
step.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import TypeAlias, assert_never

from missionc.base.source import Span
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import bottom_up, children, postorder, rebuilt, same_objects

YES, NO = k.All(()), k.Any(())


def truth(value: bool) -> k.Node:
    """Constant formula, true or false; always the same object."""
    return YES if value else NO


def constant(node: k.Node) -> bool | None:
    """Truth of a constant formula; None for any other formula."""
    match node:
        case k.All(()):
            return True
        case k.Any(()):
            return False
        case _:
            return None


def without_constants(kernel: k.Kernel, agents: int) -> k.Kernel:
    """Kernel with constants folded: afterwards a goal is constant, or has constants only along routes and in windows
    that may be empty.

    Args:
        agents: number of agents of the mission; ``Is`` of all agents is true, ``Is`` of none is false.

    Returns:
        The same object if there is nothing to fold.
    """

    def over(node: k.Node, parts: tuple[k.Node, ...]) -> k.Node:
        if isinstance(node, k.Is) and len(node.agents) in (0, agents):
            return truth(bool(node.agents))
        return folded(node, parts)

    made = bottom_up(kernel.formulas, over)
    if all(new is old for old, new in made.items()):
        return kernel
    meanings = {formula: node for formula, node in kernel.meanings.items() if made.get(node, node) is node}
    return replace(kernel.with_formulas(made.__getitem__), meanings=meanings)


def folded(node: k.Node, parts: tuple[k.Node, ...]) -> k.Node:
    """Node of the same constructor over ``parts``, with constants folded; the same object if ``parts`` are its own
    children and none is constant."""
    values = [constant(part) for part in parts]
    value = _value(node, values)
    if value is not None:
        return node if constant(node) is not None else truth(value)
    match node:
        case k.All() | k.Any() | k.AtLeast() if any(each is not None for each in values):
            left = tuple(part for part, each in zip(parts, values, strict=True) if each is None)
            if isinstance(node, k.AtLeast):
                return at_least(node.count - values.count(True), left, node.span, node.dual)
            return left[0] if len(left) == 1 else replace(node, parts=left)
        case k.UntilNode(low=low, high=high, span=span, dual=dual) if values[0] is not None:
            window = k.Always if node.every else k.Eventually
            return parts[1] if values[0] is node.every else window(parts[1], low, high, span, dual)
        case k.ReachNode() | k.RouteNode() if values[0] is node.every:
            return parts[1]
        case _:
            return node if same_objects(parts, children(node)) else rebuilt(node, parts)


def at_least(count: int, parts: tuple[k.Node, ...], span: Span | None = None, dual: bool = False) -> k.Node:
    """Formula that at least ``count`` of the parts are true: a constant, conjunction or disjunction if possible."""
    if not 0 < count <= len(parts):
        return truth(count <= 0)
    if count == len(parts):
        return parts[0] if count == 1 else k.All(parts, span, dual)
    return k.Any(parts, span, dual) if count == 1 else k.AtLeast(count, parts, span, dual)


def _value(node: k.Node, values: list[bool | None]) -> bool | None:
    """Truth of a node over parts with these truths; None if the truth depends on parts of unknown truth (None)."""
    match node:
        case k.All() | k.Any():
            return (not node.every) if (not node.every) in values else None if None in values else node.every
        case k.AtLeast(count):
            least = values.count(True)
            return True if count <= least else False if count > least + values.count(None) else None
        case k.At():
            return values[0]
        case k.Not():
            return None if values[0] is None else not values[0]
        case k.WindowNode():
            # A window that looks back may contain no step.
            return values[0] if node.low >= 0 or _holds_now(node) or values[0] is node.every else None
        case k.UntilNode():
            hold, end = values
            missed = end is node.every or (hold is node.every and not _holds_now(node))
            return node.every if missed else end if end is not None and _holds_now(node) else None
        case k.NeighbourNode():
            return values[0] if values[0] is node.every else None
        case k.ReachNode() | k.RouteNode():
            through, end = values
            missed = end is node.every or (through is node.every and node.low > 0)
            return node.every if missed else end if node.low <= 0 else None
        case k.LeafNode():
            return None
        case _:
            assert_never(node)


def _holds_now(node: k.WindowNode | k.UntilNode) -> bool:
    """Return true if the window includes the current step."""
    return node.low <= 0 and (node.high is None or node.high >= 0)


Forms: TypeAlias = dict[tuple[k.Node, bool], k.Node]
"""Normal forms by formula and polarity; polarity False means the negation of the formula."""

KINDS = (k.WindowNode, k.UntilNode, k.NeighbourNode, k.ReachNode, k.RouteNode)
PAIRS = ((k.All, k.Any), (k.AtLeast, k.AtLeast), (k.At, k.At), *(kind.__subclasses__() for kind in KINDS))
DUALS: dict[type[k.Node], type[k.Node]] = {one: other for pair in PAIRS for one, other in (pair, pair[::-1])}
"""Dual of each constructor: with the same fields and negated children, the dual is the negation."""


def negation_normal_form(formula: k.Node) -> k.Node:
    """Formula with all negations moved to the leaves."""
    return normal_forms((formula,))[formula, True]


def negated(formula: k.Node) -> k.Node:
    """Negation of a formula, in negation normal form."""
    return normal_forms((), (formula,))[formula, False]


def normal_forms(formulas: Iterable[k.Node], denied: Iterable[k.Node] = ()) -> Forms:
    """Normal forms of ``formulas``, of the negations of ``denied``, and of all their subformulas with the needed
    polarities."""
    asserted, opposed = tuple(formulas), tuple(denied)
    order = postorder((*asserted, *opposed))
    written = {node.body: node for node in order if isinstance(node, k.Not) and not children(node.body)}
    forms: Forms = {}
    needed = _polarities(asserted, opposed, order)
    for node in order:
        for holds in needed[node]:
            forms[node, holds] = _form(node, holds, forms, written)
    return forms


def _polarities(
    formulas: tuple[k.Node, ...], denied: tuple[k.Node, ...], order: list[k.Node]
) -> dict[k.Node, set[bool]]:
    needed: dict[k.Node, set[bool]] = {node: set() for node in order}
    for node in formulas:
        needed[node].add(True)
    for node in denied:
        needed[node].add(False)
    for node in reversed(order):
        signs = {not sign for sign in needed[node]} if isinstance(node, k.Not) else needed[node]
        for child in children(node):
            needed[child] |= signs
    return needed


def _form(node: k.Node, holds: bool, forms: Forms, written: dict[k.Node, k.Not]) -> k.Node:
    if isinstance(node, k.Not):
        return forms[node.body, not holds]
    below = children(node)
    parts = tuple(forms[part, holds] for part in below)
    if not holds:
        return (
            dual(node, parts)
            if below or isinstance(node, k.All | k.Any | k.AtLeast)
            else written.get(node) or k.Not(node)
        )
    return node if all(new is old for new, old in zip(parts, below, strict=True)) else rebuilt(node, parts)


def dual(node: k.Node, parts: tuple[k.Node, ...]) -> k.Node:
    """Dual of a node over ``parts``: if the parts are the negations of the children, it is the negation of the node."""
    assert not isinstance(node, k.Not | k.LeafNode), "a leaf has no dual but its negation"
    same = {each.name: getattr(node, each.name) for each in fields(node)}
    opposite = rebuilt(DUALS[type(node)](**{**same, "dual": not node.dual}), parts)
    return replace(opposite, count=len(parts) - opposite.count + 1) if isinstance(opposite, k.AtLeast) else opposite
