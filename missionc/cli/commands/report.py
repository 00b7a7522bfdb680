"""``missionc report FOLDER [OTHER]``: HTML report of one compiled folder, or of two plans, from the files."""

from __future__ import annotations

from pathlib import Path

import click

from missionc.base.diagnostics.model import Diagnostic
from missionc.cli import options
from missionc.cli.exit_status import Status, say, status_of
from missionc.cli.options import folder, folders, limits_and_form, named, read_limits


@click.command("report")
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@click.argument("other", type=folder, shell_complete=folders, metavar="[OTHER]", required=False)
@options.output("Report to write. [default: FOLDER.html beside the folder]", page=True)
@limits_and_form
def command(
    path: Path, other: Path | None, output: Path | None, limits: tuple[tuple[str, str], ...], form: str
) -> Status:
    """Rebuild the report of a plan folder from its files.

    A folder that fails verification also gets a report. With OTHER, a second folder of the same mission, the report
    compares both plans.
    """
    from missionc.cli.page_to_write import refuse_page
    from missionc.output.folder.write_folder import beside, write_file
    from missionc.tools.replay.render_report import compare_reports, render_report
    from missionc.tools.replay.reverify import reverify

    folders_read = [path] if other is None else [path, other]
    target = output or beside(named(path), ".html" if other is None else f"-{named(other).name}.html")
    reverified = [reverify(each, read_limits(limits)) for each in folders_read]
    findings = tuple(finding for each in reverified for finding in each.findings)
    page: bytes | Diagnostic = b""
    if other is None:
        page = render_report(reverified[0])
    elif all(each.opened and each.certificate for each in reverified):
        page = compare_reports(*reverified)
    if isinstance(page, Diagnostic):
        findings, page = (*findings, page), b""
    written = False
    if page:
        wrong = refuse_page(target, output is not None, folders_read) or write_file(target, page)
        findings, written = (*findings, wrong) if wrong else findings, not wrong
    lines = [f"report: {target}"] if written else []
    say(findings, lines, form, {"output": str(target) if written else None})
    if not written:
        return Status.MISSION_ERRORS
    return status_of(all(each.passed for each in reverified), any(each.undecided for each in reverified))
