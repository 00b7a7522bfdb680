"""Simulation of a plan folder's flight, from its files alone.

in   the folder's path, the flight conditions
out  Simulated
says MC404 MC708 MC709 MC730
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from missionc.base.diagnostics.code import EXTRA_MISSING, FOLDER_REFUSED, NOT_TO_BE_LOST
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.trace import Judgements
from missionc.flight.simulation import engines
from missionc.flight.simulation.default_engine import sample_times
from missionc.flight.simulation.disturbance import setpoints
from missionc.flight.simulation.trials import Trial, Trials, cannot_lose, nobody, run
from missionc.geometry.curves.piecewise_polynomials import Pieces, read
from missionc.ir import Mission
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.verification.monitoring.monitor import monitor

SHOWN = 5
"""Maximum number of agents that a message names."""


@dataclass(frozen=True, slots=True, eq=False)
class Simulated:
    """Simulated flights of a plan folder.

    Args:
        folder: path of the folder.
        findings: errors and warnings.
        opened: contents of the folder; None if they are unreadable.
        planned: verdicts on the plan.
        trials: the flights; None if the files could not be flown.
    """

    folder: Path
    findings: tuple[Diagnostic, ...]
    opened: OutputFolder | None = None
    planned: Judgements | None = None
    trials: Trials | None = None

    @property
    def passed(self) -> bool:
        return self.trials is not None and self.trials.passed


Fly: TypeAlias = Callable[[OutputFolder, list[Pieces], Trial, Callable[[int], None]], Trials]
"""Function that simulates the polynomials of a folder; its listener gets the number of finished flights."""


def fly_here(opened: OutputFolder, pieces: list[Pieces], trial: Trial, listen: Callable[[int], None]) -> Trials:
    """Simulate all flights in this process."""
    return run(opened.mission, opened.kernel, pieces, trial, listen)


def simulate(
    folder: Path,
    trial: Trial,
    limits: Limits | None = None,
    listen: Callable[[int], None] = nobody,
    fly: Fly = fly_here,
) -> Simulated:
    """Simulate the flights of a folder without verifying it, which ``verify`` does.

    Args:
        folder: path of the folder.
        trial: conditions of the flights.
        limits: maximum sizes of the files; the defaults of ``Limits`` if None.
        listen: function that is called with the number of finished flights.
        fly: function that simulates the flights.
    """
    absent = engines.missing(trial.engine)
    if absent:
        return Simulated(folder, (absent,))
    opened = read_folder(folder, limits)
    if not isinstance(opened, OutputFolder):
        return Simulated(folder, opened)
    mission = opened.mission
    wanting = cannot_lose(mission, trial.disturbance)
    if wanting:
        return Simulated(folder, (_nobody_there(mission, wanting),), opened)
    polynomials = {agent.name: read(opened.flights[agent.name]) for agent in mission.agents}
    wrong = {name: f"cannot be read: {why}" for name, why in polynomials.items() if isinstance(why, str)}
    if wrong:
        return Simulated(folder, (_unread(folder, wrong),), opened)
    pieces = [own for own in polynomials.values() if isinstance(own, Pieces)]
    beyond = _beyond(mission, pieces, limits or Limits())
    if beyond:
        return Simulated(folder, (_unread(folder, beyond),), opened)
    try:
        trials = fly(opened, pieces, trial, listen)
    except engines.EngineError as error:
        return Simulated(folder, (_unable(trial.engine, error),), opened)
    return Simulated(folder, (), opened, monitor(mission, opened.kernel, opened.trace), trials)


@np.errstate(over="ignore", invalid="ignore")
def _beyond(mission: Mission, pieces: list[Pieces], limits: Limits) -> dict[str, str]:
    """Reason by agent name for polynomials that exceed the maximum magnitude; empty if there are none."""
    times = sample_times(mission.horizon)
    sizes = ((agent.name, np.abs(setpoints(own, times))) for agent, own in zip(mission.agents, pieces, strict=True))
    why = f"exceed {limits.magnitude:g} m, m/s or m/s^2"
    return {name: why for name, each in sizes if not (each <= limits.magnitude).all()}


def _nobody_there(mission: Mission, why: str) -> Diagnostic:
    names = ", ".join(f"`{agent.name}`" for agent in mission.agents[:SHOWN])
    more = ", …" if len(mission.agents) > SHOWN else ""
    help_ = f"write `--lose AGENT@T` with an agent of {names}{more} and a time from 0 to {float(mission.horizon):g} s"
    return Diagnostic(NOT_TO_BE_LOST, why, None, help=help_)


def _unable(engine: str, error: engines.EngineError) -> Diagnostic:
    message = f"`--engine {engine}` cannot be used: {error}"
    help_ = f"install it with `pip install 'missionc[{engine}]'`"
    return Diagnostic(EXTRA_MISSING, message, None, help=help_)


def _unread(folder: Path, wrong: dict[str, str]) -> Diagnostic:
    name, why = next(iter(wrong.items()))
    return Diagnostic(
        FOLDER_REFUSED,
        f"do not fly `{folder}`: the polynomials of `{name}` {why}",
        None,
        help="compile the mission again",
    )
