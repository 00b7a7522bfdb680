"""``missionc replan FOLDER --flown TRACE``: a new plan for the remaining mission during its flight."""

from __future__ import annotations

import math
from pathlib import Path

import click

from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.units import Seconds
from missionc.cli import options
from missionc.cli.exit_status import Status, say
from missionc.cli.option_groups import GroupedCommand
from missionc.output.folder.overlap import WrittenPath, overlapping
from missionc.output.folder.write_folder import beside, refuse, write_folder

MOST_SECONDS = 3_600


def speed(value: str) -> tuple[str, float]:
    """Parse ``AGENT=SPEED``, with the speed in m/s.

    Raises:
        click.UsageError: the text is not such a pair.
    """
    name, text = options.pair(value)
    try:
        most = float(text)
    except ValueError:
        most = math.nan
    if not 0 < most < math.inf:
        raise click.UsageError(f"`{value}` is not a speed limit; write AGENT=SPEED in m/s, such as drone[0]=0.5")
    return name, most


@click.command("replan", cls=GroupedCommand)
@click.argument("path", type=options.folder, shell_complete=options.folders, metavar="FOLDER")
@click.option(
    "--flown",
    type=options.existing,
    required=True,
    shell_complete=options.files,
    metavar="TRACE",
    help="CSV or JSON file of the flight recorded since the start of the plan.",
)
@click.option(
    "--changed",
    type=options.existing,
    shell_complete=options.files,
    metavar="PATCH",
    help="Read changed declarations, such as a new obstacle, from a file.",
)
@click.option("--lost", multiple=True, metavar="AGENT", help="Omit this lost agent from the new plan; repeatable.")
@click.option(
    "--slow",
    type=speed,
    multiple=True,
    metavar="AGENT=SPEED",
    help="Limit the speed of an agent, in m/s; repeatable.",
)
@click.option("--give-up", "given_up", multiple=True, metavar="REQUIREMENT", help="Drop this requirement; repeatable.")
@click.option(
    "--within",
    type=options.Number(0.1, MOST_SECONDS),
    default=3,
    show_default=True,
    metavar="SECONDS",
    help="Time from the recorded state to the start of the new plan.",
)
@options.seed()
@options.exported("Also export the flight to these formats. `missionc export --list` lists all formats.")
@options.output("Plan folder to write. [default: FOLDER-replan]")
@options.force
@options.limits_and_form
def command(
    path: Path,
    flown: Path,
    changed: Path | None,
    lost: tuple[str, ...],
    slow: tuple[tuple[str, float], ...],
    given_up: tuple[str, ...],
    within: float,
    seed: int,
    exported: tuple[tuple[str, ...], ...],
    output: Path | None,
    force: bool,
    limits: tuple[tuple[str, str], ...],
    form: str,
) -> Status:
    """Replan the rest of a mission from the current state."""
    from missionc.cli import replan_summary  # loads all of the planner
    from missionc.compiler.replan.request import Way
    from missionc.tools.api.replan_folder import replan_folder

    target = output or beside(options.named(path), "-replan")
    inputs = [path, flown, *([changed] if changed else [])]
    wrong = overlapping([WrittenPath("-o", target, True)], inputs) or refuse(target, force)
    if wrong:
        say([wrong], [], form, {"outcome": None})
        return Status.MISSION_ERRORS
    allowed = options.read_limits(limits)
    names = tuple(name for group in exported for name in group)
    replanned = replan_folder(path, flown, changed, lost, dict(slow), given_up, Seconds(within), seed, names, allowed)
    findings: list[Diagnostic] = list(replanned.findings)
    written = ""
    if replanned.files:
        failed = write_folder(target, replanned.files, force)
        findings += [failed] if failed else []
        written = "" if failed else str(target)
    say(
        findings,
        replan_summary.replanned_lines(replanned, written),
        form,
        replan_summary.replanned_document(replanned, written or None),
    )
    if replanned.way is Way.NONE:
        return Status.MISSION_ERRORS if replanned.rest is None else Status.IMPOSSIBLE
    return Status.MISSION_ERRORS if has_errors(findings) else Status.DONE
