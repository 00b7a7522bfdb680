"""Flight in a closed loop: the engine moves the agents, ground control replans, and the flight is evaluated.

    in   the mission and its plan, a Scenario, a seed
    out  LoopFlight, with its Outcome

Simulated time stands still during replanning. A plan starts at the time by which it had to be ready, and is discarded
if it was not ready by then.

The evaluation covers the requirements over the complete flight, and the bodies in continuous time. It uses the actual
events: a lost agent has no requirements from then on, and a changed world counts from its change. Replanning does not
affect the evaluation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from missionc import Checked, Diagnostic, Limits, Source
from missionc.base.trace import Array
from missionc.base.units import Seconds
from missionc.compiler.remaining import earlier
from missionc.compiler.replan.patch import patched
from missionc.compiler.replan.plan_rest import get_ready
from missionc.compiler.replan.request import Flying
from missionc.extension import Mission, Trace
from missionc.flight.simulation.default_engine import Airborne
from missionc.flight.simulation.disturbance import POSITION, SETPOINTS_PER_SECOND, YAW, Disturbance, drawn
from missionc.flight.simulation.judge_flight import at_steps, room
from missionc.geometry.curves.piecewise_polynomials import polynomials
from missionc.planning.progression.rest_of_mission import team_at
from missionc.planning.progression.stretches import Remaining, Stretch, after
from missionc.tools.closed_loop.ground import GroundEvent, GroundStation, UploadedTrajectories
from missionc.tools.closed_loop.reports import PERIOD, Reports
from missionc.tools.closed_loop.scenario import Event, Scenario
from missionc.verification.certificate import Check
from missionc.verification.monitoring.live.first_violations import first_violations
from missionc.verification.monitoring.monitor import monitor


@dataclass(frozen=True, slots=True)
class Cut:
    """Event that changes the evaluated mission: lost agents or edited files.

    Args:
        time: time of the event, s.
        lost: names of the agents lost at that time.
        texts: edited contents by file name; None without an edit.
    """

    time: float
    lost: tuple[str, ...] = ()
    texts: Mapping[str, str] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Epoch:
    """Part of a flight with one mission and one team, which lasts until the next epoch.

    Args:
        time: start, s.
        mission: valid mission.
        team: names of the agents that still fly.
    """

    time: float
    mission: Mission
    team: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """Evaluation of a flight.

    Args:
        requirements: satisfaction of each requirement by name.
        nearest: minimum clearance between two bodies, or a body and an obstacle; None without such a pair.
        epochs: one that starts at 0, and one more for each cut.
        since: for each violated requirement, the earliest time, s, from which no motion within the maximum speeds could
            satisfy it.
    """

    requirements: Mapping[str, bool]
    nearest: Check | None
    epochs: tuple[Epoch, ...]
    since: Mapping[str, float] = field(default_factory=dict)

    @property
    def room(self) -> float:
        """Minimum clearance between two bodies, or a body and an obstacle, m; negative if they touch."""
        return math.inf if self.nearest is None else self.nearest.margin

    @property
    def satisfied(self) -> bool:
        return all(self.requirements.values())

    @property
    def untouched(self) -> bool:
        return self.room >= 0


def judge(
    checked: Checked, cuts: list[Cut], times: Array, position: Array, velocity: Array, heading: Array, limits: Limits
) -> Outcome:
    """Evaluate the requirements and the clearances of a flight.

    Args:
        checked: the complete mission as initially planned.
        cuts: losses and edits in the order of their times.
        times: (samples,), s, from 0 to the end of the mission.
        position, velocity: (agents, samples, 3), m and m/s.
        heading: (agents, samples), rad.
        limits: maximum sizes of a mission.
    """
    mission, kernel = checked.valid_mission, checked.valid_kernel
    whole = at_steps(mission, times, position, velocity, heading)
    rest, now, written = Remaining(mission, kernel), checked, mission
    rows, begin = list(range(len(mission.agents))), 0
    names = [agent.name for agent in mission.agents]
    epochs = [Epoch(0.0, mission, tuple(names))]
    flown: list[tuple[Remaining, Trace, int]] = []
    for cut in cuts:
        step = min(math.ceil(cut.time / mission.step - 1e-9), int(mission.steps) - 1)
        if cut.texts:
            now = earlier(now, cut.texts, limits)
            written = now.valid_mission
        part = whole.part(rows, begin, step)
        flown.append((rest, part, begin))
        rest = after(rest, Stretch(part, cut.lost), written)
        rows = [names.index(agent.name) for agent in rest.mission.agents]
        begin = step
        epochs.append(Epoch(cut.time, written, tuple(names[row] for row in rows)))
    last = whole.part(rows, begin, int(mission.steps))
    flown.append((rest, last, begin))
    kept = {each.name: each.satisfied for each in monitor(rest.mission, rest.kernel, last).requirements}
    lost = {name: float(mission.horizon) for name, each in kept.items() if not each}
    for stretch in reversed(flown if lost else []):
        lost |= {name: when for name, when in _since(*stretch).items() if name in lost}
    ends = [*(each.time for each in epochs[1:]), float(times[-1])]
    rooms = [
        check for each, end in zip(epochs, ends, strict=True) for check in _rooms(each, names, times, position, end)
    ]
    nearest = min(rooms, key=lambda check: check.margin, default=None)
    return Outcome(kept, nearest, tuple(epochs), lost)


def _since(rest: Remaining, trace: Trace, begin: int) -> dict[str, float]:
    """Time in seconds by violated requirement, from which no continuation of the flight can satisfy it.

    Args:
        rest: remaining mission.
        trace: flight from ``begin`` on.
        begin: step at which the remaining mission starts.
    """
    steps = first_violations(rest.mission, rest.kernel, trace) | dict.fromkeys(rest.nobodys, 0)
    return {name: float((begin + step) * trace.step) for name, step in steps.items()}


def _rooms(epoch: Epoch, names: list[str], times: Array, position: Array, end: float) -> list[Check]:
    """Clearances of the remaining agents during an epoch, with linear motion between samples; empty below two samples.

    Args:
        epoch: mission, team and start.
        names: names of all agents, in the order of the positions.
        times: (samples,), s.
        position: (agents, samples, 3), m.
        end: end of the epoch, s.
    """
    chosen = (times >= epoch.time - 1e-9) & (times <= end + 1e-9)
    if chosen.sum() < 2:
        return []
    when, place = times[chosen], position[[names.index(name) for name in epoch.team]][:, chosen]
    team = team_at(epoch.mission, 0.0, place[:, 0, : epoch.mission.dimension], epoch.team)
    return list(room(team, when, place))


TICKS = round(PERIOD * SETPOINTS_PER_SECOND)
"""Number of setpoints between two reports of an agent."""

Listen = Callable[[float, Array, GroundStation, list[str]], None]
"""Listener function of the time (s), the positions (3, agents) in m, ground control, and the reports that it
received.
"""


def nobody(time: float, position: Array, ground: GroundStation, lines: list[str]) -> None:
    """Listener that does nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class LoopFlight:
    """Flight in a closed loop.

    Args:
        times: (samples,), s.
        position: (agents, samples, 3), m.
        happened: events that ground control detected, and its actions.
        lost: names of the agents whose motors stopped.
        outcome: evaluation of the flight.
    """

    times: Array
    position: Array
    happened: tuple[GroundEvent, ...]
    lost: tuple[str, ...]
    outcome: Outcome


