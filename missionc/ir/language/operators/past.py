"""Operators of the past: over a window that reaches back, and over the step before."""

from __future__ import annotations

from missionc.ir.kernel.nodes import All, Always, Eventually, Node, Not, Until
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def _once(use: Use) -> Node:
    """``once[a, b] f``: ``f`` at some step of the window, which reaches back; false where that holds no step."""
    (body,) = use.arguments
    return Eventually(body, *use.back, use.span)


def _historically(use: Use) -> Node:
    """``historically[a, b] f``: ``f`` at every step of the window, which reaches back; true if that holds no step."""
    (body,) = use.arguments
    return Always(body, *use.back, use.span)


def _since(use: Use) -> Node:
    """``f since[a, b] g``: ``g`` at some step of the window, which reaches back, and ``f`` at every step after it.

    The mirror image of ``until``: ``f`` from now back to, not at, the step with ``g``.
    """
    hold, end = use.arguments
    if use.window.high == 0:  # there is no step after it
        return end
    return Until(hold, end, *use.back, use.span)


def _arrives(use: Use) -> Node:
    """``arrives f``: ``f`` now, and not one step ago; false at the first step, before which there is none."""
    (body,) = use.arguments
    return All((body, Eventually(Not(body, use.span), -1, -1, use.span)), use.span)


def _leaves(use: Use) -> Node:
    """``leaves f``: ``f`` one step ago, and not now; false at the first step, before which there is none."""
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
