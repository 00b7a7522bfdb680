"""A session of online monitoring: lines of samples to what changes in the verdicts.

in   lines of JSON, one after the other
out  changes of verdicts, violated constraints, agents that go missing and come back, lines that cannot be used, each
     step as it is judged; at the end how all stands
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from missionc.base.constraint import Constraint, NotJudged, all_satisfied
from missionc.base.figures import counted
from missionc.base.limits import Limits
from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.kernel.analysis import robustness_unit
from missionc.kernel.nodes import Kernel
from missionc.monitoring.live.judge import LiveJudge
from missionc.monitoring.live.plan_forecast import PlanForecast
from missionc.monitoring.live.read_samples import SampleReader, UnusableError
from missionc.monitoring.live.samples import Fate, Sample, SampleSteps, StepState
from missionc.monitoring.live.verdicts import Standing, Verdict


@dataclass(frozen=True, slots=True)
class Change:
    """A goal whose verdict or risk is another one than a step before; ``unit`` is that of its robustness.

    ``by_plan`` is its robustness if everybody follows the plan from here on; None where it is decided, or there is
    no plan.
    """

    step: int
    standing: Standing
    unit: str
    preference: bool
    by_plan: float | None = None


@dataclass(frozen=True, slots=True)
class Forecast:
    """An open goal that would be lost if everybody follows the plan from here on, or that no longer would."""

    step: int
    name: str
    margin: float
    unit: str
    preference: bool


@dataclass(frozen=True, slots=True)
class Presence:
    """Agents that are missing from a step on, and those that are seen again."""

    step: int
    missing: tuple[str, ...]
    back: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Outrun:
    """Agents that moved faster than their top speed: what rested on it is taken back."""

    step: int
    agents: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Unusable:
    """A line that was skipped, by its number, and why."""

    line: int
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A step that was judged: where the team was, and how every goal stands, requirements first.

    ``by_plan`` has the forecasts of open goals by the plan, by the goals' numbers.
    """

    state: StepState
    standings: tuple[Standing, ...]
    by_plan: Mapping[int, float]


@dataclass(frozen=True, slots=True)
class Implausible:
    """A sample that was set aside, by the number of its line: it is too far ahead in time to be believed alone."""

    line: int
    agent: str
    time: float


@dataclass(frozen=True, slots=True)
class Breach:
    """A constraint that is violated, for good, from a step on."""

    step: int
    constraint: Constraint


class ConstraintWatch(Protocol):
    """A judge of the constraints that the mission implies beside its requirements."""

    def hear(self, sample: Sample) -> None:
        """Take note of a sample."""

    def judge_step(self, state: StepState) -> Sequence[Constraint]:
        """Judge a step; return the constraints that are violated for the first time."""

    def constraints(self) -> tuple[Constraint, ...]:
        """Return the verdicts on all constraints."""

    def not_judged(self) -> tuple[NotJudged, ...]:
        """Return the constraints that the samples do not show."""


Event = Breach | Implausible | Change | Forecast | Presence | Outrun | Unusable | Judged


