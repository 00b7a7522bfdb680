"""``missionc monitor FILE TRACE``: a recorded trace judged by the mission's formulas."""

from __future__ import annotations

from pathlib import Path

import click

from missionc.cli import summary
from missionc.cli.exit_status import Status, say
from missionc.cli.options import Pairs, existing, files, of_mission, read_limits
from missionc.pipeline import driver


@click.command("monitor")
@click.argument("file", type=existing, shell_complete=files)
@click.argument("trace", type=existing, shell_complete=files)
@of_mission
@click.option("--continuous", is_flag=True, help="Judge what happens between the steps too.")
def command(file: Path, trace: Path, overrides: Pairs, limits: Pairs, form: str, continuous: bool) -> Status:
    """Judge a trace: a plan.json, or a CSV file with agent,t,x,y[,z]."""
    judged = driver.monitor(file, trace, overrides=dict(overrides), limits=read_limits(limits), continuous=continuous)
    say(judged.findings, summary.monitored_lines(judged), form, summary.monitored_document(judged))
    if not judged.ok:
        return Status.MISSION_ERRORS
    return Status.DONE if judged.satisfied else Status.VIOLATED
