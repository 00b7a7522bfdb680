"""Team states at the mission's steps, assembled from samples of single agents in lines of JSON.

    in   a line, the Mission
    out  samples, or the reason why there are none; states of the team

Between two samples at most one step apart an agent moves straight. Without such samples, the state is the nearest known
state, with the distance that the agent can move from there at its top speed: the agent is missing at that step.

A step is *closed* when every agent has a sample at or after the step, or when some sample is later than the step by
more than the wait. A step is *settled* when no sample that comes within the wait can change its state: every agent has
a sample at the step itself, or the stream is past the next sample of the agent by the wait. Until then a state between
samples includes the position uncertainty due to a sample that may still come, so every result from the state remains
true with that sample.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.strict_json import NotJsonError, parse_record
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.ir.kernel.analysis import agents_asked
from missionc.ir.kernel.nodes import Atom, Kernel
from missionc.ir.kernel.walk import postorder
from missionc.verification.monitoring.read_trace import ON_TIME

PLAUSIBLE = 10.0
"""Lead in seconds, besides three steps and the wait, beyond which a sample needs confirmation by another sample."""

UNSEEN = 1e9
"""Bound on the distance of an agent from its assumed position before its first sample, metres."""


class Sample(Record):
    """Measured state of one agent (by mission index) at one time, seconds of mission time.

    ``velocity`` is empty, and ``heading`` (rad) is NaN, if not given.
    """

    agent: int
    time: float
    position: tuple[float, ...]
    velocity: tuple[float, ...] = ()
    heading: float = float("nan")


class Fate(Enum):
    """Treatment of a sample that is not simply the agent's newest sample."""

    LATE = "late"
    """The sample is dropped because its step is settled."""
    DOUBLED = "doubled"
    """The sample is dropped because the agent already has a sample at that time."""
    AHEAD = "ahead"
    """The sample is set aside because it is far ahead of all others, until another sample confirms it."""
    REORDERED = "reordered"
    """The sample arrived after a later sample of the agent and is sorted in."""


class StepState(Record, eq=False):
    """State of the team at one step: arrays as for ``LiveJudge.advance``, and the missing agents (mission indices).

    ``settled`` is True if no sample that arrives within the wait can change the state.
    """

    step: int
    position: Array
    velocity: Array
    heading: Array
    doubt: Array
    missing: tuple[int, ...]
    settled: bool = True


@dataclass(slots=True)
class _Track:
    """Samples of one agent that may still affect a state, in order of time."""

    times: list[float] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)

    def reaches(self, time: float) -> bool:
        """Return whether the agent has a sample at or after a time."""
        return bool(self.times) and self.times[-1] >= time - ON_TIME

    def since(self, time: float) -> float:
        """Time of the agent's first sample at or after a time; infinite without such a sample."""
        place = bisect_left(self.times, time - ON_TIME)
        return self.times[place] if place < len(self.times) else np.inf

    def has(self, time: float) -> bool:
        """Return whether the agent has a sample at a time."""
        return self.since(time) <= time + ON_TIME


