"""The clock of signals, in whole ticks, and joint motion on it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.curves.piecewise_polynomials import Curves, Indices, speed_bounds, values
from missionc.ir import Mission, Resource
from missionc.language.margins.resources import levels

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
