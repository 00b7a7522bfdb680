"""Flights of a plan folder in a closed loop: re-verification, scenario, and a live or final page.

A live page in the browser shows the telemetry that ground control receives.
"""

from __future__ import annotations

import threading
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Self

from missionc.base.diagnostics.code import SCENARIO_UNUSABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.signals import Stopped
from missionc.base.source import Source
from missionc.base.trace import Array, Trace
from missionc.cli.exit_status import say_line
from missionc.cli.flight_page import FlightPage
from missionc.compiler.front_end import Checked
from missionc.compiler.replan.request import Flying, Way
from missionc.frontend.syntax.read_file import read_text
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.output.report.loop_tracks import LoopFlights
from missionc.output.report.report_html import report
from missionc.tools.closed_loop.fly_loop import LoopFlight, unreadable_changes
from missionc.tools.closed_loop.ground import GroundStation, uploaded
from missionc.tools.closed_loop.scenario import Scenario, read_scenario
from missionc.tools.replay.read_folder import OutputFolder, read_folder
from missionc.tools.replay.rebuild.rebuild_documents import plotted
from missionc.tools.replay.reverify import reverify_opened
from missionc.verification.certificate import Certificate
from missionc.verification.monitoring.live.session import Session


class ShownLoop:
    """Context manager during which a live page shows one flight.

    Args:
        mission, kernel: the complete mission, whose original requirements are monitored.
        pace: speed of the flight relative to real time.
    """

    def __init__(self, mission: Mission, kernel: Kernel, plan: Trace, pace: float) -> None:
        self._page, self._plan, self._pace = FlightPage(mission, kernel), plan, pace
        self._session = Session(mission, kernel)
        self._heard = self._told = 0
        self._began = 0.0
        self._world: Checked | None = None

    def __enter__(self) -> Self:
        self._page.__enter__()
        self._page.set_plan(self._plan)
        self._began = time.monotonic()
        return self

    def __exit__(self, *exception: object) -> None:
        self._page.__exit__(*exception)

    @property
    def address(self) -> str:
        return self._page.address

    def listen(self, at: float, position: Array, ground: GroundStation, lines: list[str]) -> None:
        """Show the telemetry and the actions of ground control up to a time, and wait until that time.

        Args:
            at: time of the flight, s.
            position: (3, agents), metres.
            ground: ground control.
            lines: reports that it received.
        """
        for line in lines:
            for event in self._session.feed(line):
                self._page.publish(event)
        if lines:
            self._page.heard(at)
        for happened in ground.happened[self._told :]:
            begins = "" if happened.begins is None else f"; starts at {happened.begins:g} s"
            well = happened.begins is not None or happened.came == Way.KEPT.value
            self._page.tell(f"{happened.why}: {happened.came}{begins}", "good" if well else "risk", at)
        now = ground.world
        if self._world is not None and now is not self._world and now.mission is not None and now.kernel is not None:
            self._page.set_world(now.mission, now.kernel)
        self._world = now
        if len(ground.happened) > self._told:
            self._page.set_plan(uploaded(ground.told, self._plan))
        self._told = len(ground.happened)
        time.sleep(max(0.0, self._began + at / self._pace - time.monotonic()))

    def over(self, flight: LoopFlight) -> None:
        """Show the result of the flight."""
        for event in self._session.finish():
            self._page.publish(event)
        lost = [name for name, kept in flight.outcome.requirements.items() if not kept]
        self._page.end("all requirements satisfied" if not lost else f"violated: {', '.join(lost)}")

    def wait(self) -> None:
        """Wait until Ctrl-C."""
        say_line("the page stays open until Ctrl-C")
        with suppress(KeyboardInterrupt, Stopped):
            threading.Event().wait()


class Opened(Record, eq=False):
    """Folder that was verified again, with its plan to fly and the certificate."""

    flying: Flying
    folder: OutputFolder
    certificate: Certificate


def open_folder(folder: Path, limits: Limits) -> Opened | list[Diagnostic]:
    """Verify a folder for a flight, or return the errors for which it must not be flown."""
    opened = read_folder(folder, limits)
    if not isinstance(opened, OutputFolder):
        return list(opened)
    verified = reverify_opened(opened, None)
    if not verified.passed or verified.flown is None:
        return list(verified.findings)
    return Opened(Flying(opened.checked, opened.trace, opened.flights, opened.ways), opened, verified.flown)


def flights_page(opened: Opened, loop: LoopFlights) -> bytes:
    """HTML report of the folder with its closed-loop flights, as bytes."""
    return report(replace(plotted(opened.folder, opened.certificate), simulation="", loop=loop))


def read_events(file: Path | None, flying: Flying, limits: Limits) -> Scenario | list[Diagnostic]:
    """Read the scenario of a flight from a file, or return the errors; without a file it has no events.

    Args:
        file: path of the scenario, or None.
        flying: plan and its mission.
        limits: maximum sizes of a file.
    """
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
    """CSV table of the flown positions at 100 Hz, in the format of ``missionc monitor``."""
    lines = ["agent,t,x,y,z"]
    for agent, path in zip(mission.agents, flight.position.tolist(), strict=True):
        lines += [
            f"{agent.name},{time:.2f}," + ",".join(f"{value:.9g}" for value in place)
            for time, place in zip(flight.times.tolist(), path, strict=True)
        ]
    return ("\n".join(lines) + "\n").encode()
