"""``missionc monitor FILE TRACE``: evaluation of a mission's formulas on a recorded or live trace."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path

import click

from missionc.base.diagnostics.code import EXTRA_MISSING, NOT_LISTENING
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.cli import sample_lines, summary
from missionc.cli.exit_status import Status, say
from missionc.cli.flight_page import FlightPage
from missionc.cli.option_groups import GroupedCommand
from missionc.cli.options import Number, Pairs, existing, file_or_folder, files, no_open, of_mission, pair, read_limits
from missionc.compiler import driver
from missionc.frontend.syntax.read_file import closed_input
from missionc.ir import Mission


@click.command("monitor", cls=GroupedCommand)
@click.argument("file", type=existing, shell_complete=files)
@click.argument("trace", required=False, shell_complete=files)
@of_mission
@click.option("--continuous", is_flag=True, help="Also check the requirements between samples.")
@click.option(
    "--tolerance",
    type=Number(min=0, max=1e6),
    default=0,
    show_default=True,
    metavar="METRES",
    help="Largest position error of the recording. Constraints are relaxed by this distance.",
)
@click.option("--live", is_flag=True, help="Check samples while they arrive, by default JSON on standard input.")
@click.option(
    "--udp",
    type=sample_lines.port_of,
    metavar="[HOST:]PORT",
    help="Receive samples as UDP datagrams. [default host: this machine]",
)
@click.option("--mcap", type=existing, metavar="FILE", help="Read poses from an MCAP recording while it is written.")
@click.option(
    "--topic",
    type=pair,
    multiple=True,
    metavar="TOPIC=NAME",
    help="MCAP topic of the poses of agent NAME. [default: /ROBOT/pose with the export name ROBOT of the agent]",
)
@click.option(
    "--wait",
    type=Number(min=0, max=1e6),
    metavar="SECONDS",
    help="Time to wait for late samples. [default: one step]",
)
@click.option(
    "--skew",
    type=pair,
    multiple=True,
    metavar="NAME=SECONDS",
    help="Clock offset of agent NAME, positive if its clock is ahead.",
)
@click.option(
    "--leap",
    type=Number(min=0, max=1e9),
    metavar="SECONDS",
    help="Set a sample aside if its time is this far ahead, until a second one confirms it. [default: at least 10 s]",
)
@click.option(
    "--plan",
    type=file_or_folder,
    metavar="FOLDER|TRACE",
    help="Plan that the agents follow. It is used to forecast undecided requirements.",
)
@click.option("--page", is_flag=True, help="Show the verdicts on a page in the browser until Ctrl-C.")
@no_open
def command(
    file: Path,
    trace: str | None,
    overrides: Pairs,
    limits: Pairs,
    form: str,
    continuous: bool,
    tolerance: float,
    live: bool,
    udp: tuple[str, int] | None,
    mcap: Path | None,
    topic: Pairs,
    wait: float | None,
    skew: Pairs,
    leap: float | None,
    plan: Path | None,
    page: bool,
    no_open: bool,
) -> Status:
    """Check a recorded or live flight against a mission.

    TRACE is a plan.json or a CSV file with agent,t,x,y[,z]. With --live, the command checks samples as they arrive.
    """
    asked = Live(udp, mcap, topic, wait, skew, leap, plan, page, no_open)
    if live:
        if continuous or trace not in (None, "-"):
            raise click.UsageError("`--live` reads samples from a stream; remove the trace and `--continuous`")
        asked.fit()
        return _live(file, dict(overrides), read_limits(limits), tolerance, form, asked)
    if asked != Live():
        raise click.UsageError(f"`{asked.first()}` needs live monitoring; add `--live`")
    if trace is None:
        raise click.UsageError("the recorded trajectory is missing; add a CSV or JSON file")
    judged = driver.monitor(
        file,
        existing(trace),
        overrides=dict(overrides),
        limits=read_limits(limits),
        continuous=continuous,
        tolerance=tolerance,
    )
    say(judged.findings, summary.monitored_lines(judged), form, summary.monitored_document(judged))
    if not judged.ok:
        return Status.MISSION_ERRORS
    return {True: Status.DONE, False: Status.VIOLATED, None: Status.UNDECIDED}[judged.satisfied]


class Live(Record):
    """Options of ``--live``; each field has the name of its flag."""

    udp: tuple[str, int] | None = None
    mcap: Path | None = None
    topic: Pairs = ()
    wait: float | None = None
    skew: Pairs = ()
    leap: float | None = None
    plan: Path | None = None
    page: bool = False
    no_open: bool = False

    def first(self) -> str:
        """First option that was given, as a flag."""
        given = next(each.name for each in fields(self) if getattr(self, each.name) != each.default)
        return f"--{given.replace('_', '-')}"

    def fit(self) -> None:
        """Check that the flags are compatible.

        Raises:
            click.UsageError: they are not.
        """
        if self.no_open and not self.page:
            raise click.UsageError("`--no-open` has no effect without `--page`; remove it")
        if self.topic and not self.mcap:
            raise click.UsageError("`--topic` needs a recording; add `--mcap FILE`")
        if self.mcap and self.udp:
            raise click.UsageError("`--mcap` and `--udp` exclude each other; remove one of them")


def _live(file: Path, overrides: dict[str, str], limits: Limits, tolerance: float, form: str, asked: Live) -> Status:
    ahead = {name: _seconds(name, text) for name, text in asked.skew}
    try:
        checked, session = driver.live_session(
            file,
            overrides=overrides,
            limits=limits,
            wait=asked.wait,
            skew=ahead,
            leap=asked.leap,
            plan=asked.plan,
            tolerance=tolerance,
        )
    except KeyError as error:
        raise click.UsageError(f"the mission has no agent `{error.args[0]}`; correct `--skew`") from None
    if session is None or checked.kernel is None:
        say(checked.findings, [], form, {})
        return Status.MISSION_ERRORS
    lines = _lines(asked, session.mission, limits)
    if isinstance(lines, Diagnostic):
        say([*checked.findings, lines], [], form, {})
        return Status.MISSION_ERRORS
    from missionc.cli import live_monitor  # numpy, which this module otherwise loads only on demand

    live_monitor.tell_findings(checked.findings, form)
    shown = FlightPage(session.mission, checked.kernel) if asked.page else None
    if shown and session.plan:
        shown.set_plan(session.plan)
    return live_monitor.run(session, lines, form, shown, asked.no_open)


def _lines(asked: Live, mission: Mission, limits: Limits) -> Iterator[str] | Diagnostic:
    """Lines with samples from the selected source, or the finding that it cannot be opened.

    Args:
        asked: options of ``--live``.
        mission: monitored mission.
        limits: maximum sizes of a recording.
    """
    if asked.udp is not None:
        host, port = asked.udp
        try:
            return sample_lines.of_socket(sample_lines.listen(host, port))
        except (OSError, ValueError) as error:  # the latter, of a name that no host can have
            why = getattr(error, "strerror", None) or "unknown host"
            reason = f"cannot receive on port {port} of {host}: {why}"
            return Diagnostic(NOT_LISTENING, reason, None, help="use another port")
    if asked.mcap is None:
        return sample_lines.of_standard_input() if sys.stdin is not None else closed_input()
    if not find_spec("mcap"):
        help_ = "install it with `pip install 'missionc[export]'`"
        message = "a recording in MCAP needs the package mcap, which is not installed"
        return Diagnostic(EXTRA_MISSING, message, None, help=help_)
    from missionc.output.export.verified_flight import robot_names
    from missionc.verification.monitoring.live.mcap_poses import McapPoses

    robots = robot_names(mission)
    topics = dict(asked.topic)
    unknown = next((name for name in topics.values() if name not in robots), None)
    if unknown is not None:
        raise click.UsageError(f"the mission has no agent `{unknown}`; correct `--topic`")
    topics = topics or {f"/{robot}/pose": name for name, robot in robots.items()}
    return sample_lines.of_recording(asked.mcap, McapPoses(topics, mission.dimension, limits))


def _seconds(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) <= 1e9:
        raise click.UsageError(f"`{text}` is not a number of seconds; correct `--skew {name}={text}`")
    return value
