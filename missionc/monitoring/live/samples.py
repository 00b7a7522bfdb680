"""Samples of single agents, as they come, put together to the team's states at the mission's steps.

A step is closed when every agent has a sample at it or after it, or when some sample is later than it by more than
the wait. Between two samples an agent moves straight, if they are a step apart at most. Of an agent without them its
nearest sample is known, and how far it gets in between at its top speed: it is missing at that step.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from missionc.base.trace import Array
from missionc.ir import Mission

ON_TIME = 1e-6
"""Seconds: a sample so near to a step is at it, and two of an agent so near to each other are one."""

PLAUSIBLE = 10.0
"""Seconds: a sample further ahead than so much, and than three steps and the wait, has to be confirmed."""

UNSEEN = 1e9
"""Metres: how far an agent may be from anywhere before its first sample came."""


@dataclass(frozen=True, slots=True)
class Sample:
    """What is said of one agent (by mission index) at one time, seconds since the mission began.

    ``velocity`` is empty, and ``heading`` (rad) not a number, where nothing is said of them.
    """

    agent: int
    time: float
    position: tuple[float, ...]
    velocity: tuple[float, ...] = ()
    heading: float = float("nan")


class Fate(Enum):
    """What becomes of a sample that is not simply the agent's newest."""

    LATE = "late"
    """Its step was closed: it is dropped."""
    DOUBLED = "doubled"
    """There is one of the agent at that time, which counts: it is dropped."""
    AHEAD = "ahead"
    """It is too far ahead of all others to be believed alone: it is set aside until another one confirms it."""
    REORDERED = "reordered"
    """One of the agent with a later time came before it: it is sorted in."""


@dataclass(frozen=True, slots=True, eq=False)
class StepState:
    """The team at one step: arrays as of ``LiveJudge.advance``, and the agents that are missing (mission indices)."""

    step: int
    position: Array
    velocity: Array
    heading: Array
    doubt: Array
    missing: tuple[int, ...]


@dataclass(slots=True)
class _Track:
    """The samples of one agent that may still matter, in order of time."""

    times: list[float] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)


