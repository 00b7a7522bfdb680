"""Negation normal form: formulas with ``Not`` on their leaves alone.

in   formulas as the operators wrote them
out  for each and a polarity, the formula, or its negation

A formula that is used twice is one node afterwards too, once for each polarity it is asked in. What has no
negation below it stays the node it is.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeAlias, assert_never

from missionc.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.kernel.walk import children, postorder

Forms: TypeAlias = dict[tuple[Node, bool], Node]
"""By formula and polarity: with False, the negation."""


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


def rebuilt(node: Node, parts: tuple[Node, ...]) -> Node:
    """The same constructor over other nodes."""
    match node:
        case Atom() | Is() | PathLength():
            return node
        case All() | Any() | AtLeast():
            return replace(node, parts=parts)
        case Not() | Always() | Eventually() | At() | Neighbour() | EveryNeighbour():
            return replace(node, body=parts[0])
        case Until() | Release():
            return replace(node, hold=parts[0], end=parts[1])
        case Reach() | EveryReach() | Route() | EveryRoute():
            return replace(node, through=parts[0], end=parts[1])
        case _:
            assert_never(node)


def dual(node: Node, parts: tuple[Node, ...]) -> Node:
    """The node that fails where this one holds, over nodes that fail where those below it hold."""
    match node:
        case All(_, span):
            return Any(parts, span, not node.dual)
        case Any(_, span):
            return All(parts, span, not node.dual)
        case AtLeast(count, _, span):
            return AtLeast(len(parts) - count + 1, parts, span, not node.dual)
        case Always(_, low, high, span):
            return Eventually(parts[0], low, high, span, not node.dual)
        case Eventually(_, low, high, span):
            return Always(parts[0], low, high, span, not node.dual)
        case Until(_, _, low, high, span):
            return Release(parts[0], parts[1], low, high, span, not node.dual)
        case Release(_, _, low, high, span):
            return Until(parts[0], parts[1], low, high, span, not node.dual)
        case Neighbour(graph, _, span):
            return EveryNeighbour(graph, parts[0], span, not node.dual)
        case EveryNeighbour(graph, _, span):
            return Neighbour(graph, parts[0], span, not node.dual)
        case Reach(graph, _, _, hops, span):
            return EveryReach(graph, parts[0], parts[1], hops, span, not node.dual)
        case EveryReach(graph, _, _, hops, span):
            return Reach(graph, parts[0], parts[1], hops, span, not node.dual)
        case Route(graph, _, _, low_m, high_m, span):
            return EveryRoute(graph, parts[0], parts[1], low_m, high_m, span, not node.dual)
        case EveryRoute(graph, _, _, low_m, high_m, span):
            return Route(graph, parts[0], parts[1], low_m, high_m, span, not node.dual)
        case At(agent, _, span):
            return At(agent, parts[0], span, not node.dual)
        case Atom() | Is() | PathLength() | Not():
            raise AssertionError("a leaf has no dual but its negation")
        case _:
            assert_never(node)
