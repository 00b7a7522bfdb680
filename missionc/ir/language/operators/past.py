"""Past operators: over a window that reaches back, and over the previous step."""

from __future__ import annotations

from missionc.ir.kernel.nodes import All, Always, Eventually, Node, Not, Until
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def _once(use: Use) -> Node:
    """Kernel form of ``once[a, b] f``: ``f`` at some step of the past window; false if the window contains no step."""
    (body,) = use.arguments
    return Eventually(body, *use.back, use.span)


def _historically(use: Use) -> Node:
    """Kernel form of ``historically[a, b] f``: ``f`` at every step of the past window; true if the window contains no
    step."""
    (body,) = use.arguments
    return Always(body, *use.back, use.span)


def _since(use: Use) -> Node:
    """Kernel form of ``f since[a, b] g``: ``g`` at some step of the past window, and ``f`` at every step after that
    step.

    Mirror image of ``until``: ``f`` from the current step back to the step of ``g``, excluded.
    """
    hold, end = use.arguments
    if use.window.high == 0:  # no step follows it
        return end
    return Until(hold, end, *use.back, use.span)


def _arrives(use: Use) -> Node:
    """Kernel form of ``arrives f``: ``f`` at the current but not at the previous step; false at the first step."""
    (body,) = use.arguments
    return All((body, Eventually(Not(body, use.span), -1, -1, use.span)), use.span)


def _leaves(use: Use) -> Node:
    """Kernel form of ``leaves f``: ``f`` at the previous but not at the current step; false at the first step."""
    (body,) = use.arguments
    return All((Not(body, use.span), Eventually(body, -1, -1, use.span)), use.span)


OPERATORS: tuple[Operator, ...] = (
    Operator(
        name="once",
        bounds=Bounds.PAST,
        expand=_once,
        says="the operand is satisfied at some step of the window in the past",
        reads="{some}, {body}",
        example="once[0, 5 s] base",
    ),
    Operator(
        name="historically",
        bounds=Bounds.PAST,
        expand=_historically,
        says="the operand is satisfied at every step of the window in the past",
        reads="{each}, {body}",
        example="historically[0, 5 s] not fire",
    ),
    Operator(
        name="since",
        fixity=Fixity.INFIX,
        bounds=Bounds.PAST,
        expand=_since,
        says="the right operand is satisfied at some step of the past window, and the left one at every step after it",
        reads="{some}, {right}; and {before}, {left}",
        example="safe since[0, 10 s] base",
    ),
    Operator(
        name="arrives",
        expand=_arrives,
        says="the operand is satisfied now and was not satisfied one step ago",
        reads="now and not one step ago, {body}",
        example="arrives(base)",
    ),
    Operator(
        name="leaves",
        expand=_leaves,
        says="the operand is not satisfied now and was satisfied one step ago",
        reads="one step ago and not now, {body}",
        example="leaves(base)",
    ),
)
