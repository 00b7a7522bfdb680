"""One flight in a closed loop: the engine moves everybody, the ground hears, plans anew and uploads.

    in   what is flown, a Scenario, a seed
    out  LoopFlight

Time stands still while the ground plans: a plan is uploaded for the moment by which it had to be ready, and one that
was not ready by then is none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Array
from missionc.base.units import Seconds
from missionc.closed_loop.ground import Ground, Happened
from missionc.closed_loop.judge_loop import Cut, Outcome, judge
from missionc.closed_loop.reports import PERIOD, Reports
from missionc.closed_loop.scenario import Event, Scenario
from missionc.closed_loop.told import Told
from missionc.curves.crazyflie_csv import polynomials
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.pipeline.checked import Checked
from missionc.pipeline.replan.get_ready import get_ready
from missionc.pipeline.replan.patch import patched
from missionc.pipeline.replan.request import Flying
from missionc.simulate.default_engine import Airborne
from missionc.simulate.disturbance import Disturbance, drawn
from missionc.simulate.firmware_setpoints import POSITION, SETPOINTS_PER_SECOND, YAW

TICKS = round(PERIOD * SETPOINTS_PER_SECOND)
"""Setpoints between two reports."""

Listen = Callable[[float, Array, Ground, list[str]], None]
"""Is told of the time, of everybody's position, (3, agents), of the ground, and of the lines that it heard."""


def nobody(time: float, position: Array, ground: Ground, lines: list[str]) -> None:
    """The listener of those who do not watch."""


@dataclass(frozen=True, slots=True, eq=False)
class LoopFlight:
    """How a flight went.

    Args:
        times: (samples,), s; position: (agents, samples, 3), m.
        happened: what the ground saw and did.
        lost: the names of those whose motors stopped.
    """

    times: Array
    position: Array
    happened: tuple[Happened, ...]
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
    """Fly a verified plan through a scenario, from rest at its start to its end.

    Args:
        within: seconds after something happened, when the flight goes on by another plan.
        clock: seconds that planning may take by the clock; ``within`` where it is None.
    """
    mission = flying.checked.valid_mission
    names = tuple(agent.name for agent in mission.agents)
    pieces = [polynomials(flying.flights[name]) for name in names]
    ticks = math.ceil(mission.horizon * SETPOINTS_PER_SECOND - 1e-9)
    random = np.random.default_rng([seed, 1])
    weather = Disturbance(wind=scenario.wind, gust=scenario.gust)
    wind = drawn(weather, seed, range(1), len(names), ticks + 1).wind[0]
    told = Told(pieces, scenario.skew * random.random(len(names)))
    if replans:
        get_ready(flying)
    ground = Ground(flying, told, names, within, limits, seed, replans, clock)
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
    ground: Ground,
    told: Told,
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
    """What is wrong with the patches of a scenario, before anything is flown."""
    found: list[Diagnostic] = []
    for event in scenario.events:
        edited = patched(checked, Source("change", event.change), limits) if event.change else {}
        found += edited if isinstance(edited, list) else []
    return found
