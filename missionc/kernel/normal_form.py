"""Negation normal form: formulas with ``Not`` on their leaves alone.

in   formulas as the operators wrote them
out  for each and a polarity, the formula, or its negation

A formula that is used twice is one node afterwards too, once for each polarity it is asked in. What has no
negation below it stays the node it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import TypeAlias

from missionc.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    LeafNode,
    NeighbourNode,
    Node,
    Not,
    ReachNode,
    RouteNode,
    UntilNode,
    WindowNode,
)
from missionc.kernel.walk import children, postorder, rebuilt

Forms: TypeAlias = dict[tuple[Node, bool], Node]
"""By formula and polarity: with False, the negation."""

KINDS = (WindowNode, UntilNode, NeighbourNode, ReachNode, RouteNode)
PAIRS = ((All, Any), (AtLeast, AtLeast), (At, At), *(kind.__subclasses__() for kind in KINDS))
DUALS: dict[type[Node], type[Node]] = {one: other for pair in PAIRS for one, other in (pair, pair[::-1])}
"""The constructor that has the same fields and says the opposite of the opposites below it."""


def negation_normal_form(formula: Node) -> Node:
    """The formula with its negations moved down to the leaves."""
    return normal_forms((formula,))[formula, True]


def negated(formula: Node) -> Node:
    """The negation of a formula, in normal form."""
    return normal_forms((), (formula,))[formula, False]


def normal_forms(formulas: Iterable[Node], denied: Iterable[Node] = ()) -> Forms:
    """The normal forms of formulas, of the negations of those ``denied``, and of all that they are made of."""
    asserted, opposed = tuple(formulas), tuple(denied)
    order = postorder((*asserted, *opposed))
    written = {node.body: node for node in order if isinstance(node, Not) and not children(node.body)}
    forms: Forms = {}
    needed = _polarities(asserted, opposed, order)
    for node in order:
        for holds in needed[node]:
            forms[node, holds] = _form(node, holds, forms, written)
    return forms


def _polarities(formulas: tuple[Node, ...], denied: tuple[Node, ...], order: list[Node]) -> dict[Node, set[bool]]:
    needed: dict[Node, set[bool]] = {node: set() for node in order}
    for node in formulas:
        needed[node].add(True)
    for node in denied:
        needed[node].add(False)
    for node in reversed(order):
        signs = {not sign for sign in needed[node]} if isinstance(node, Not) else needed[node]
        for child in children(node):
            needed[child] |= signs
    return needed


def _form(node: Node, holds: bool, forms: Forms, written: dict[Node, Not]) -> Node:
    if isinstance(node, Not):
        return forms[node.body, not holds]
    below = children(node)
    parts = tuple(forms[part, holds] for part in below)
    if not holds:
        return dual(node, parts) if below or isinstance(node, All | Any | AtLeast) else written.get(node) or Not(node)
    return node if all(new is old for new, old in zip(parts, below, strict=True)) else rebuilt(node, parts)


def dual(node: Node, parts: tuple[Node, ...]) -> Node:
    """The node that fails where this one holds, over nodes that fail where those below it hold."""
    assert not isinstance(node, Not | LeafNode), "a leaf has no dual but its negation"
    same = {each.name: getattr(node, each.name) for each in fields(node)}
    opposite = rebuilt(DUALS[type(node)](**{**same, "dual": not node.dual}), parts)
    return replace(opposite, count=len(parts) - opposite.count + 1) if isinstance(opposite, AtLeast) else opposite