class SampleSteps:
    """A stream of samples on its way to steps. It holds no more than what came within the wait, and one sample before.

    Args:
        wait: seconds of the stream's own time; one step where it is left out.
        skew: by how many seconds the clock of an agent (mission index) is ahead.
        leap: seconds that a sample may be ahead of all others before another one has to confirm it; a step at least.
    """

    def __init__(
        self,
        mission: Mission,
        wait: float | None = None,
        skew: Mapping[int, float] | None = None,
        leap: float | None = None,
    ) -> None:
        self.mission, self.skew = mission, dict(skew or {})
        self.wait = float(mission.step) if wait is None else wait
        step = float(mission.step)
        self.leap = max(PLAUSIBLE, 3 * step + self.wait) if leap is None else max(leap, step)
        self.ahead: dict[int, tuple[float, Sample]] = {}
        self.tracks = [_Track() for _ in mission.agents]
        self.top_speed = [agent.dynamics.top_speed for agent in mission.agents]
        self.next = 0
        self.newest = -np.inf
        self.ready = 0
        self.fates: Counter[Fate] = Counter()
        self.late: Counter[int] = Counter()
        self._before: Array | None = None

    @property
    def over(self) -> bool:
        """Whether every step of the mission is closed."""
        return self.next > self.mission.steps

    def add(self, sample: Sample) -> Iterator[StepState]:
        """The steps that a sample closes, in order."""
        time = sample.time - self.skew.get(sample.agent, 0.0)
        confirmed = self._is_far(time)
        if confirmed and not self._is_confirmed(sample.agent, time):
            doubled = abs(self.ahead.get(sample.agent, (-np.inf, sample))[0] - time) <= ON_TIME
            self.fates[Fate.DOUBLED if doubled else Fate.AHEAD] += 1
            self.ahead[sample.agent] = time, sample
            return
        yield from self._take(sample, time)
        # Whom this one confirms, and whom the others have caught up with.
        for agent, (held, other) in sorted(self.ahead.items(), key=lambda item: item[1][0]):
            if held <= self.newest or (confirmed and not self._is_far(held)):
                del self.ahead[agent]
                self.fates[Fate.AHEAD] -= 1
                yield from self._take(other, held)

    def _is_far(self, time: float) -> bool:
        return time > max(self.newest, 0.0) + self.leap

    def _is_confirmed(self, agent: int, time: float) -> bool:
        """Whether a sample that was set aside, of another agent or of another time, says that it is about then."""
        return any(
            abs(held - time) <= self.leap and (other != agent or abs(held - time) > ON_TIME)
            for other, (held, _) in self.ahead.items()
        )

    def _take(self, sample: Sample, time: float) -> Iterator[StepState]:
        track = self.tracks[sample.agent]
        if time <= self._time(self.next - 1) + (ON_TIME if self.next else -np.inf):
            self.fates[Fate.LATE] += 1
            self.late[sample.agent] += 1
            return
        place = bisect_left(track.times, time)
        near = track.times[max(place - 1, 0) : place + 1]
        if any(abs(each - time) <= ON_TIME / 2 for each in near):
            self.fates[Fate.DOUBLED] += 1
            return
        was_ready = bool(track.times) and track.times[-1] >= self._time(self.next) - ON_TIME
        if place < len(track.times):
            self.fates[Fate.REORDERED] += 1
        insort(track.times, time)
        track.samples.insert(place, sample)
        self.newest = max(self.newest, time)
        self.ready += not was_ready and time >= self._time(self.next) - ON_TIME
        yield from self._closed()

    def finish(self) -> Iterator[StepState]:
        """The steps that the stream has reached when it ends."""
        while not self.over and self._time(self.next) <= self.newest + ON_TIME:
            yield self._close()

    def _time(self, step: int) -> float:
        return step * float(self.mission.step)

    def _closed(self) -> Iterator[StepState]:
        while not self.over:
            waited = self.newest > self._time(self.next) + self.wait + ON_TIME
            if self.ready < len(self.tracks) and not waited:
                return
            yield self._close()

    def _close(self) -> StepState:
        step, now = self.next, self._time(self.next)
        agents, dim = len(self.tracks), self.mission.dimension
        position, velocity = np.zeros((agents, dim)), np.full((agents, dim), np.nan)
        heading, doubt = np.zeros(agents), np.zeros(agents)
        missing = []
        for agent, track in enumerate(self.tracks):
            apart = self._at(track, now, agent, position, velocity, heading)
            if apart > 0:
                missing.append(agent)
                doubt[agent] = min(apart * self.top_speed[agent], UNSEEN)
        before = position if self._before is None else self._before
        velocity = np.where(np.isnan(velocity), (position - before) / float(self.mission.step), velocity)
        velocity[missing] = 0.0
        self._before = position
        self.next += 1
        self.ready = 0
        for track in self.tracks:
            # The last sample before the step is where the way to the next one begins.
            drop = max(bisect_left(track.times, now + ON_TIME) - 1, 0)
            del track.times[:drop], track.samples[:drop]
            self.ready += bool(track.times) and track.times[-1] >= self._time(self.next) - ON_TIME
        return StepState(step, position, velocity, heading, doubt, tuple(missing))

    def _at(self, track: _Track, now: float, agent: int, position: Array, velocity: Array, heading: Array) -> float:
        """Write an agent's state; how many seconds from there its nearest sample is, 0 where the state is known."""
        times, samples = track.times, track.samples
        after = bisect_left(times, now - ON_TIME)
        if after < len(times) and times[after] <= now + ON_TIME:
            _write(samples[after], agent, position, velocity, heading)
            return 0.0
        if 0 < after < len(times) and times[after] - times[after - 1] <= self.mission.step + ON_TIME:
            here, there = samples[after - 1], samples[after]
            share, span = now - times[after - 1], times[after] - times[after - 1]
            _write(here, agent, position, velocity, heading)
            position[agent] += (np.array(there.position) - position[agent]) / span * share
            if here.velocity and there.velocity:
                velocity[agent] += (np.array(there.velocity) - velocity[agent]) / span * share
            return 0.0
        if not times:
            return np.inf
        nearest = min(
            (place for place in (after - 1, after) if 0 <= place < len(times)), key=lambda p: abs(times[p] - now)
        )
        _write(samples[nearest], agent, position, velocity, heading)
        return abs(times[nearest] - now)


def _write(sample: Sample, agent: int, position: Array, velocity: Array, heading: Array) -> None:
    position[agent] = sample.position
    velocity[agent] = sample.velocity or np.nan
    heading[agent] = 0.0 if np.isnan(sample.heading) else sample.heading
