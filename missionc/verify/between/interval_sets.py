"""Sets of time intervals in which a formula holds, and the operators of time and of logic on them.

Time is counted in whole ticks, so that nothing here rounds. Of every formula
two sets are known: when it surely holds, and when it surely does not. Both are
closed and neither says too much; what lies in neither is not decided.

Source:
    Maler and Nickovic, "Monitoring Temporal Properties of Continuous Signals" (2004), section 3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

Spans: TypeAlias = tuple[tuple[int, int], ...]
"""Closed intervals in ticks, in order, none touching another. (5, 5) is a moment."""


@dataclass(frozen=True, slots=True)
class Signal:
    """When something surely holds, and when it surely does not."""

    sure: Spans
    never: Spans

    @property
    def denied(self) -> Signal:
        return Signal(self.never, self.sure)


def merged(spans: Iterable[tuple[int, int]]) -> Spans:
    """The union; what ends before it begins is nothing."""
    result: list[tuple[int, int]] = []
    for low, high in sorted(span for span in spans if span[0] <= span[1]):
        if result and low <= result[-1][1]:
            result[-1] = (result[-1][0], max(result[-1][1], high))
        else:
            result.append((low, high))
    return tuple(result)


def common(one: Spans, other: Spans) -> Spans:
    """The moments in both; none in one that ends before it begins."""
    return at_least(2, (one, other), 0)


def at_least(count: int, parts: Sequence[Spans], end: int) -> Spans:
    """The moments of 0 … ``end`` that so many of the sets share."""
    if count <= 0:
        return ((0, end),)
    if count > len(parts):
        return ()
    # An interval begins before another ends at the same moment: both have it.
    events = sorted((tick, edge) for part in parts for low, high in part for tick, edge in ((low, 0), (high, 1)))
    result: list[tuple[int, int]] = []
    depth = begun = 0
    for tick, edge in events:
        if edge == 0:
            depth += 1
            if depth == count:
                begun = tick
        else:
            if depth == count:
                result.append((begun, tick))
            depth -= 1
    return merged(result)


def of_parts(count: int, parts: Sequence[Signal], end: int) -> Signal:
    """``count`` of the parts hold; surely not where all but fewer than that many surely do not."""
    return Signal(
        at_least(count, [part.sure for part in parts], end),
        at_least(len(parts) - count + 1, [part.never for part in parts], end),
    )


def sometime(body: Signal, low: int, high: int | None, end: int) -> Signal:
    """``body`` at some moment from ``low`` to ``high`` ahead; ``high`` None is ``end``."""
    return Signal(_dilated(body.sure, low, high, end), _eroded(body.never, low, high, end))


def throughout(body: Signal, low: int, high: int | None, end: int) -> Signal:
    """``body`` at every moment from ``low`` to ``high`` ahead; ``high`` None is ``end``."""
    return sometime(body.denied, low, high, end).denied


def until(hold: Signal, goal: Signal, low: int, high: int | None, end: int) -> Signal:
    """``goal`` at some moment of the window, and ``hold`` at every moment from now up to, not at, that one."""
    return Signal(_until(hold.sure, goal.sure, low, high, end), _never_until(hold.never, goal.never, low, high, end))


def looking_back(measure: Callable[..., Signal], *parts: Signal, low: int, high: int, end: int) -> Signal:
    """``sometime``, ``throughout`` or ``until`` with time reversed; before 0 the last of the parts is never so.

    Args:
        low, high: the window in ticks back, ``low`` the nearer.
    """
    *holds, awaited = (Signal(_reversed(part.sure, end), _reversed(part.never, end)) for part in parts)
    # Nothing is there from just after 0 back; where nothing is at 0 either, the two are one stretch.
    begin = end if awaited.never and awaited.never[-1][1] == end else end + 1
    never = merged((*awaited.never, (begin, end + high)))
    found = measure(*holds, Signal(awaited.sure, never), low, high, end + high)
    known = ((0, end),)
    return Signal(_reversed(common(found.sure, known), end), _reversed(common(found.never, known), end))


def _reversed(spans: Spans, end: int) -> Spans:
    return tuple((end - last, end - first) for first, last in reversed(spans))


def asked_until(last: int, signal: Signal, end: int) -> Signal:
    """What is asked at the moments up to ``last`` alone, and stands in nobody's way from then on."""
    if last < 0:
        return Signal(((0, end),), ())
    sure, never = (common(spans, ((0, last),)) for spans in (signal.sure, signal.never))
    # Just after `last` nothing is asked any more; closed sets can say so from the next tick on.
    begin = last if sure and sure[-1][1] == last else last + 1
    return Signal(merged((*sure, (begin, end))), never)


def _dilated(spans: Spans, low: int, high: int | None, end: int) -> Spans:
    """The moments from which some moment of the window is one of the set."""
    return merged(
        (0 if high is None else max(0, first - high), min(last, end) - low) for first, last in spans if last >= low
    )


def _eroded(spans: Spans, low: int, high: int | None, end: int) -> Spans:
    """The moments from which all of the window is in the set."""
    if high is None:
        return merged((max(0, first - low), end - low) for first, last in spans if last >= end)
    return merged((max(0, first - low), last - high) for first, last in spans)


def _until(hold: Spans, goal: Spans, low: int, high: int | None, end: int) -> Spans:
    now = [goal] if low == 0 else []
    later = [common((span,), _dilated(common((span,), goal), low, high, end)) for span in hold]
    return merged(span for spans in (*now, *later) for span in spans)


def _never_until(fails: Spans, absent: Spans, low: int, high: int | None, end: int) -> Spans:
    """The moments from which ``goal`` is absent from the window up to where ``hold`` first fails, at least.

    Args:
        fails: when ``hold`` surely does not hold.
        absent: when ``goal`` surely does not.
    """
    result = [*_eroded(absent, low, high, end), *(fails if low > 0 else common(fails, absent))]
    for first, _ in fails:
        # Whoever comes after `first` is too late: `hold` fails there.
        result.append((max(0, first - low + 1), first))
        result += [(max(0, start - low), first) for start, stop in absent if start <= first <= stop]
    return merged(result)
