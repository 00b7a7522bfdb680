"""Propositional operators: negation, conjunction, disjunction, implication, equivalence."""

from __future__ import annotations

from missionc.ir.kernel.nodes import All, Any, Node, Not
from missionc.ir.language.operator import Fixity, Operator, Use


def _not(use: Use) -> Node:
    """Kernel form of the negation ``not f``."""
    (body,) = use.arguments
    return Not(body, use.span)


def _and(use: Use) -> Node:
    """Kernel form of the conjunction ``f and g``."""
    return All(use.arguments, use.span)


def _or(use: Use) -> Node:
    """Kernel form of the disjunction ``f or g``."""
    return Any(use.arguments, use.span)


def _implies(use: Use) -> Node:
    """Kernel form of the implication ``f implies g``: ``not f or g``."""
    condition, consequence = use.arguments
    return Any((Not(condition, use.span), consequence), use.span)


def _iff(use: Use) -> Node:
    """Kernel form of the equivalence ``f iff g``: both operands are true, or both are false."""
    left, right = use.arguments
    span = use.span
    return All((Any((Not(left, span), right), span), Any((Not(right, span), left), span)), span)


OPERATORS: tuple[Operator, ...] = (
    Operator(
        name="not",
        letter="!",
        expand=_not,
        says="the operand is not satisfied",
        reads="it is not true that {body}",
        example="not fire",
    ),
    Operator(
        name="and",
        letter="&",
        fixity=Fixity.INFIX,
        expand=_and,
        says="both operands are satisfied",
        reads="all of these hold: {parts}",
        example="base and speed <= 1",
    ),
    Operator(
        name="or",
        letter="|",
        fixity=Fixity.INFIX,
        expand=_or,
        says="at least one operand is satisfied",
        reads="at least one of these holds: {parts}",
        example="base or field",
    ),
    Operator(
        name="implies",
        letter="->",
        fixity=Fixity.INFIX,
        expand=_implies,
        says="the right operand is satisfied if the left one is",
        reads="if {left}, then {right}",
        example="field implies safe",
    ),
    Operator(
        name="iff",
        letter="<->",
        fixity=Fixity.INFIX,
        expand=_iff,
        says="both operands are satisfied, or neither",
        reads="{left}, exactly when {right}",
        example="field iff drone[0]",
    ),
)
