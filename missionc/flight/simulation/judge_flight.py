"""Evaluation of one simulated flight: tracking error, requirements on the flown path, clearance of bodies.

    in   Mission, its kernel, the planned and the flown positions
    out  Flight

Requirements are evaluated at the mission's steps, like a plan's. Clearances are evaluated in continuous time, with
straight motion between samples.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Judgement, Trace
from missionc.base.units import Metres
from missionc.geometry.curves.piecewise_polynomials import Curves
from missionc.geometry.vectors import norm
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.certificate import Check
from missionc.verification.monitoring.monitor import monitor
from missionc.verification.plan.clearances import check_obstacles, relative_margins

USUAL = 0.95
"""Quantile of the tracking error that counts as usual; larger errors are rare."""


class Error(Record):
    """Tracking error of an agent over a flight, m: mean, ``USUAL`` quantile, and maximum with its time."""

    mean: float
    usual: float
    most: float
    at: float


class Flight(Record, eq=False):
    """Evaluation of one simulated flight.

    Args:
        error: error of each agent while its motors turn.
        largest: (samples,), m: largest error of any agent over time.
        trace: states at the mission's steps.
        requirements, preferences: evaluated on ``trace``.
        room: minimum clearance between two bodies, and between bodies and each obstacle, m; negative if they overlap.
    """

    error: tuple[Error, ...]
    largest: Array
    trace: Trace
    requirements: tuple[Judgement, ...]
    preferences: tuple[Judgement, ...]
    room: tuple[Check, ...]

    @property
    def satisfied(self) -> bool:
        return all(each.satisfied for each in self.requirements)

    @property
    def untouched(self) -> bool:
        return all(check.margin >= 0 for check in self.room)


def judge(
    mission: Mission,
    kernel: Kernel,
    times: Array,
    planned: Array,
    position: Array,
    velocity: Array,
    heading: Array,
    lost: Mapping[int, float] | None = None,
) -> Flight:
    """Evaluation of a simulated flight against its mission.

    Args:
        times: (samples,), s, from 0 to the end of the mission or past it.
        planned: (agents, samples, 3), planned positions, m.
        position, velocity: (agents, samples, 3), m and m/s.
        heading: (agents, samples), rad.
        lost: stop times of agents' motors, s: afterwards their errors do not count.
    """
    trace = at_steps(mission, times, position, velocity, heading)
    judged = monitor(mission, kernel, trace)
    error = tracking_error(times, planned, position, lost or {})
    return Flight(
        tuple(_error(times, own) for own in error),
        np.nan_to_num(error).max(axis=0),
        trace,
        judged.requirements,
        judged.preferences,
        tuple(room(mission, times, position)),
    )


def tracking_error(times: Array, planned: Array, position: Array, lost: Mapping[int, float]) -> Array:
    """Distance of each agent from its planned position: (agents, samples), metres.

    It is NaN after the agent's motors have stopped, but never in the first sample.

    Args:
        planned, position: (agents, samples, 3), metres.
        lost: stop times of agents' motors, s.
    """
    error = norm(position - planned)
    for agent, when in lost.items():
        error[agent, max(1, int(np.searchsorted(times, when))) :] = np.nan
    return error


def _error(times: Array, error: Array) -> Error:
    error = error[~np.isnan(error)]
    last = int(error.argmax())
    return Error(float(error.mean()), float(np.quantile(error, USUAL)), float(error[last]), float(times[last]))


def at_steps(mission: Mission, times: Array, position: Array, velocity: Array, heading: Array) -> Trace:
    """States at the mission's steps, interpolated between two samples.

    Args:
        times: (samples,), s.
        position, velocity: (agents, samples, 3), m and m/s.
        heading: (agents, samples), rad.
    """
    steps = mission.step * np.arange(mission.steps + 1)
    after = np.clip(np.searchsorted(times, steps - 1e-9), 1, times.size - 1)
    share = np.clip((steps - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)

    def between(values: Array) -> Array:
        first, second = values[:, after - 1, : mission.dimension], values[:, after, : mission.dimension]
        return np.asarray(first + share[:, None] * (second - first))

    return Trace(mission.step, between(position), between(velocity), heading[:, after - (share < 0.5)])


def room(mission: Mission, times: Array, position: Array) -> Iterable[Check]:
    """Checks of the minimum clearance between bodies and from obstacles along sampled paths.

    Horizontal in a plane mission.

    Args:
        position: (agents, samples, 3), metres.
    """
    level = position[..., : mission.dimension]
    slope = np.diff(level, axis=1) / np.diff(times)[:, None]
    curves = Curves(times, np.stack([level[:, :-1], slope], axis=-1))
    bare = replace(mission, clearance=Metres(0.0))
    return (*_between(mission, curves), *(check_obstacles(bare, curves) if bare.obstacles else ()))


def _between(mission: Mission, curves: Curves) -> Iterable[Check]:
    """Check of the minimum clearance between two bodies, straight between samples; empty for a single agent."""
    radii = np.array([agent.radius for agent in mission.agents])
    nearest, pair, at = np.inf, (0, 1), 0.0
    for first in range(len(radii) - 1):
        rest = np.arange(first + 1, len(radii))
        free, _, when = relative_margins(curves.between(rest, np.array([first])), radii[rest] + radii[first], None)
        if free.min() < nearest:
            other, piece = divmod(int(free.argmin()), curves.durations.size)
            nearest, pair = float(free.min()), (first, first + 1 + other)
            at = float(curves.times[piece] + when[free.argmin()])
    if len(radii) > 1:
        names = tuple(mission.agents[agent].name for agent in pair)
        detail = "no bodies touch in continuous time"
        yield Check("separation", "all pairs", nearest, "m", 0.0, nearest >= 0, at, names, detail)
