"""Sets of time intervals in which a formula holds, operators on them, and the clock of joint motion.

Time is counted in whole ticks, so nothing here rounds. Every formula has two known sets: the times at which it surely
holds, and those at which it surely does not. Both are closed, and neither claims too much. A time in neither is
undecided.

Source:
    Maler and Nickovic, "Monitoring Temporal Properties of Continuous Signals" (2004), section 3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeAlias

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices, Trace
from missionc.geometry.curves.piecewise_polynomials import Curves, speed_bounds, values
from missionc.ir import Mission, Resource
from missionc.ir.language.margins.resources import levels

STEP = 1 << 32
"""Ticks in a step of the mission: steps, and so windows, are whole ticks."""

ROUNDING = 1e-11
"""The rounding of a margin, for each metre (m/s) of the sum of a polynomial's terms: more than floating point makes."""

AT_STEP = 1e-9
"""Steps: a moment so little before a step is at it."""

FURTHER = 0.5 + 1e-9
"""How far a stretch reaches from its middle, in its own length and one tick; a little more, for rounding."""


@dataclass(eq=False)
class Motion:
    """Curves, and their time in ticks: from 0 to ``end``, where the last step is.

    Before its first moment and after its last one a curve stays where it is. ``trace`` has the states that they pass
    through at the steps; where it is left out they are looked up.
    """

    mission: Mission
    curves: Curves
    trace: Trace | None = None
    _levels: dict[Resource, Array] = field(default_factory=dict)

    @property
    def end(self) -> int:
        return round(float(self.curves.times[-1]) / self.mission.step) * STEP

    @cached_property
    def joints(self) -> Indices:
        """(pieces + 1,): in ticks, where one piece ends and the next one begins."""
        inner = np.rint(self.curves.times[1:-1] / self.mission.step * STEP).astype(np.int64)
        return np.concatenate([[0], np.clip(inner, 0, self.end), [self.end]])

    def seconds(self, tick: Indices | int) -> Array:
        """(...) -> (...)"""
        return np.asarray(np.asarray(tick) / STEP * self.mission.step)

    def local(self, piece: Indices, tick: Indices) -> Array:
        """The seconds that a piece has gone by then, (...); none before it, no more than it lasts."""
        since = self.seconds(tick) - self.curves.times[piece]
        return np.asarray(np.clip(since, 0.0, self.curves.durations[piece]))

    def piece_at(self, tick: Indices) -> Indices:
        """The piece that a tick falls into: (...) -> (...)."""
        return np.clip(np.searchsorted(self.joints, tick, side="right") - 1, 0, self.joints.size - 2).astype(np.int64)

    def stretches(self, *, by_step: bool) -> tuple[Indices, Indices, Indices]:
        """The pieces that last, and from when to when each does, in ticks: (stretches,) three times.

        ``by_step``: they end at each step as well, and the last step is a stretch of its own.
        """
        if not by_step:
            there = np.flatnonzero(np.diff(self.joints) > 0)
            return there, self.joints[there], self.joints[there + 1]
        edges = np.unique(np.concatenate([self.joints, np.arange(0, self.end + 1, STEP)]))
        low, high = np.append(edges[:-1], self.end), np.append(edges[1:], self.end)
        return self.piece_at(low), low, high

    def position(self, agent: Indices, piece: Indices, local: Array) -> Array:
        """(...) -> (..., dim), metres."""
        return values(self.curves.coefficients[agent, piece], local)

    def velocity(self, agent: Indices, piece: Indices, local: Array) -> Array:
        """(...) -> (..., dim), m/s."""
        return values(self._velocity.coefficients[agent, piece], local)

    def relative_speed(self, first: Indices, second: Indices) -> Array:
        """(pairs, pieces), m/s: the distance of two agents changes no faster."""
        return speed_bounds(self.curves.between(first, second))

    def speed_along(self, agent: Indices, direction: Array) -> Array:
        """(agents, pieces), per second: the coordinates, weighted by (dim,), change no faster."""
        weighted = np.einsum("apdo,d->apo", self.curves.coefficients[agent], direction)
        return speed_bounds(Curves(self.curves.times, weighted[:, :, None]))

    @cached_property
    def speed(self) -> Array:
        """(agents, pieces), m/s: none is faster."""
        return speed_bounds(self.curves)

    @cached_property
    def acceleration(self) -> Array:
        """(agents, pieces), m/s²."""
        return speed_bounds(self._velocity)

    @cached_property
    def at_steps(self) -> Trace:
        """The states at the steps."""
        if self.trace is not None:
            return self.trace
        tick, agents = np.arange(self.end // STEP + 1) * STEP, np.arange(len(self.curves.coefficients))[:, None]
        piece = self.piece_at(tick)
        position = self.position(np.broadcast_to(agents, (len(agents), len(tick))), piece, self.local(piece, tick))
        return Trace(self.mission.step, position, np.zeros_like(position), np.zeros(position.shape[:2]))

    def levels(self, resource: Resource) -> Array:
        """What every agent has left at the steps, (agents, steps + 1)."""
        if resource not in self._levels:
            self._levels[resource] = levels(resource, self.at_steps)
        return self._levels[resource]

    def level(self, resource: Resource, agent: Indices, piece: Indices, local: Array) -> Array:
        """What agents have left, (...): between two steps it changes evenly."""
        known = self.levels(resource)
        time = (self.curves.times[piece] + local) / self.mission.step
        before = np.clip(np.floor(time), 0, known.shape[1] - 2).astype(np.int64)
        first, second = known[agent, before], known[agent, before + 1]
        return np.asarray(first + (second - first) * np.clip(time - before, 0.0, 1.0))

    def heading(self, agent: Indices, piece: Indices, local: Array) -> Array:
        """Where agents face, (...), rad: where they faced at the step before, or face at that very step."""
        known = self.at_steps.heading
        time = (self.curves.times[piece] + local) / self.mission.step
        return np.asarray(known[agent, np.clip(np.floor(time + AT_STEP), 0, known.shape[1] - 1).astype(np.int64)])

    def use(self, resource: Resource) -> Array:
        """By how much what is left changes at most, (agents,), per second."""
        return np.asarray(np.abs(np.diff(self.levels(resource), axis=1)).max(axis=1, initial=0.0) / self.mission.step)

    @cached_property
    def slack(self) -> float:
        """Metres (m/s): a margin beyond it has the sign that it seems to have."""
        held = max((resource.capacity for resource in self.mission.resources), default=0.0)
        terms = max(_size(self.curves), _size(self._velocity), held)
        fastest = max(float(self.speed.max(initial=0.0)), float(self.acceleration.max(initial=0.0)))
        return ROUNDING * (1.0 + terms) + fastest * self.mission.step / STEP

    def reach(self, low: Indices, high: Indices) -> Array:
        """Seconds from the middle of a stretch, in whole ticks, to its ends, at most: (...) twice -> (...)."""
        return self.seconds(high - low + 1) * FURTHER

    @cached_property
    def _velocity(self) -> Curves:
        return self.curves.derivative()


def _size(curves: Curves) -> float:
    """What the sizes of a polynomial's terms add up to, at most."""
    powers = curves.durations[:, None, None] ** np.arange(curves.coefficients.shape[-1])
    return float((np.abs(curves.coefficients) * powers).sum(axis=-1).max(initial=0.0))


Spans: TypeAlias = tuple[tuple[int, int], ...]
"""Closed intervals in ticks, in order, none touching another. (5, 5) is a moment."""


class Signal(Record):
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


def until_over_time(hold: Signal, goal: Signal, low: int, high: int | None, end: int) -> Signal:
    """``goal`` at some moment of the window, and ``hold`` at every moment from now up to, not at, that one."""
    return Signal(_until(hold.sure, goal.sure, low, high, end), _never_until(hold.never, goal.never, low, high, end))


def looking_back_over(measure: Callable[..., Signal], *parts: Signal, low: int, high: int, end: int) -> Signal:
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
