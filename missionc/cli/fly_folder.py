"""Flights of a folder in a closed loop: it is verified again, a scenario is read, and the page is drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.closed_loop.fly_loop import LoopFlight, unreadable_changes
from missionc.closed_loop.scenario import Scenario, read_scenario
from missionc.diagnostics.code import SCENARIO_UNUSABLE
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.output.report.loop_tracks import LoopFlights
from missionc.output.report.report_html import report
from missionc.pipeline.replan.request import Flying
from missionc.replay.read_folder import OutputFolder, read_folder
from missionc.replay.rebuild.report_page import plotted
from missionc.replay.reverify import reverify_opened
from missionc.syntax.read_file import read_text
from missionc.verify.certificate import Certificate


@dataclass(frozen=True, slots=True, eq=False)
class Opened:
    """A folder that was verified again, and what of it is flown."""

    flying: Flying
    folder: OutputFolder
    certificate: Certificate


def open_folder(folder: Path, limits: Limits) -> Opened | list[Diagnostic]:
    """A folder that may be flown; or why not."""
    opened = read_folder(folder, limits)
    if not isinstance(opened, OutputFolder):
        return list(opened)
    verified = reverify_opened(opened, None)
    if not verified.passed or verified.flown is None:
        return list(verified.findings)
    return Opened(Flying(opened.checked, opened.trace, opened.flights, opened.ways), opened, verified.flown)


def flights_page(opened: Opened, loop: LoopFlights) -> bytes:
    """The folder's report, with the flights in it."""
    return report(replace(plotted(opened.folder, opened.certificate), simulation="", loop=loop))


def read_events(file: Path | None, flying: Flying, limits: Limits) -> Scenario | list[Diagnostic]:
    """What happens to a flight; nothing, where no file says so."""
    if file is None:
        return Scenario()
    text = read_text(file, str(file), limits.file_bytes, SCENARIO_UNUSABLE)
    if isinstance(text, Diagnostic):
        return [text]
    names = tuple(agent.name for agent in flying.checked.valid_mission.agents)
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
