"""``missionc monitor FILE TRACE``: a trace judged by the mission's formulas, recorded or while it is flown."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

import click

from missionc.base.limits import Limits
from missionc.cli import sample_lines, summary
from missionc.cli.exit_status import Status, say
from missionc.cli.flight_page import FlightPage
from missionc.cli.options import Number, Pairs, existing, file_or_folder, files, no_open, of_mission, pair, read_limits
from missionc.diagnostics.code import NOT_LISTENING
from missionc.diagnostics.model import Diagnostic
from missionc.pipeline import driver


@click.command("monitor")
@click.argument("file", type=existing, shell_complete=files)
@click.argument("trace", required=False, shell_complete=files)
@of_mission
@click.option("--continuous", is_flag=True, help="Judge what happens between the steps too.")
@click.option("--live", is_flag=True, help="Judge states as they come, as lines of JSON on standard input.")
@click.option(
    "--udp", type=sample_lines.port_of, metavar="[HOST:]PORT", help="With --live: as datagrams; on this machine."
)
@click.option(
    "--wait",
    type=Number(min=0, max=1e6),
    metavar="SECONDS",
    help="With --live: for late samples; one step if left out.",
)
@click.option(
    "--skew", type=pair, multiple=True, metavar="NAME=SECONDS", help="With --live: an agent's clock is ahead."
)
@click.option("--plan", type=file_or_folder, metavar="FOLDER|TRACE", help="With --live: the plan that is followed.")
@click.option("--page", is_flag=True, help="With --live: show it on a page in the browser, until Ctrl-C.")
@no_open
def command(
    file: Path,
    trace: str | None,
    overrides: Pairs,
    limits: Pairs,
    form: str,
    continuous: bool,
    live: bool,
    udp: tuple[str, int] | None,
    wait: float | None,
    skew: Pairs,
    plan: Path | None,
    page: bool,
    no_open: bool,
) -> Status:
    """Judge a trace: a plan.json, a CSV file with agent,t,x,y[,z], or with --live states as they come."""
    if live:
        if continuous or trace not in (None, "-"):
            raise click.UsageError(
                "`--live` reads states as they come, at the steps: it takes no trace and no `--continuous`"
            )
        if no_open and not page:
            raise click.UsageError("`--no-open` is for `--page`, which opens it")
        return _live(file, overrides, read_limits(limits), form, udp, wait, skew, plan, page, no_open)
    if udp is not None or wait is not None or skew or plan or page or no_open:
        raise click.UsageError("`--udp`, `--wait`, `--skew`, `--plan` and `--page` are for `--live`")
    if trace is None:
        raise click.UsageError("Missing argument 'TRACE'.")
    judged = driver.monitor(
        file, existing(trace), overrides=dict(overrides), limits=read_limits(limits), continuous=continuous
    )
    say(judged.findings, summary.monitored_lines(judged), form, summary.monitored_document(judged))
    if not judged.ok:
        return Status.MISSION_ERRORS
    return Status.DONE if judged.satisfied else Status.VIOLATED


def _live(
    file: Path,
    overrides: Pairs,
    limits: Limits,
    form: str,
    udp: tuple[str, int] | None,
    wait: float | None,
    skew: Pairs,
    plan: Path | None,
    page: bool,
    no_open: bool,
) -> Status:
    ahead = {name: _seconds(name, text) for name, text in skew}
    try:
        checked, session = driver.live_session(
            file, overrides=dict(overrides), limits=limits, wait=wait, skew=ahead, plan=plan
        )
    except KeyError as error:
        raise click.UsageError(f"`--skew` names `{error.args[0]}`; the mission has no such agent") from None
    if session is None or checked.kernel is None:
        say(checked.findings, [], form, {})
        return Status.MISSION_ERRORS
    lines: Iterable[str] = sample_lines.of_standard_input()
    if udp is not None:
        try:
            lines = sample_lines.of_socket(sample_lines.listen(*udp))
        except (OSError, ValueError) as error:  # the latter, of a name that no host can have
            why = getattr(error, "strerror", None) or "no host has such a name"
            reason = f"nothing can be received on port {udp[1]} of {udp[0]}: {why}"
            finding = Diagnostic(NOT_LISTENING, reason, None, help="name another port, or end what listens there")
            say([*checked.findings, finding], [], form, {})
            return Status.MISSION_ERRORS
    from missionc.cli import live_monitor  # numpy, which no other use of this module loads before it has to

    if form == "text":
        say(checked.findings, [], form, {})
        sys.stdout.flush()
    shown = FlightPage(session.mission, checked.kernel) if page else None
    if shown and session.plan:
        shown.set_plan(session.plan)
    return live_monitor.run(session, lines, form, shown, no_open)


def _seconds(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) <= 1e9:
        raise click.UsageError(f"`--skew {name}={text}` is no number of seconds")
    return value
