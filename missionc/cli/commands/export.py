"""``missionc export FOLDER NAME…``: a compiled folder's flight in other formats."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from missionc.base.diagnostics.model import Diagnostic
from missionc.cli import summary
from missionc.cli.exit_status import Status, say, status_of
from missionc.cli.options import (
    export_name,
    exports,
    folder,
    folder_to_write,
    folders,
    limits_and_form,
    named,
    one_of,
    poses,
    read_limits,
)
from missionc.output.folder.file_names import EXPORT, MANIFEST
from missionc.output.folder.manifest import without_plan
from missionc.output.folder.overlap import WrittenPath, overlapping
from missionc.output.folder.write_file import beside
from missionc.output.folder.write_folder import write_folder

if TYPE_CHECKING:
    from missionc.base.limits import Limits
    from missionc.output.export.export_form import Exported
    from missionc.output.export.formats import Flight
    from missionc.tools.replay.reverify import Reverified


def _list(context: click.Context, parameter: click.Parameter, listed: bool) -> None:
    if not listed or context.resilient_parsing:
        return
    from missionc.output.export.formats import FORMATS

    width = max(map(len, FORMATS))
    for form in FORMATS.values():
        click.echo(f"{form.name:<{width}}  {form.says}")
    context.exit()


@click.command("export")
@click.argument("path", type=folder, shell_complete=folders, metavar="FOLDER")
@click.argument("names", nargs=-1, required=True, type=export_name, shell_complete=one_of(exports), metavar="NAME...")
@click.option(
    "-o", "--output", type=folder_to_write, metavar="FOLDER", help="The folder to write; FOLDER-export if left out."
)
@poses
@click.option("--force", is_flag=True, help="Replace the folder if it exists.")
@click.option("--list", is_flag=True, is_eager=True, expose_value=False, callback=_list, help="List the names.")
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
    """Write a compiled folder's flight in other forms, once it has been verified again."""
    from missionc.tools.replay.reverify import reverify

    allowed = read_limits(limits)
    reverified = reverify(path, allowed)
    target = output or beside(named(path), "-export")
    findings = list(reverified.findings)
    files: dict[str, bytes] = {}
    notes: list[str] = []
    flown = _flown(reverified, poses, allowed)
    if isinstance(flown, Grounded):
        findings += [each for each in flown.findings if not (flown.files and each.code.warning)]
        notes += [each.message for each in flown.findings if flown.files and each.code.warning]
        files |= flown.files
    for name in dict.fromkeys(names):
        made = _made(flown, name)
        if isinstance(made, Diagnostic):
            findings.append(made)
        elif made is not None:
            files.update({f"{name}/{file}": content for file, content in made.files.items()})
            notes += made.notes
    if not findings and reverified.opened:
        files[MANIFEST] = without_plan(reverified.opened.mission.name, EXPORT, files).encode()
        wrong = overlapping([WrittenPath("-o", target, True)], [path]) or write_folder(target, files.items(), force)
        findings += [wrong] if wrong else []
    done = not findings
    lines = summary.exported_lines(str(target), tuple(files.items()), notes) if done else []
    say(findings, lines, form, summary.exported_document(str(target) if done else None, files, notes))
    if done:
        return Status.DONE
    refused = reverified.certificate is not None and not reverified.passed
    return status_of(False, reverified.undecided) if refused else Status.MISSION_ERRORS


@dataclass(frozen=True, slots=True, eq=False)
class Grounded:
    """A flight from where agents were measured to stand: it, and the files that say so; or why there is none."""

    flight: Flight | None
    files: dict[str, bytes]
    findings: tuple[Diagnostic, ...]


def _flown(reverified: Reverified, poses: Path | None, limits: Limits) -> Flight | Grounded | None:
    """What is to be exported; nothing of a folder that is not to be flown."""
    if reverified.opened is None or not reverified.passed:
        return None
    from missionc.output.export.formats import flight

    opened = reverified.opened
    if poses is None:
        return flight(opened.mission, opened.kernel, opened.trace, opened.flights, opened.ways, opened.in_flight)
    from missionc.compiler.fly_from import fly_from  # for those who measure: it plans

    answer = fly_from(opened.mission, opened.flights, opened.files["plan.json"], poses, limits)
    if answer.whole is None:
        return Grounded(None, {}, answer.findings)
    ways, mission = answer.whole.ways, answer.mission
    return Grounded(
        flight(mission, opened.kernel, opened.trace, opened.flights, ways), dict(answer.files), answer.findings
    )


def _made(flown: Flight | Grounded | None, name: str) -> Exported | Diagnostic | None:
    """One form."""
    own = flown.flight if isinstance(flown, Grounded) else flown
    if own is None:
        return None
    from missionc.output.export.formats import FORMATS

    return FORMATS[name].export(own)
