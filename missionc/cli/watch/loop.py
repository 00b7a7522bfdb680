"""Main loop of ``compile --watch``: checks and replans on every save, and updates the open report."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

from missionc.backends.registry import BACKENDS
from missionc.base.diagnostics.code import OUTPUT_EXISTS
from missionc.base.diagnostics.render import counts, render_text
from missionc.cli.browser import said
from missionc.cli.compile_request import CompileRequest, check, folder_of
from missionc.cli.exit_status import Status, say, say_line
from missionc.cli.watch.file_changes import EVERY
from missionc.cli.watch.live_page import LivePage
from missionc.cli.watch.planner_process import Ended, Planner
from missionc.cli.watch.watched_missions import Missions, heading
from missionc.output.folder.file_names import REPORT

FIRST = BACKENDS.built_in[0]
"""Backend that is loaded in advance, before the mission is checked."""


def watch(request: CompileRequest, no_open: bool) -> Status:
    """Compile on every save until interrupted; return only if the folder to write contains other files.

    Args:
        request: input, options and outputs.
        no_open: if true, the report is not opened in a browser.
    """
    missions = Missions([request.name], lambda: [check(request)])
    ours: set[Path] = set()  # folders that did not exist before
    with Planner() as planner, LivePage(Path(request.name).name) as live:
        planner.ready(FIRST)
        say_line(said(live.address, no_open, live.address))
        say_line(f"watching {request.name} and its included files; Ctrl-C stops")
        while True:
            _begin(request, missions, planner, live, ours)
            while not missions.saved():
                ended = planner.ended()
                if ended and OUTPUT_EXISTS.name in ended.codes:
                    return Status(ended.status)
                if ended:
                    _show(ended, live)
                time.sleep(EVERY)
            planner.stop()
            heading()


def _begin(request: CompileRequest, missions: Missions, planner: Planner, live: LivePage, ours: set[Path]) -> None:
    """Check a mission, and start planning unless there are errors.

    Args:
        request: input, options and outputs.
        missions: watched mission.
        planner: planner process.
        live: page of the report.
        ours: paths of folders that this loop has written.
    """
    (checked,) = missions.checked()
    if not checked.ok or checked.choice is None:
        findings = list(checked.findings)
        say(findings, [f"{checked.file}: {counts(findings)}"], "text", {})
        live.tell("wrong", render_text(findings, False))
        return
    folder = folder_of(request, checked)
    # A stopped plan may also have been written, without a message.
    if not os.path.lexists(folder):
        ours.add(folder)
    planner.start(replace(request, output=folder, force=request.force or folder in ours), checked.choice.backend)
    live.tell("planning")


def _show(ended: Ended, live: LivePage) -> None:
    """Show the new report; without one, keep the last report and show the findings above it."""
    if ended.status == Status.DONE:
        live.tell("planned", report=(Path(ended.output) / REPORT).read_bytes())
    else:
        live.tell("wrong", ended.says)