class SampleSteps:
    """Converter from a stream of samples to team states at steps; it stores the samples within the wait and one before.

    Args:
        wait: seconds of the stream's own time; default one step.
        skew: seconds by which the clock of an agent (mission index) is ahead.
        leap: seconds by which a sample may be ahead of all others without confirmation; at least a step.
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
        self.closed = self.settled = 0
        """``closed``: the first step that is not closed; ``settled``: the first step that is not settled."""
        self.newest = -np.inf
        self.fates: Counter[Fate] = Counter()
        self._reached = self._known = 0
        """``_reached``: number of agents with a sample at or after the next step to close.

        ``_known``: the next step to settle.
        """
        self._settles_at: float | None = None
        self._places: dict[int, Array] = {}

    @property
    def over(self) -> bool:
        """True if every step of the mission is settled."""
        return self.settled > self.mission.steps

    def add(self, sample: Sample) -> Iterator[StepState]:
        """Process a sample; yield the states of the steps that it closes or settles.

        Each step is settled once, in order, possibly when it is closed.
        """
        time = sample.time - self.skew.get(sample.agent, 0.0)
        confirmed = self._is_far(time)
        if confirmed and not self._is_confirmed(sample.agent, time):
            doubled = abs(self.ahead.get(sample.agent, (-np.inf, sample))[0] - time) <= ON_TIME
            self.fates[Fate.DOUBLED if doubled else Fate.AHEAD] += 1
            self.ahead[sample.agent] = time, sample
            return
        yield from self._take(sample, time)
        # Samples that this one confirms, and those that the others have caught up with.
        for agent, (held, other) in sorted(self.ahead.items(), key=lambda item: item[1][0]):
            if held <= self.newest or (confirmed and not self._is_far(held)):
                del self.ahead[agent]
                self.fates[Fate.AHEAD] -= 1
                yield from self._take(other, held)

    def _is_far(self, time: float) -> bool:
        return time > max(self.newest, 0.0) + self.leap

    def _is_confirmed(self, agent: int, time: float) -> bool:
        """Return whether a sample set aside earlier, of another agent or another time, confirms a sample at
        this time.
        """
        return any(
            abs(held - time) <= self.leap and (other != agent or abs(held - time) > ON_TIME)
            for other, (held, _) in self.ahead.items()
        )

    def _take(self, sample: Sample, time: float) -> Iterator[StepState]:
        track, now = self.tracks[sample.agent], self._time(self.settled)
        if self.settled and time <= self._time(self.settled - 1) + ON_TIME:
            self.fates[Fate.LATE] += 1
            return
        place = bisect_left(track.times, time)
        near = track.times[max(place - 1, 0) : place + 1]
        if any(abs(each - time) <= ON_TIME / 2 for each in near):
            self.fates[Fate.DOUBLED] += 1
            return
        reached, known = track.reaches(self._time(self.closed)), track.has(now)
        if place < len(track.times):
            self.fates[Fate.REORDERED] += 1
        track.times.insert(place, time)
        track.samples.insert(place, sample)
        self.newest = max(self.newest, time)
        self._reached += track.reaches(self._time(self.closed)) - reached
        self._known += track.has(now) - known
        if time <= now + self.mission.step:
            self._settles_at = None
        yield from self._ready()

    def finish(self) -> Iterator[StepState]:
        """Process the end of the stream; yield the states of all steps that the samples have reached, as settled."""
        while not self.over and self._time(self.settled) <= self.newest + ON_TIME:
            yield self._settle()

    def _time(self, step: int) -> float:
        return step * float(self.mission.step)

    def _ready(self) -> Iterator[StepState]:
        while not self.over:
            if self._is_settled():
                yield self._settle()
            elif self.closed > self.mission.steps:
                return
            elif self._reached == len(self.tracks) or self.newest > self._time(self.closed) + self.wait + ON_TIME:
                yield self._state(self.closed, False)
                self._close(self.closed)
            else:
                return

    def _is_settled(self) -> bool:
        now, step = self._time(self.settled), float(self.mission.step)
        if self._known == len(self.tracks):
            return True
        if self.newest < now + self.wait:
            return False
        if self._settles_at is None:
            latest = now + step + 2 * ON_TIME
            opened = (track for track in self.tracks if not track.has(now))
            self._settles_at = max(min(track.since(now), latest) for track in opened) + self.wait
        return self.newest >= self._settles_at

    def _close(self, step: int) -> None:
        self.closed = step + 1
        self._reached = sum(track.reaches(self._time(self.closed)) for track in self.tracks)

    def _settle(self) -> StepState:
        now = self._time(self.settled)
        state = self._state(self.settled, True)
        self.settled += 1
        self._settles_at = None
        for track in self.tracks:
            # The motion to the next step begins at the last sample before the step.
            drop = max(bisect_left(track.times, now + ON_TIME) - 1, 0)
            del track.times[:drop], track.samples[:drop]
        self._known = sum(track.has(self._time(self.settled)) for track in self.tracks)
        self._places.pop(state.step - 1, None)
        if self.closed < self.settled:
            self._close(state.step)
        return state

    def _state(self, step: int, settled: bool) -> StepState:
        now = self._time(step)
        agents, dim = len(self.tracks), self.mission.dimension
        position, velocity = np.zeros((agents, dim)), np.full((agents, dim), np.nan)
        heading, doubt = np.zeros(agents), np.zeros(agents)
        missing = []
        for agent, track in enumerate(self.tracks):
            is_missing, metres = self._at(track, now, agent, position, velocity, heading)
            if is_missing:
                missing.append(agent)
            if is_missing or not settled:
                doubt[agent] = min(metres, UNSEEN)
        before = self._places.get(step - 1, position)
        velocity = np.where(np.isnan(velocity), (position - before) / float(self.mission.step), velocity)
        velocity[missing] = 0.0
        self._places[step] = position
        return StepState(step, position, velocity, heading, doubt, tuple(missing), settled)

    def _at(
        self, track: _Track, now: float, agent: int, position: Array, velocity: Array, heading: Array
    ) -> tuple[bool, float]:
        """Write an agent's state at a time into the arrays.

        Args:
            position, velocity: (agents, dim), metres and m/s.
            heading: (agents,), rad.

        Returns:
            True if the agent is missing, and the maximum distance in metres of the agent from the written position.
            The
            distance holds for any later sample; it is 0 if there is a sample at this time.
        """
        times, samples, top = track.times, track.samples, self.top_speed[agent]
        after = bisect_left(times, now - ON_TIME)
        if after < len(times) and times[after] <= now + ON_TIME:
            _write(samples[after], agent, position, velocity, heading)
            return False, 0.0
        if not times:
            return True, np.inf
        nearest = min(
            (place for place in (after - 1, after) if 0 <= place < len(times)), key=lambda p: abs(times[p] - now)
        )
        away = abs(times[nearest] - now)
        if 0 < after < len(times) and times[after] - times[after - 1] <= self.mission.step + ON_TIME:
            here, there = samples[after - 1], samples[after]
            share, span = now - times[after - 1], times[after] - times[after - 1]
            _write(here, agent, position, velocity, heading)
            mean = (np.array(there.position) - position[agent]) / span
            position[agent] += mean * share
            if here.velocity and there.velocity:
                velocity[agent] += (np.array(there.velocity) - velocity[agent]) / span * share
            return False, away * (top + float(np.linalg.norm(mean)))
        _write(samples[nearest], agent, position, velocity, heading)
        return True, away * top


def _write(sample: Sample, agent: int, position: Array, velocity: Array, heading: Array) -> None:
    position[agent] = sample.position
    velocity[agent] = sample.velocity or np.nan
    heading[agent] = 0.0 if np.isnan(sample.heading) else sample.heading


class UnusableError(ValueError):
    """Error: a line has no usable data; the text gives the reason."""


class SampleReader:
    """Reader of lines such as ``{"t": 1.25, "agent": "drone[0]", "position": [1, 2], "velocity": [0, 1], "heading":
    0.5}``.

    Instead of ``agent`` and ``position``, ``agents`` may have the positions of several agents, by name. A velocity is
    required for agents whose speed the mission uses, and a heading if it uses headings. A plane mission ignores a third
    coordinate, and sets ``flattened``.
    """

    def __init__(self, mission: Mission, kernel: Kernel, limits: Limits | None = None) -> None:
        self.dimension, self.magnitude = mission.dimension, (limits or Limits()).magnitude
        self.flattened = False
        self.index = {agent.name: agent.index for agent in mission.agents}
        self.needs_velocity: set[int] = set()
        self.needs_heading: set[int] = set()
        for goal in kernel.goals:
            reads = [node for node in postorder((goal.formula,)) if isinstance(node, Atom)]
            if any(node.predicate.reads_speed or node.predicate.reads_heading for node in reads):
                asked = agents_asked(goal.formula)
                for node in reads:
                    if node.predicate.reads_speed:
                        self.needs_velocity |= asked[node]
                    if node.predicate.reads_heading:
                        self.needs_heading |= asked[node]

    def read(self, line: str) -> list[Sample]:
        """Samples that a line contains.

        Raises:
            UnusableError: the line has no usable data.
        """
        try:
            record = parse_record(line)
        except NotJsonError as error:
            raise UnusableError(error.reason) from None
        time = self._number(record.get("t"), "`t`")
        if "agents" in record:
            agents = record["agents"]
            if not isinstance(agents, dict):
                raise UnusableError("`agents` is not a record of positions by agent name")
            return [self._sample(name, time, {"position": position}) for name, position in agents.items()]
        return [self._sample(record.get("agent"), time, record)]

    def _sample(self, name: Any, time: float, record: dict[str, Any]) -> Sample:
        if not isinstance(name, str):
            raise UnusableError("`agent` is not the name of an agent")
        if name not in self.index:
            raise UnusableError(f"the mission has no agent `{name[:40]}`")
        agent = self.index[name]
        position = self._vector(record.get("position"), "position", name)
        velocity: tuple[float, ...] = ()
        if record.get("velocity") is not None:
            velocity = self._vector(record["velocity"], "velocity", name)
        elif agent in self.needs_velocity:
            raise UnusableError(f"missing `velocity` of `{name}`: the mission uses its speed")
        heading = math.nan
        if record.get("heading") is not None:
            heading = self._number(record["heading"], f"`heading` of `{name}`")
        elif agent in self.needs_heading:
            raise UnusableError(f"missing `heading` of `{name}`: the mission uses its heading")
        return Sample(agent, time, position, velocity, heading)

    def _vector(self, value: Any, key: str, name: str) -> tuple[float, ...]:
        if not isinstance(value, list) or len(value) not in (self.dimension, 3):
            raise UnusableError(f"`{key}` of `{name}` is not a list of {self.dimension} numbers")
        self.flattened |= len(value) > self.dimension
        return tuple(self._number(each, f"`{key}` of `{name}`") for each in value)[: self.dimension]

    def _number(self, value: Any, what: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise UnusableError(f"{what} is not a finite number")
        if abs(value) > self.magnitude:
            raise UnusableError(f"{what} is {value:g}; the limit is {self.magnitude:g}")
        return float(value)