class Session:
    """One mission as it is flown. Memory does not grow with the lines that are fed.

    Args:
        wait, skew, leap: as of ``SampleSteps``.
        constraints: judged beside the requirements, if given.
    """

    def __init__(
        self,
        mission: Mission,
        kernel: Kernel,
        limits: Limits | None = None,
        wait: float | None = None,
        skew: Mapping[int, float] | None = None,
        leap: float | None = None,
        constraints: ConstraintWatch | None = None,
    ) -> None:
        self.mission = mission
        self.constraints = constraints
        self.judge = LiveJudge(mission, kernel)
        """Knows the settled steps alone; ``ahead`` the closed ones as well, while there are such."""
        self.ahead: LiveJudge | None = None
        self.unsettled: list[StepState] = []
        self.latest: StepState | None = None
        self.outrun: set[int] = set()
        self.reader = SampleReader(mission, kernel, limits)
        self.steps = SampleSteps(mission, wait, skew, leap)
        self.units = [robustness_unit(goal.formula) for goal in self.judge.goals]
        self.requirements = len(kernel.requirements)
        self.standings: tuple[Standing, ...] = ()
        self.missing: frozenset[int] = frozenset()
        self.lines = self.unusable = 0
        self.kernel = kernel
        self.plan: Trace | None = None
        self.forecast: PlanForecast | None = None
        self.by_plan: Mapping[int, float] = {}

    @property
    def over(self) -> bool:
        """Whether the mission's last step was judged, and is settled."""
        return self.steps.over

    @property
    def verdict(self) -> Verdict:
        """How all requirements together stand, and the constraints, which last as long as the mission."""
        judged = {each.verdict for each in self.standings[: self.requirements]}
        if self.constraints is not None:
            kept = all_satisfied(self.constraints.constraints())
            judged.add(Verdict.VIOLATED if kept is False else Verdict.SATISFIED if kept and self.over else Verdict.OPEN)
        if Verdict.VIOLATED in judged:
            return Verdict.VIOLATED
        return Verdict.SATISFIED if self.standings and Verdict.OPEN not in judged else Verdict.OPEN

    def follow(self, plan: Trace | None) -> None:
        """Forecast by this plan, which has all of the mission's steps, from the next step on; None for no plan."""
        self.plan = plan
        self.forecast = None if plan is None else PlanForecast(self.mission, self.kernel, plan)
        self.by_plan = {}

    def feed(self, line: str) -> Iterator[Event]:
        """Take in a line; an empty one says nothing."""
        self.lines += 1
        if not line.strip():
            return
        try:
            samples = self.reader.read(line)
        except UnusableError as error:
            self.unusable += 1
            yield Unusable(self.lines, str(error))
            return
        for sample in samples:
            if self.constraints is not None:
                self.constraints.hear(sample)
            set_aside = self.steps.fates[Fate.AHEAD]
            for state in self.steps.add(sample):
                yield from self._judged(state)
            if self.steps.fates[Fate.AHEAD] > set_aside:
                yield Implausible(self.lines, self.mission.agents[sample.agent].name, sample.time)

    def finish(self) -> Iterator[Event]:
        """The stream has ended: judge the steps that it has reached."""
        for state in self.steps.finish():
            yield from self._judged(state)

    def notes(self) -> list[str]:
        """What became of samples and agents, a sentence each."""
        words = {
            Fate.LATE: "came after their step was settled, and were dropped",
            Fate.DOUBLED: "were of an agent and a time that had one, and were dropped",
            Fate.AHEAD: "lay too far ahead in time, with nothing to confirm it",
            Fate.REORDERED: "came out of order, and were sorted in",
        }
        fates = self.steps.fates
        notes = [f"{counted(fates[fate], 'sample')} {says}" for fate, says in words.items() if fates[fate]]
        if self.unusable:
            notes.append(f"{counted(self.unusable, 'line')} could not be used")
        if self.reader.flattened:
            notes.append("the mission is in the plane: the third coordinate of samples was left out")
        if self.outrun:
            notes.append(f"{', '.join(self._names(self.outrun))} moved faster than the top speed")
        return notes

    def _judged(self, state: StepState) -> Iterator[Event]:
        """Events of a step that was closed, or that was closed before and is settled now."""
        is_new = self.latest is None or state.step > self.latest.step
        moved = is_new or not np.array_equal(self.unsettled[0].position, state.position)
        if is_new:
            missing, self.latest = frozenset(state.missing), state
            if missing != self.missing:
                yield Presence(state.step, self._names(missing - self.missing), self._names(self.missing - missing))
            self.missing = missing
        assert self.latest is not None
        before, planned = self.standings, self.by_plan
        outrun = self._stand(state)
        opened = [number for number, each in enumerate(self.standings) if each.verdict is Verdict.OPEN]
        if self.forecast is not None and moved:
            self.by_plan = self.forecast.take(state, opened)
        else:
            self.by_plan = {number: margin for number, margin in planned.items() if number in opened}
        if outrun - self.outrun:
            yield Outrun(state.step, self._names(outrun - self.outrun))
            self.outrun |= outrun
        for number, standing in enumerate(self.standings):
            if not before or _said(standing) != _said(before[number]):
                is_new = True
                by_plan = self.by_plan.get(number)
                yield Change(state.step, standing, self.units[number], number >= self.requirements, by_plan)
        for number, margin in self.by_plan.items():
            if (margin < 0) != (planned.get(number, 0.0) < 0):
                name, preference = self.standings[number].name, number >= self.requirements
                yield Forecast(state.step, name, margin, self.units[number], preference)
        if self.constraints is not None and state.settled:
            for constraint in self.constraints.judge_step(state):
                yield Breach(state.step, constraint)
        if is_new:
            yield Judged(self.latest, self.standings, self.by_plan)

    def _stand(self, state: StepState) -> set[int]:
        """Take in a step; return the agents that have moved faster than their top speeds."""
        if state.settled:
            self.standings, self.ahead = _advanced(self.judge, state), None
            self.unsettled = [each for each in self.unsettled if each.step > state.step]
            again = self.unsettled
        else:
            self.unsettled.append(state)
            again = [state]
        for each in again:
            self.ahead = self.ahead or self.judge.copy()
            self.standings = _advanced(self.ahead, each)
        judge = self.ahead or self.judge
        if judge.outrun == self.judge.outrun:
            # What holds whatever may still come holds when it has come.
            self.judge.bounds = judge.bounds.copy()
        return judge.outrun

    def _names(self, agents: set[int] | frozenset[int]) -> tuple[str, ...]:
        return tuple(self.mission.agents[agent].name for agent in sorted(agents))


def _advanced(judge: LiveJudge, state: StepState) -> tuple[Standing, ...]:
    return judge.advance(state.position, state.velocity, state.heading, state.doubt)


def _said(standing: Standing) -> tuple[Verdict, bool]:
    return standing.verdict, standing.at_risk
