"""``missionc export FOLDER NAME…``: export of a compiled folder's flight in other formats."""

from __future__ import annotations

from pathlib import Path

import click

from missionc.cli import options, summary
from missionc.cli.exit_status import Status, say, status_of
from missionc.cli.options import (
    export_name,
    exports,
    folder,
    folders,
    limits_and_form,
    named,
    one_of,
    poses,
    read_limits,
)
from missionc.output.folder.overlap import WrittenPath, overlapping
from missionc.output.folder.write_folder import beside, write_folder


def _list(context: click.Context, parameter: click.Parameter, listed: bool) -> None:
    if not listed or context.resilient_parsing:
        return
    from missionc.output.export.formats import FORMATS

    usable = [form for name in FORMATS if (form := FORMATS.usable(name))]
    width = max(len(form.name) for form in usable)
    for form in usable:
        click.echo(f"{form.name:<{width}}  {form.says}")
    context.exit()


@click.command("export")
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@click.argument("names", nargs=-1, required=True, type=export_name, shell_complete=one_of(exports), metavar="NAME...")
@options.output("Folder to write. [default: FOLDER-export]")
@poses
@options.force
@click.option(
    "--list", is_flag=True, is_eager=True, expose_value=False, callback=_list, help="List the export formats."
)
@limits_and_form
def command(
    path: Path,
    names: tuple[str, ...],
    output: Path | None,
    poses: Path | None,
    force: bool,
    limits: tuple[tuple[str, str], ...],
    form: str,
) -> Status:
    """Verify a plan folder and export its flight."""
    from missionc.tools.api.export_folder import export_folder

    made = export_folder(path, names, poses, read_limits(limits))
    target = output or beside(named(path), "-export")
    findings = list(made.findings)
    if made.files:
        wrong = overlapping([WrittenPath("-o", target, True)], [path]) or write_folder(target, made.files, force)
        findings += [wrong] if wrong else []
    done = bool(made.files) and not findings
    lines = summary.exported_lines(str(target), made.files, list(made.notes)) if done else []
    say(findings, lines, form, summary.exported_document(str(target) if done else None, made.files, list(made.notes)))
    if done:
        return Status.DONE
    reverified = made.reverified
    refused = reverified.certificate is not None and not reverified.passed
    return status_of(False, reverified.undecided) if refused else Status.MISSION_ERRORS
