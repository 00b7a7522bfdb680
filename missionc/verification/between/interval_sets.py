"""Sets of time intervals in which a formula holds, operators on them, and a joint trajectory with time in whole ticks.

Whole ticks avoid rounding of times. Every formula has two closed sets: times at which it surely holds, and times at
which it surely fails. A time in neither set is undecided.

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
"""Number of ticks in a time step of the mission; steps and windows are multiples of a tick."""

ROUNDING = 1e-11
"""Bound on the rounding of a margin per metre (m/s) of the summed magnitudes of a polynomial's terms.

It is larger than the rounding of double precision.
"""

AT_STEP = 1e-9
"""Tolerance in steps: a time this little before a step counts as the step."""

FURTHER = 0.5 + 1e-9
"""Half the length of an interval, as a factor, with an allowance for rounding."""


@dataclass(eq=False)
class Motion:
    """Trajectories of all agents with time in ticks, from 0 to ``end`` (the last step).

    An agent is at rest before the first and after the last time of its curve. ``trace`` has the states at the steps; if
    None, they are computed from the curves.
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
        """Times at which the polynomial pieces meet, in ticks: (pieces + 1,)."""
        inner = np.rint(self.curves.times[1:-1] / self.mission.step * STEP).astype(np.int64)
        return np.concatenate([[0], np.clip(inner, 0, self.end), [self.end]])

    def seconds(self, tick: Indices | int) -> Array:
        """Times in seconds that correspond to times in ticks, of the same shape."""
        return np.asarray(np.asarray(tick) / STEP * self.mission.step)

    def local(self, piece: Indices, tick: Indices) -> Array:
        """Seconds since the start of the piece at each tick, (...), clipped to the duration of the piece."""
        since = self.seconds(tick) - self.curves.times[piece]
        return np.asarray(np.clip(since, 0.0, self.curves.durations[piece]))

    def piece_at(self, tick: Indices) -> Indices:
        """Index of the polynomial piece at each tick: (...) -> (...)."""
        return np.clip(np.searchsorted(self.joints, tick, side="right") - 1, 0, self.joints.size - 2).astype(np.int64)

    def stretches(self, *, by_step: bool) -> tuple[Indices, Indices, Indices]:
        """Polynomial pieces of positive duration: their indices, first ticks and last ticks, (stretches,) each.

        With ``by_step``, the pieces are also split at each step, and the last step is a separate interval.
        """
        if not by_step:
            there = np.flatnonzero(np.diff(self.joints) > 0)
            return there, self.joints[there], self.joints[there + 1]
        edges = np.unique(np.concatenate([self.joints, np.arange(0, self.end + 1, STEP)]))
        low, high = np.append(edges[:-1], self.end), np.append(edges[1:], self.end)
        return self.piece_at(low), low, high

    def position(self, agent: Indices, piece: Indices, local: Array) -> Array:
        """Positions of agents within their pieces, (...) -> (..., dim), metres."""
        return values(self.curves.coefficients[agent, piece], local)

    def velocity(self, agent: Indices, piece: Indices, local: Array) -> Array:
        """Velocities of agents within their pieces, (...) -> (..., dim), m/s."""
        return values(self._velocity.coefficients[agent, piece], local)

    def relative_speed(self, first: Indices, second: Indices) -> Array:
        """Upper bounds on the rate of change of the distance in each pair of agents: (pairs, pieces), m/s."""
        return speed_bounds(self.curves.between(first, second))

    def speed_along(self, agent: Indices, direction: Array) -> Array:
        """Upper bounds on the rate of change of a weighted sum of each agent's coordinates: (agents, pieces), per
        second.

        Args:
            direction: weight of each coordinate, (dim,).
        """
        weighted = np.einsum("apdo,d->apo", self.curves.coefficients[agent], direction)
        return speed_bounds(Curves(self.curves.times, weighted[:, :, None]))

    @cached_property
    def speed(self) -> Array:
        """Upper bounds on each agent's speed: (agents, pieces), m/s."""
        return speed_bounds(self.curves)

    @cached_property
    def acceleration(self) -> Array:
        """Upper bounds on each agent's acceleration: (agents, pieces), m/s²."""
        return speed_bounds(self._velocity)

    @cached_property
    def at_steps(self) -> Trace:
        """The agents' states at the steps of the mission."""
        if self.trace is not None:
            return self.trace
        tick, agents = np.arange(self.end // STEP + 1) * STEP, np.arange(len(self.curves.coefficients))[:, None]
        piece = self.piece_at(tick)
        position = self.position(np.broadcast_to(agents, (len(agents), len(tick))), piece, self.local(piece, tick))
        return Trace(self.mission.step, position, np.zeros_like(position), np.zeros(position.shape[:2]))

    def levels(self, resource: Resource) -> Array:
        """Levels of a resource for every agent at the steps, (agents, steps + 1), dimensionless."""
        if resource not in self._levels:
            self._levels[resource] = levels(resource, self.at_steps)
        return self._levels[resource]

    def level(self, resource: Resource, agent: Indices, piece: Indices, local: Array) -> Array:
        """Levels of a resource at given times, (...), dimensionless, interpolated linearly between steps."""
        known = self.levels(resource)
        time = (self.curves.times[piece] + local) / self.mission.step
        before = np.clip(np.floor(time), 0, known.shape[1] - 2).astype(np.int64)
        first, second = known[agent, before], known[agent, before + 1]
        return np.asarray(first + (second - first) * np.clip(time - before, 0.0, 1.0))

    def heading(self, agent: Indices, piece: Indices, local: Array) -> Array:
        """Headings of agents at given times, (...), rad: the heading at the preceding step, or at the step itself."""
        known = self.at_steps.heading
        time = (self.curves.times[piece] + local) / self.mission.step
        return np.asarray(known[agent, np.clip(np.floor(time + AT_STEP), 0, known.shape[1] - 1).astype(np.int64)])

    def use(self, resource: Resource) -> Array:
        """Upper bound on the rate of change of each agent's resource level, (agents,), per second."""
        return np.asarray(np.abs(np.diff(self.levels(resource), axis=1)).max(axis=1, initial=0.0) / self.mission.step)

    @cached_property
    def slack(self) -> float:
        """Error bound of a computed margin, metres (m/s): a margin beyond it has a certain sign."""
        held = max((resource.capacity for resource in self.mission.resources), default=0.0)
        terms = max(_size(self.curves), _size(self._velocity), held)
        fastest = max(float(self.speed.max(initial=0.0)), float(self.acceleration.max(initial=0.0)))
        return ROUNDING * (1.0 + terms) + fastest * self.mission.step / STEP

    def reach(self, low: Indices, high: Indices) -> Array:
        """Upper bound on the seconds from the middle of an interval, rounded to a whole tick, to its ends.

        Shape: (...) twice -> (...).
        """
        return self.seconds(high - low + 1) * FURTHER

    @cached_property
    def _velocity(self) -> Curves:
        return self.curves.derivative()


def _size(curves: Curves) -> float:
    """Upper bound on the sum of the magnitudes of a polynomial's terms, over all curves."""
    powers = curves.durations[:, None, None] ** np.arange(curves.coefficients.shape[-1])
    return float((np.abs(curves.coefficients) * powers).sum(axis=-1).max(initial=0.0))


Spans: TypeAlias = tuple[tuple[int, int], ...]
"""Disjoint closed time intervals in ticks, in order; ``(5, 5)`` is a single time."""


class Signal(Record):
    """Truth of a formula over time: the times at which it surely holds (``sure``) and surely fails (``never``)."""

    sure: Spans
    never: Spans

    @property
    def denied(self) -> Signal:
        return Signal(self.never, self.sure)


def merged(spans: Iterable[tuple[int, int]]) -> Spans:
    """Union of intervals as disjoint intervals in order; an interval that ends before its start is dropped."""
    result: list[tuple[int, int]] = []
    for low, high in sorted(span for span in spans if span[0] <= span[1]):
        if result and low <= result[-1][1]:
            result[-1] = (result[-1][0], max(result[-1][1], high))
        else:
            result.append((low, high))
    return tuple(result)


def common(one: Spans, other: Spans) -> Spans:
    """Intersection of two sets of intervals."""
    return at_least(2, (one, other), 0)


def at_least(count: int, parts: Sequence[Spans], end: int) -> Spans:
    """Times of 0 … ``end`` that at least ``count`` of the sets contain."""
    if count <= 0:
        return ((0, end),)
    if count > len(parts):
        return ()
    # An interval begins before another ends at the same tick: both contain it.
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
    """Signal of "at least ``count`` of the parts hold"; it surely fails if too few parts can hold."""
    return Signal(
        at_least(count, [part.sure for part in parts], end),
        at_least(len(parts) - count + 1, [part.never for part in parts], end),
    )


def sometime(body: Signal, low: int, high: int | None, end: int) -> Signal:
    """Signal of "``body`` holds at some time between ``low`` and ``high`` ticks ahead"; None means up to ``end``."""
    return Signal(_dilated(body.sure, low, high, end), _eroded(body.never, low, high, end))


def throughout(body: Signal, low: int, high: int | None, end: int) -> Signal:
    """Signal of "``body`` holds at every time between ``low`` and ``high`` ticks ahead"; None means up to ``end``."""
    return sometime(body.denied, low, high, end).denied


def until_over_time(hold: Signal, goal: Signal, low: int, high: int | None, end: int) -> Signal:
    """Signal of "``goal`` holds at some time of the window, and ``hold`` at every time from now until just before
    then".

    Args:
        low, high: the window in ticks ahead; None means up to ``end``.
    """
    return Signal(_until(hold.sure, goal.sure, low, high, end), _never_until(hold.never, goal.never, low, high, end))


def looking_back_over(measure: Callable[..., Signal], *parts: Signal, low: int, high: int, end: int) -> Signal:
    """Signal of ``sometime``, ``throughout`` or ``until`` over a window in the past.

    Before time 0, the last of the parts counts as false.

    Args:
        low, high: the window in ticks back, ``low`` the nearer bound.
    """
    *holds, awaited = (Signal(_reversed(part.sure, end), _reversed(part.never, end)) for part in parts)
    # Just after 0 backwards there is nothing; if it is false at 0 too, both intervals are one.
    begin = end if awaited.never and awaited.never[-1][1] == end else end + 1
    never = merged((*awaited.never, (begin, end + high)))
    found = measure(*holds, Signal(awaited.sure, never), low, high, end + high)
    known = ((0, end),)
    return Signal(_reversed(common(found.sure, known), end), _reversed(common(found.never, known), end))


def _reversed(spans: Spans, end: int) -> Spans:
    return tuple((end - last, end - first) for first, last in reversed(spans))


def asked_until(last: int, signal: Signal, end: int) -> Signal:
    """Signal that equals the given one up to the time ``last`` (ticks), and is true afterwards."""
    if last < 0:
        return Signal(((0, end),), ())
    sure, never = (common(spans, ((0, last),)) for spans in (signal.sure, signal.never))
    # Just after `last` there is no condition; closed sets can express this from the next tick on.
    begin = last if sure and sure[-1][1] == last else last + 1
    return Signal(merged((*sure, (begin, end))), never)


def _dilated(spans: Spans, low: int, high: int | None, end: int) -> Spans:
    """Times whose window ``low`` to ``high`` ahead contains some time of the set."""
    return merged(
        (0 if high is None else max(0, first - high), min(last, end) - low) for first, last in spans if last >= low
    )


def _eroded(spans: Spans, low: int, high: int | None, end: int) -> Spans:
    """Times whose window ``low`` to ``high`` ahead lies in the set completely."""
    if high is None:
        return merged((max(0, first - low), end - low) for first, last in spans if last >= end)
    return merged((max(0, first - low), last - high) for first, last in spans)


def _until(hold: Spans, goal: Spans, low: int, high: int | None, end: int) -> Spans:
    now = [goal] if low == 0 else []
    later = [common((span,), _dilated(common((span,), goal), low, high, end)) for span in hold]
    return merged(span for spans in (*now, *later) for span in spans)


def _never_until(fails: Spans, absent: Spans, low: int, high: int | None, end: int) -> Spans:
    """Inner approximation of the times at which ``until`` surely fails: ``goal`` is absent up to the first failure of
    ``hold``.

    Args:
        fails: times at which ``hold`` surely fails.
        absent: times at which ``goal`` surely fails.
    """
    result = [*_eroded(absent, low, high, end), *(fails if low > 0 else common(fails, absent))]
    for first, _ in fails:
        # A time after `first` is too late: `hold` fails there.
        result.append((max(0, first - low + 1), first))
        result += [(max(0, start - low), first) for start, stop in absent if start <= first <= stop]
    return merged(result)
