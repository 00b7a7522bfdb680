"""Stops for own state: additional visits if a resource runs out, or a flag has the wrong value.

    in   an initial trajectory of a schedule
    out  the same; or that of a schedule with more visits, in which conditions on own states fail later or not at all

A schedule does not model an agent's resources or flags. Therefore the initial trajectory is examined. At the first
failing condition on own state, a visit to a suitable region is inserted between two visits of the agent, as late as it
helps. This is repeated while time allows (lazy refinement guided by counterexamples), and evaluated only on the
trajectories.

Source:
    Clarke, Grumberg, Jha, Lu and Veith, "Counterexample-guided abstraction refinement", 2000; Froger, Mendoza, Jabali
    and Laporte, "Improved formulations and algorithmic components for the electric vehicle routing problem with
    nonlinear charging functions", 2019, for stops inserted into a route with given visits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from missionc.backends.clot.cost_graph.cost_graph import signed_predicate
from missionc.backends.clot.optimise.active_set import Demand
from missionc.backends.clot.optimise.control_points import splines
from missionc.backends.clot.schedule.draft import WarmStart
from missionc.backends.clot.schedule.presence import reads_past
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tasks import Event, Hold, Option
from missionc.backends.clot.schedule.visits import Appointment, Key
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Compare, Flagged, Inside, Level, Mission, Predicate, Region
from missionc.ir.kernel.nodes import Always, At, Atom, Kernel, Node
from missionc.ir.kernel.walk import postorder
from missionc.ir.language.margins.resources import levels_along

ROUNDING = 1e-6
"""Rounding tolerance of times, seconds."""


class UnmetResource(Record, eq=False):
    """First violated condition on an agent's own state: the condition, the agent, and the step."""

    leaf: Node
    agent: int
    step: int


class _Draft(Record, eq=False):
    """Initial trajectory with its scheduler, and the first violated condition on own state of each agent."""

    scheduler: Scheduler
    begun: WarmStart
    lacks: dict[int, UnmetResource]

    def visits(self, agent: int) -> list[Appointment]:
        """Visits of an agent, sorted by time."""
        whose = [
            (each, each.visit.agents | {hold.agent for hold in each.visit.event.holds})
            for each in self.begun.schedule.appointments
        ]
        return sorted((each for each, agents in whose if agent in agents), key=lambda each: each.step)

    @property
    def last_stop(self) -> int:
        """Step of the stop that was inserted last."""
        number = len(self.scheduler.outline.tasks) - 1
        return next(each.step for each in self.begun.schedule.appointments if each.visit.key[0] == number)

    def progress(self, agent: int, tasks: int, late: float) -> tuple[bool, float, float]:
        """Progress of an agent, as a sort key; larger is better.

        The criteria are: delay of at most ``late`` seconds, number of the tasks' visits before the first violation, and
        its step.
        """
        in_time, lack = self.begun.schedule.late <= late + ROUNDING, self.lacks.get(agent)
        if lack is None:
            return in_time, math.inf, math.inf
        own = [each for each in self.visits(agent) if each.visit.key[0] < tasks]
        return in_time, sum(each.step < lack.step for each in own), lack.step


def with_stops(
    mission: Mission,
    graph: Kernel,
    scheduler: Scheduler,
    begin: Callable[[Scheduler], WarmStart],
    number: int,
    go_on: Callable[[], bool],
) -> WarmStart:
    """Warm start of an attempt, with stops inserted while they increase an agent's progress.

    Args:
        begin: function from a scheduler to its (deterministic) warm start.
        number: index of the attempt.
    """
    # Shares of a full resource that may be missing on a first motion, which is longer and slower than necessary: of the
    # first attempt, the next, and so on in turns.
    slacks = (0.0, 0.1, 0.2)
    roots = tuple(goal.formula for goal in graph.requirements)
    slack = slacks[number % len(slacks)]
    allowed = {leaf: slack * _most(mission, leaf) for leaf in postorder(roots) if reads_past(leaf)}
    first = begin(scheduler)
    if not allowed:
        return first

    tasks, tries = len(scheduler.outline.tasks), iter(range(clot_settings(mission).schedule.stops))

    def made(scheduler: Scheduler, begun: WarmStart) -> _Draft:
        stops = tuple(
            At(hold.agent, Always(hold.node, each.step, min(each.step + hold.high, mission.steps)))
            for each in begun.schedule.appointments
            if each.visit.key[0] >= tasks
            for hold in each.visit.event.holds
        )
        return _Draft(scheduler, begun, _lacks(mission, (*roots, *stops), allowed, begun))

    best = made(scheduler, first)
    stuck: set[int] = set()
    while waiting := [lack for agent, lack in best.lacks.items() if agent not in stuck]:
        soonest = min(waiting, key=lambda lack: (lack.step, lack.agent))
        better = _mended(
            mission,
            best,
            soonest,
            tasks,
            lambda more: made(more, begin(more)),
            lambda: next(tries, None) is not None and go_on(),
        )
        if better is None:
            stuck.add(soonest.agent)
        else:
            best = better
    return best.begun


