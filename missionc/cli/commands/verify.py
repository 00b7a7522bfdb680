"""``missionc verify FOLDER``: verification of a compiled folder from its files, before its flight."""

from __future__ import annotations

from pathlib import Path

import click

from missionc.cli import summary
from missionc.cli.exit_status import Status, say, status_of
from missionc.cli.options import folder, folders, limits_and_form, read_limits, verbose


@click.command("verify")
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@verbose
@limits_and_form
def command(path: Path, verbose: bool, limits: tuple[tuple[str, str], ...], form: str) -> Status:
    """Re-verify a plan folder or a proof from its files."""
    from missionc.tools.replay.reverify import reverify, reverify_refusal

    bounds = read_limits(limits)
    reverified = reverify_refusal(path, bounds) or reverify(path, bounds)
    say(
        reverified.findings,
        summary.reverified_lines(reverified, verbose),
        form,
        summary.reverified_document(reverified),
    )
    if reverified.certificate is None:
        return Status.MISSION_ERRORS
    return status_of(reverified.passed, reverified.undecided)
