"""Beginnings of flights in a closed loop: a folder that is verified again, and a scenario."""

from __future__ import annotations

from pathlib import Path

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.closed_loop.fly_loop import LoopFlight, unreadable_changes
from missionc.closed_loop.scenario import Scenario, read_scenario
from missionc.diagnostics.code import SCENARIO_UNUSABLE
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.pipeline.replan.request import Flying
from missionc.replay.read_folder import OutputFolder, read_folder
from missionc.replay.reverify import reverify_opened
from missionc.syntax.read_file import read_text


def open_folder(folder: Path, limits: Limits) -> Flying | list[Diagnostic]:
    """What a folder has to be flown, once it has been verified again; or why not."""
    opened = read_folder(folder, limits)
    if not isinstance(opened, OutputFolder):
        return list(opened)
    verified = reverify_opened(opened, None)
    if not verified.passed:
        return list(verified.findings)
    return Flying(opened.checked, opened.trace, opened.flights)


def read_events(file: Path | None, flying: Flying, limits: Limits) -> Scenario | list[Diagnostic]:
    """What happens to a flight; nothing, where no file says so."""
    if file is None:
        return Scenario()
    text = read_text(file, str(file), limits.file_bytes, SCENARIO_UNUSABLE)
    if isinstance(text, Diagnostic):
        return [text]
    assert flying.checked.mission is not None
    names = tuple(agent.name for agent in flying.checked.mission.agents)
    scenario = read_scenario(Source(str(file), text), names)
    if isinstance(scenario, list):
        return scenario
    return unreadable_changes(flying.checked, scenario, limits) or scenario


def paths_table(mission: Mission, flight: LoopFlight) -> bytes:
    """Where everybody was, 100 times a second, as ``missionc monitor`` reads it."""
    lines = ["agent,t,x,y,z"]
    for agent, path in zip(mission.agents, flight.position.tolist(), strict=True):
        lines += [
            f"{agent.name},{time:.2f}," + ",".join(f"{value:.9g}" for value in place)
            for time, place in zip(flight.times.tolist(), path, strict=True)
        ]
    return ("\n".join(lines) + "\n").encode()
