"""``missionc fmt FILE…``: the formatter for the standard layout of missions."""

from __future__ import annotations

import difflib
from pathlib import Path

import click

from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.cli.exit_status import Status, say
from missionc.cli.options import existing, files, limits_and_form, read_limits
from missionc.frontend.syntax.format import format_mission
from missionc.frontend.syntax.parse import parse
from missionc.frontend.syntax.read_file import changed_meanwhile, read_source, read_standard_input, unread
from missionc.output.folder.write_folder import refuse_file, write_file

STANDARD_INPUT = Path("-")


@click.command("fmt")
@click.argument(
    "missions",
    nargs=-1,
    required=True,
    type=lambda word: STANDARD_INPUT if word == "-" else existing(word),
    shell_complete=files,
    metavar="FILE...",
)
@click.option("--check", is_flag=True, help="Change no file, and exit with status 1 if a file needs formatting.")
@click.option("--diff", is_flag=True, help="Change no file, and print the changes that formatting would make.")
@limits_and_form
def command(
    missions: tuple[Path, ...], check: bool, diff: bool, limits: tuple[tuple[str, str], ...], form: str
) -> Status:
    """Format mission files; `-` stands for standard input.

    The formatter changes white space only. It skips missions with syntax errors.
    """
    allowed = read_limits(limits)
    findings: list[Diagnostic] = []
    lines: list[str] = []
    changed: list[str] = []
    for path in missions:
        read = _read(path, allowed)
        if isinstance(read, list):
            findings += read
            continue
        before, text = read
        if path == STANDARD_INPUT and not (check or diff):
            click.echo(text, nl=False)
            continue
        if text == before:
            continue
        changed.append(str(path))
        if diff:
            lines += _difference(str(path), before, text)
        elif not check and (wrong := _rewrite(path, before, text, allowed)):
            findings.append(wrong)
            changed.pop()
    verb = "would change" if check or diff else "changed"
    lines += [] if diff and not check else [f"{name}: {verb}" for name in changed]
    say(findings, lines, form, {"changed": changed})
    return Status.MISSION_ERRORS if findings or (check and changed) else Status.DONE


def _read(path: Path, limits: Limits) -> tuple[str, str] | list[Diagnostic]:
    """Text of a file and its standard layout, or the syntax errors; included files are not read."""
    source = read_standard_input(limits) if path == STANDARD_INPUT else read_source(path, str(path), limits)
    if isinstance(source, Diagnostic):
        return [source]
    program, findings = parse(source, limits, unread)
    return findings if program is None else (source.text, format_mission(source, program, limits))


def _rewrite(path: Path, before: str, text: str, limits: Limits) -> Diagnostic | None:
    """Write a text to a file unless the file was changed in the meantime; return the error, if any.

    Args:
        path: path of the file.
        before: text of the file when it was read.
        text: new text.
        limits: maximum size of a file.
    """
    now = read_source(path, str(path), limits)
    if isinstance(now, Diagnostic):
        return now
    if now.text != before:
        return changed_meanwhile(str(path))
    return refuse_file(path) or write_file(path, text.encode("utf-8"))


def _difference(name: str, before: str, after: str) -> list[str]:
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), name, f"{name}, formatted", lineterm="")
    return list(lines)
