"""``missionc report FOLDER``: the page of a compiled folder, drawn anew from its files."""

from __future__ import annotations

from pathlib import Path

import click

from missionc.answers import Status, say
from missionc.flags import folder, folders, limits_and_form, read_limits
from missionc.replay import replay


@click.command("report")
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="The page to write; FOLDER.html beside the folder if left out.",
)
@limits_and_form
def command(path: Path, output: Path | None, limits: tuple[tuple[str, str], ...], form: str) -> Status:
    """Draw the page of a compiled folder anew, from its files; one that fails is drawn too."""
    from missionc.emit.folder import refuse_file, write_file
    from missionc.redraw import redrawn

    target = output or path.absolute().with_suffix(".html")
    replayed = replay(path, read_limits(limits))
    page = redrawn(replayed)
    findings = replayed.findings
    written = False
    if page:
        wrong = refuse_file(target) or write_file(target, page)
        findings, written = (*findings, wrong) if wrong else findings, not wrong
    lines = [f"written to {target}"] if written else []
    say(findings, lines, form, {"output": str(target) if written else None})
    if not written:
        return Status.MISSION_ERRORS
    return Status.DONE if replayed.passed else Status.NOT_VERIFIED
