"""``missionc report FOLDER``: the page of a compiled folder, drawn anew from its files."""

from __future__ import annotations

from pathlib import Path

import click

from missionc.cli.exit_status import Status, say, status_of
from missionc.cli.options import file_to_write, folder, folders, limits_and_form, named, read_limits
from missionc.diagnostics.model import Diagnostic

TITLE = "· missionc report</title>".encode()
HEAD = 4096
"""Bytes of a page, within which its title stands."""


@click.command("report")
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@click.option(
    "-o",
    "--output",
    type=file_to_write,
    metavar="FILE",
    help="The page to write; FOLDER.html beside the folder if left out.",
)
@limits_and_form
def command(path: Path, output: Path | None, limits: tuple[tuple[str, str], ...], form: str) -> Status:
    """Draw the page of a compiled folder anew, from its files; one that fails is drawn too."""
    from missionc.output.folder.overlap import Output, overlapping
    from missionc.output.folder.write_file import beside, refuse_file, write_file
    from missionc.replay.render_report import render_report
    from missionc.replay.reverify import reverify

    target = output or beside(named(path), ".html")
    reverified = reverify(path, read_limits(limits))
    page = render_report(reverified)
    findings = reverified.findings
    written = False
    if page:
        wrong = overlapping([Output("-o", target)], [path]) or (None if output else _not_ours(target))
        wrong = wrong or refuse_file(target) or write_file(target, page)
        findings, written = (*findings, wrong) if wrong else findings, not wrong
    lines = [f"written to {target}"] if written else []
    say(findings, lines, form, {"output": str(target) if written else None})
    if not written:
        return Status.MISSION_ERRORS
    return status_of(reverified.passed, reverified.undecided)


def _not_ours(target: Path) -> Diagnostic | None:
    """What forbids replacing a file that nobody named: it is no page of the compiler's."""
    from missionc.output.folder.unwritable import exists

    try:
        with target.open("rb") as file:
            head = file.read(HEAD)
    except OSError:
        return None
    return (
        None if TITLE in head else exists(target, " and is no page of the compiler's", instead="another file with `-o`")
    )