def _most(mission: Mission, leaf: Node) -> float:
    """Margin that a full resource contributes to a comparison; 0 for a flag."""
    predicate = signed_predicate(leaf)[0]
    if not isinstance(predicate, Compare):
        return 0.0
    levels = ((weight, each.resource) for weight, each in predicate.terms if isinstance(each, Level))
    return max(abs(weight) * resource.capacity for weight, resource in levels) / predicate.scale(mission.dimension)


def _lacks(
    mission: Mission, roots: tuple[Node, ...], allowed: Mapping[Node, float], begun: WarmStart
) -> dict[int, UnmetResource]:
    """First violated condition on own state by agent; agents without a violation are omitted."""
    made = splines(mission)
    states = made.states(made.through(begun.motion))
    demand = Demand.of(mission, roots, begun.schedule.choices, mission.steps)
    found: dict[int, UnmetResource] = {}
    for leaf, mask in demand.failing(allowed, *states).items():
        for agent in np.flatnonzero(mask.any(axis=1)).tolist():
            step = int(mask[agent].argmax())
            if agent not in found or step < found[agent].step:
                found[agent] = UnmetResource(leaf, agent, step)
    return found


def _mended(
    mission: Mission,
    draft: _Draft,
    lack: UnmetResource,
    tasks: int,
    made: Callable[[Scheduler], _Draft],
    go_on: Callable[[], bool],
    more: int = 2,
) -> _Draft | None:
    """Draft with the stop that gives the agent the most progress; None if no stop helps.

    Args:
        more: maximum number of further stops that the stop itself needs.
    """
    agent, late = lack.agent, draft.begun.schedule.late
    now = draft.progress(agent, tasks, late)
    best: tuple[tuple[bool, float, float], _Draft] | None = None
    for after, before in _gaps(draft.visits(agent), lack.step):
        for options in _stops(mission, lack, draft.begun.motion[agent]):
            if not go_on():
                return None
            tried = made(draft.scheduler.with_stop(options, after, before))
            another, there = tried.lacks.get(agent), tried.last_stop
            if more and another is not None and another.leaf is not lack.leaf:
                tried = _mended(mission, tried, another, tasks, made, go_on, more - 1) or tried
            progress = tried.progress(agent, tasks, late)
            if progress > now and (best is None or progress > best[0]):
                best = progress, tried
            if best is not None and best[0][0] and best[0][1] > now[1]:
                return best[1]
            if another is not None and another.step < there:
                break  # a shorter part of an unreachable stop does not help either
    return None if best is None else best[1]


def _gaps(visits: list[Appointment], step: int) -> Iterator[tuple[Key | None, Key | None]]:
    """Yield pairs of consecutive visits of an agent between which a stop helps at a step, the latest first; None is the
    start or the end."""
    gaps = 4  # number of gaps tried for a stop, the latest first
    keys = [None, *(each.visit.key for each in visits), None]
    last = next((number for number, each in enumerate(visits) if each.step >= step), len(visits))
    for number in range(last, max(last - gaps, -1), -1):
        yield keys[number], keys[number + 1]


def _stops(mission: Mission, lack: UnmetResource, motion: Array) -> Iterator[tuple[Option, ...]]:
    """Yield stays that may repair a violation, the longest first; of equal stays, one for each region.

    Args:
        motion: trajectory of the agent, (steps + 1, dim), metres.
    """
    # Shares of the time for a full refill, for shorter stops if time is short.
    shares = (1.0, 0.5, 0.25)
    asked, holds = signed_predicate(lack.leaf)
    match asked:
        case Flagged(flag):
            region = flag.set_in if holds else flag.cleared_in
            if region is not None:
                yield (_stay(mission, lack.agent, region, 0),)
        case predicate:
            fills = list(_fills(mission, predicate, holds, lack, motion))
            lengths = {math.ceil(share * longest) for share in shares for _, longest in fills}
            for length in sorted(lengths, reverse=True):
                yield tuple(_stay(mission, lack.agent, region, min(length, longest)) for region, longest in fills)


def _fills(
    mission: Mission, predicate: Predicate, holds: bool, lack: UnmetResource, motion: Array
) -> Iterator[tuple[Region, int]]:
    """Yield the regions that refill the resource of a comparison, with the number of steps for a full refill.

    Args:
        motion: trajectory of the agent, (steps + 1, dim), metres.
    """
    for weight, feature in predicate.terms if isinstance(predicate, Compare) else ():
        if isinstance(feature, Level) and (weight > 0) is holds:
            resource = feature.resource
            left = float(levels_along(np, resource, mission.step, motion)[lack.step])
            for refill in resource.refills:
                gain = (refill.per_second - resource.per_second) * mission.step
                if gain > 0:
                    yield refill.region, max(1, math.ceil((resource.capacity - left) / gain))


def _stay(mission: Mission, agent: int, region: Region, steps: int) -> Option:
    """Task option of an agent staying in a region for ``steps`` steps, at any time."""
    there = Atom(Inside(region, False))
    last = max(0, mission.steps - steps)
    stay = (Hold(agent, there, 0, min(steps, mission.steps), True),)
    return Option(events=(Event(there, agent, 0, 0, last, stay, again=True),))
