"""Session of online monitoring: changes of verdicts from lines of samples, and forecasts by the plan.

    in   lines of JSON in sequence; Mission, Kernel, and the trace of the plan
    out  changes of verdicts, violated constraints, missing and returning agents, unusable lines, each evaluated
         step; at the end the state of every goal

The forecast of an open goal is the robustness of the flight so far followed by the rest of the plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from missionc.base.constraint import Constraint, NotJudged, all_satisfied
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.trace import Trace, counted
from missionc.ir import Graph, Mission
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.analysis import robustness_unit
from missionc.ir.kernel.walk import postorder
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.live.judge import LiveJudge
from missionc.verification.monitoring.live.samples import (
    Fate,
    Sample,
    SampleReader,
    SampleSteps,
    StepState,
    UnusableError,
)
from missionc.verification.monitoring.live.verdicts import LiveVerdict, Standing
from missionc.verification.monitoring.live.windows import of_measure
from missionc.verification.monitoring.logic import ROBUSTNESS, Values

SHARE, SECONDS = 0.1, 6e-8
"""Maximum processor time of forecasts as a fraction of a core, and seconds to compute one value of a formula, both
approximate.
"""


class PlanForecast:
    """Forecast of open goals: robustness of the flight so far followed by the rest of the plan.

    Memory and work of a forecast are proportional to the length of the plan. ``every`` is the number of steps between
    forecasts, chosen to use about a tenth of a core; it is one for missions of usual size.
    """

    def __init__(self, mission: Mission, kernel: k.Kernel, plan: Trace) -> None:
        self.mission = mission
        self.formulas = kernel.formulas
        self.trace = Trace(plan.step, plan.position.copy(), plan.velocity.copy(), plan.heading.copy())
        self.margins: dict[int, float] = {}
        spread = k.Atom | k.WindowNode | k.UntilNode | k.NeighbourNode | k.ReachNode | k.RouteNode | k.PathLength
        count = sum(isinstance(node, spread) for node in postorder(self.formulas))
        work = count * plan.position[:, :, 0].size * SECONDS
        self.every = max(1, math.ceil(work / (SHARE * float(mission.step))))
        self.past = _Past(np.zeros(plan.position.shape[1], dtype=np.int64))
        _Again(mission, self.trace, self.past).values(self.formulas)

    def take(self, state: StepState, opened: Iterable[int]) -> dict[int, float]:
        """Record the state at a step, and return the forecast robustness of the open goals, by index.

        A missing agent counts as being at its planned position.
        """
        step, trace = state.step, self.trace
        seen = [agent for agent in range(len(self.mission.agents)) if agent not in state.missing]
        trace.position[seen, step] = state.position[seen]
        trace.velocity[seen, step] = state.velocity[seen]
        trace.heading[seen, step] = state.heading[seen]
        self.past.changed[step] = self.past.number + 1
        if step % self.every == 0 or step == self.mission.steps:
            self.past.number += 1
            wanted = {number: self.formulas[number] for number in opened}
            values = _Again(self.mission, trace, self.past).values(wanted.values())
            self.margins = {number: of_measure(float(values[node][0, 0])) for number, node in wanted.items()}
        else:
            still = set(opened)
            self.margins = {number: margin for number, margin in self.margins.items() if number in still}
        return self.margins


@dataclass(slots=True)
class _Past:
    """Cached results of spatial operators: the forecast in which each was computed, the members' values, and the
    result.

    ``number`` is the number of the forecast; ``changed`` has, for each step, the first forecast with a different trace.
    """

    changed: NDArray[np.int64]
    number: int = 0
    found: dict[k.Node, tuple[int, list[Values], Values]] = field(default_factory=dict)


class _Again(Evaluation):
    """Evaluation of a trace that recomputes spatial operators only at steps that have changed since the last forecast.

    Spatial operators are pointwise in time and dominate the run time; only one step is new in each forecast.
    """

    def __init__(self, mission: Mission, trace: Trace, past: _Past) -> None:
        super().__init__(ROBUSTNESS, mission, trace)
        self.past = past
        self.node: k.Node | None = None

    def neighbour(self, node: k.NeighbourNode, body: Values) -> Values:
        self.node = node
        return super().neighbour(node, body)

    def reach(self, node: k.ReachNode, through: Values, end: Values) -> Values:
        self.node = node
        return super().reach(node, through, end)

    def route(self, node: k.RouteNode, through: Values, end: Values) -> Values:
        self.node = node
        return super().route(node, through, end)

    def path_length(self, node: k.PathLength, holds: bool) -> Values:
        self.node = node
        return super().path_length(node, holds)

    def _along(
        self, graph: Graph, below: tuple[Values, ...], outside: Values, measure: Callable[..., Values]
    ) -> Values:
        assert self.node is not None
        members, shape = list(graph.agents), (len(self._agents()), self.steps)
        spread = [np.broadcast_to(value, shape)[members] for value in below]
        if self.node not in self.past.found:
            result = super()._along(graph, below, outside, measure)
        else:
            last, before, found = self.past.found[self.node]
            other = self.past.changed > last
            for now, then in zip(spread, before, strict=True):
                other |= (now != then).any(axis=0)
            result = np.broadcast_to(outside, shape).copy()
            result[members] = found
            for step in np.flatnonzero(other) if members else ():
                piece = slice(int(step), int(step) + 1)
                result[members, piece] = measure(piece, *(value[:, piece].T for value in spread)).T
        self.past.found[self.node] = self.past.number, spread, result[members]
        return result


class Change(Record):
    """Event: the verdict or the risk of a goal has changed since the last step.

    ``unit`` is the unit of the goal's robustness. ``by_plan`` is the robustness if all agents follow the plan from now
    on; None if the goal is decided, or without a plan.
    """

    step: int
    standing: Standing
    unit: str
    preference: bool
    by_plan: float | None = None


class Forecast(Record):
    """Event: an open goal becomes, or no longer is, violated if all agents follow the plan from now on."""

    step: int
    name: str
    margin: float
    unit: str
    preference: bool


class Presence(Record):
    """Event: agents are missing from a step on, or have returned."""

    step: int
    missing: tuple[str, ...]
    back: tuple[str, ...]


class Outrun(Record):
    """Event: agents moved faster than their top speed, so results that relied on the top speed are withdrawn."""

    step: int
    agents: tuple[str, ...]


class Unusable(Record):
    """Event: a line, given by its number, is skipped for the stated reason."""

    line: int
    reason: str


class Judged(Record, eq=False):
    """Event: a step was evaluated; it has the positions of the team and the standing of every goal, requirements first.

    ``by_plan`` has the forecasts of open goals, by goal index.
    """

    state: StepState
    standings: tuple[Standing, ...]
    by_plan: Mapping[int, float]


class Implausible(Record):
    """Event: a sample, given by its line number, was set aside as too far ahead in time."""

    line: int
    agent: str
    time: float


class Breach(Record):
    """Event: a constraint is finally violated from a step on."""

    step: int
    constraint: Constraint


class ConstraintWatch(Protocol):
    """Online monitor of the constraints that the mission implies besides its requirements."""

    def hear(self, sample: Sample) -> None:
        """Register a sample for later steps."""

    def judge_step(self, state: StepState) -> Sequence[Constraint]:
        """Evaluate the constraints at a step; return the constraints that are violated for the first time."""

    def constraints(self) -> tuple[Constraint, ...]:
        """Return the verdicts on all constraints."""

    def not_judged(self) -> tuple[NotJudged, ...]:
        """Return the constraints that cannot be evaluated from the samples."""


Event = Breach | Implausible | Change | Forecast | Presence | Outrun | Unusable | Judged


class Session:
    """Online monitoring of one mission in flight; memory does not grow with the number of lines.

    Args:
        wait, skew, leap: as for ``SampleSteps``.
        constraints: monitor of constraints besides the requirements, if given.
    """

    def __init__(
        self,
        mission: Mission,
        kernel: k.Kernel,
        limits: Limits | None = None,
        wait: float | None = None,
        skew: Mapping[int, float] | None = None,
        leap: float | None = None,
        constraints: ConstraintWatch | None = None,
    ) -> None:
        self.mission = mission
        self.constraints = constraints
        self.judge = LiveJudge(mission, kernel)
        """``judge``: monitor of the settled steps only.

        ``ahead``: monitor that includes the closed steps, None if there are none.
        """
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
        """True if the mission's last step is evaluated and settled."""
        return self.steps.over

    @property
    def verdict(self) -> LiveVerdict:
        """Verdict over all requirements and constraints; constraints stay open until the mission ends."""
        judged = {each.verdict for each in self.standings[: self.requirements]}
        if self.constraints is not None:
            kept = all_satisfied(self.constraints.constraints())
            judged.add(
                LiveVerdict.VIOLATED
                if kept is False
                else LiveVerdict.SATISFIED
                if kept and self.over
                else LiveVerdict.OPEN
            )
        if LiveVerdict.VIOLATED in judged:
            return LiveVerdict.VIOLATED
        return LiveVerdict.SATISFIED if self.standings and LiveVerdict.OPEN not in judged else LiveVerdict.OPEN

    def follow(self, plan: Trace | None) -> None:
        """Set the plan for forecasts from the next step on; None for no forecasts.

        Args:
            plan: states at all of the mission's steps, or None.
        """
        self.plan = plan
        self.forecast = None if plan is None else PlanForecast(self.mission, self.kernel, plan)
        self.by_plan = {}

    def feed(self, line: str) -> Iterator[Event]:
        """Process a line, and yield its events; an empty line has no effect."""
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
        """Process the end of the stream, and yield the events of the steps that it has reached."""
        for state in self.steps.finish():
            yield from self._judged(state)

    def notes(self) -> list[str]:
        """Notes on dropped samples and missing agents, one sentence each."""
        words = {
            Fate.LATE: "dropped: too late for its step",
            Fate.DOUBLED: "dropped: same agent and time as another",
            Fate.AHEAD: "dropped: too far ahead in time, without confirmation",
            Fate.REORDERED: "sorted: out of order",
        }
        fates = self.steps.fates
        notes = [f"{counted(fates[fate], 'sample')} {says}" for fate, says in words.items() if fates[fate]]
        if self.unusable:
            notes.append(f"{counted(self.unusable, 'line')} could not be used")
        if self.reader.flattened:
            notes.append("the mission is two-dimensional: the third coordinate of samples was ignored")
        if self.outrun:
            notes.append(f"{', '.join(self._names(self.outrun))} exceeded the top speed")
        return notes

    def _judged(self, state: StepState) -> Iterator[Event]:
        """Yield the events of a step that is closed now, or was closed before and is settled now."""
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
        opened = [number for number, each in enumerate(self.standings) if each.verdict is LiveVerdict.OPEN]
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
        """Evaluate the goals at a step; return the agents that moved faster than their top speeds."""
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
            # A result that holds for every later sample holds after that sample.
            self.judge.bounds = judge.bounds.copy()
        return judge.outrun

    def _names(self, agents: set[int] | frozenset[int]) -> tuple[str, ...]:
        return tuple(self.mission.agents[agent].name for agent in sorted(agents))


def _advanced(judge: LiveJudge, state: StepState) -> tuple[Standing, ...]:
    return judge.advance(state.position, state.velocity, state.heading, state.doubt)


def _said(standing: Standing) -> tuple[LiveVerdict, bool]:
    return standing.verdict, standing.at_risk