def fly_loop(
    flying: Flying,
    scenario: Scenario,
    seed: int,
    within: Seconds,
    limits: Limits,
    *,
    replans: bool = True,
    clock: Seconds | None = None,
    listen: Listen = nobody,
) -> LoopFlight:
    """Simulate a verified plan in a scenario, from rest at its start to its end.

    Args:
        flying: plan and its mission.
        scenario: events and disturbances.
        seed: random seed.
        within: time from an event to the start of another plan.
        limits: maximum sizes of a mission.
        replans: whether ground control replans; if false, it only monitors.
        clock: time limit of planning; ``within`` if None.
        listen: function that is called after each report period.
    """
    mission = flying.checked.valid_mission
    names = tuple(agent.name for agent in mission.agents)
    pieces = [polynomials(flying.flights[name]) for name in names]
    ticks = math.ceil(mission.horizon * SETPOINTS_PER_SECOND - 1e-9)
    random = np.random.default_rng([seed, 1])
    weather = Disturbance(wind=scenario.wind, gust=scenario.gust)
    wind = drawn(weather, seed, range(1), len(names), ticks + 1).wind[0]
    told = UploadedTrajectories(pieces, scenario.skew * random.random(len(names)))
    if replans:
        get_ready(flying)
    ground = GroundStation(flying, told, names, within, limits, seed, replans, clock)
    first = told.setpoints(np.zeros(1))
    air = Airborne(first[POSITION, 0], first[YAW, 0])
    reports, waiting = Reports(scenario, random), list(scenario.events)
    lost: list[str] = []
    cuts: list[Cut] = []
    path, speed = np.empty((2, ticks + 1, 3, len(names)))
    nose = np.empty((ticks + 1, len(names)))
    for tick in range(0, ticks + 1, TICKS):
        time = tick / SETPOINTS_PER_SECOND
        while waiting and waiting[0].at <= time + 1e-9:
            _happen(waiting.pop(0), time, mission, air, ground, told, lost, cuts)
        silent = np.array([name in lost for name in names])
        reports.send(time, air.position, air.velocity, air.heading, silent)
        lines = ground.hear(reports.heard(time))
        ground.look(time)
        listen(time, air.position, ground, lines)
        count = min(TICKS, ticks + 1 - tick)
        reference = told.setpoints((tick + np.arange(count)) / SETPOINTS_PER_SECOND)
        for number in range(count):
            at = tick + number
            path[at], speed[at], nose[at] = air.position, air.velocity, air.heading
            air.advance(reference[:, number], wind[:, at].T.copy(order="C"))
    times = np.arange(ticks + 1) / SETPOINTS_PER_SECOND
    places, speeds = (np.moveaxis(each, (0, 1, 2), (1, 2, 0)) for each in (path, speed))
    outcome = judge(flying.checked, cuts, times, places, speeds, nose.T, limits)
    return LoopFlight(times, places, tuple(ground.happened), tuple(lost), outcome)


def _happen(
    event: Event,
    time: float,
    mission: Mission,
    air: Airborne,
    ground: GroundStation,
    told: UploadedTrajectories,
    lost: list[str],
    cuts: list[Cut],
) -> None:
    if event.lose:
        air.lose(ground.names.index(event.lose))
        if event.lose not in lost:
            lost.append(event.lose)
            cuts.append(Cut(time, (event.lose,)))
    elif event.slow:
        agent = mission.agents[ground.names.index(event.slow)]
        told.slow(agent.index, event.to * agent.dynamics.top_speed)
    else:
        ground.change(event.change)
        cuts.append(Cut(time, texts=dict(ground.texts)))


def unreadable_changes(checked: Checked, scenario: Scenario, limits: Limits) -> list[Diagnostic]:
    """Errors in the patches of a scenario, which are read before the flight.

    Args:
        checked: mission that the patches change.
        scenario: events and disturbances.
        limits: maximum sizes of a mission.
    """
    found: list[Diagnostic] = []
    for event in scenario.events:
        edited = patched(checked, Source("change", event.change), limits) if event.change else {}
        found += edited if isinstance(edited, list) else []
    return found
