"""Future operators: over a window of steps, over periods, and at the next step."""

from __future__ import annotations

from missionc.ir import Apply, Window
from missionc.ir.kernel.nodes import Always, Eventually, Node, Release, Until
from missionc.ir.language.operator import Bounds, Fixity, Operator, Use


def _always(use: Use) -> Node:
    """Kernel form of ``always[a, b] f``: ``f`` at every step of the window."""
    (body,) = use.arguments
    return Always(body, use.window.low, use.window.high, use.span)


def _eventually(use: Use) -> Node:
    """Kernel form of ``eventually[a, b] f``: ``f`` at some step of the window."""
    (body,) = use.arguments
    return Eventually(body, use.window.low, use.window.high, use.span)


def _every(use: Use) -> Node:
    """Kernel form of the recurrence ``every 40 s: f``: ``f`` at some step of each period of that length until the
    mission's end.

    A period begins at each step from the current step on and ends, both ends included, no later than the mission: the
    horizon truncates no period. Each period is evaluated at its last step and looks back, so that the operator can be
    evaluated at any step.

    Source:
        Konrad and Cheng, "Real-time Specification Patterns" (2005), bounded recurrence.
    """
    (body,) = use.arguments
    return Always(Eventually(body, -use.period, 0, use.span), use.period, None, use.span)


def _until(use: Use) -> Node:
    """Kernel form of ``f until[a, b] g``: ``g`` at some step of the window, and ``f`` at every step before that step.

    This form is the standard semantics. [strel] also requires ``f`` at the step of ``g``: ``f until[a, b] (f and g)``.
    """
    hold, end = use.arguments
    if use.window.high == 0:  # no step before it, so the left side is evaluated nowhere
        return end
    return Until(hold, end, use.window.low, use.window.high, use.span)


def _until_traps(use: Apply) -> tuple[str, ...]:
    late = isinstance(use.bounds, Window) and use.bounds.low > 0
    return ("until, at its end", "until, at its beginning", *(("until, before its window",) if late else ()))


def _release(use: Use) -> Node:
    """Kernel form of ``f release[a, b] g``, the dual of ``until``: ``g`` at every step of the window until after a step
    with ``f``."""
    frees, held = use.arguments
    window = use.window
    if window.high == 0:
        return held
    return Release(frees, held, window.low, window.high, use.span)


def _release_traps(use: Apply) -> tuple[str, ...]:
    return ("release, at its end",)


def _next(use: Use) -> Node:
    """Kernel form of ``next f``: ``f`` at the next step."""
    (body,) = use.arguments
    return Eventually(body, 1, 1, use.span)


OPERATORS: tuple[Operator, ...] = (
    Operator(
        name="always",
        letter="G",
        bounds=Bounds.TIME,
        expand=_always,
        says="the operand is satisfied at every step of the window",
        reads="{each}, {body}",
        example="always[0, 20 s] not fire",
    ),
    Operator(
        name="eventually",
        letter="F",
        bounds=Bounds.TIME,
        expand=_eventually,
        says="the operand is satisfied at some step of the window",
        reads="{some}, {body}",
        example="eventually[0, 12 s] survivor",
    ),
    Operator(
        name="every",
        bounds=Bounds.PERIOD,
        expand=_every,
        says="the operand is satisfied at some step of each period of this length, up to the end of the mission",
        reads="in each {period} from {start} to the end of the mission, at some step, {body}",
        example="every 40 s: gate",
    ),
    Operator(
        name="until",
        letter="U",
        fixity=Fixity.INFIX,
        bounds=Bounds.TIME,
        expand=_until,
        says="the right operand is satisfied at some step of the window, and the left one at every step before it",
        reads="{some}, {right}; and {before}, {left}",
        example="safe until[0, 10 s] base",
        traps=_until_traps,
    ),
    Operator(
        name="release",
        letter="Rel",
        fixity=Fixity.INFIX,
        bounds=Bounds.TIME,
        expand=_release,
        says="the right operand is satisfied at every step of the window, or until the left one was satisfied",
        reads="{each}, {right}, unless {earlier}, {left}",
        example="charged release[0, 10 s] base",
        traps=_release_traps,
    ),
    Operator(
        name="next",
        expand=_next,
        says="the operand is satisfied one step later",
        reads="{some}, {body}",
        example="next base",
    ),
)
