"""Iterative deepening of windows: what has to be some time is looked for early first, where a problem is smaller.

    in   formulas with windows, a number of steps
    out  formulas that imply them, in whose windows nothing is waited for longer

Source:
    Biere et al., "Symbolic Model Checking without BDDs" (1999): bounds that grow, of bounded model checking.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Eventually, Node, Until
from missionc.ir.kernel.walk import children, rebuilt, same_objects


def deepened(formulas: Sequence[Node], steps: int, first: int) -> Iterator[list[Node]]:
    """The formulas with short windows, with longer ones, and last as they are.

    Args:
        steps: of the mission, where a window without end ends.
        first: steps of the first windows at most; each time twice as many.
    """
    longest = first
    while 2 * longest <= steps:
        shorter = [within_horizon(formula, longest, steps) for formula in formulas]
        if same_objects(shorter, formulas):
            break
        yield shorter
        longest *= 2
    yield list(formulas)


def within_horizon(formula: Node, longest: int, steps: int) -> Node:
    """The formula, asked at the first step, with windows of ``eventually`` and ``until`` that are no longer than this.

    Itself where none is twice as long.
    """
    match formula:
        case Eventually(low=low, high=high) | Until(low=low, high=high):
            last = steps if high is None else high
            return formula if last - low < 2 * longest else replace(formula, high=low + longest)
        case At() | All() | Any() | AtLeast():
            below = tuple(children(formula))
            inner = tuple(within_horizon(child, longest, steps) for child in below)
            return formula if same_objects(inner, below) else rebuilt(formula, inner)
        case _:
            return formula
