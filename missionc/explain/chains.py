"""Chains of `and` and `or`, as their kernel form shows them; and whether `for` made one."""

from __future__ import annotations

from missionc import ir
from missionc.base.source import Turn
from missionc.kernel.nodes import All, Any, Node, Not
from missionc.language.walk_formulas import meaning


def boolean(formula: ir.Formula) -> type[Node] | None:
    """Whether a formula is plainly `not`, `and` or `or`, as its kernel form shows."""
    if not isinstance(formula, ir.Apply) or formula.bounds is not None or formula.operator.spatial:
        return None
    node, places = meaning(formula)
    match node:
        case Not(body) if body is places[0]:
            return Not
        case All(parts) | Any(parts) if parts == places:
            return type(node)
        case _:
            return None


def turns_of(formula: ir.Apply) -> list[tuple[Turn, ...]]:
    """With which indices each operand of a chain is read that `for` made; none of any other."""
    own = formula.span.turns
    turns = [operand.span.turns for operand in formula.operands]
    if any(each[: len(own)] != own or len(each) == len(own) for each in turns):
        return []
    return [each[len(own) :] for each in turns]
