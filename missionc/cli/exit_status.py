"""Exit statuses of commands, and output: findings to standard error, results to standard output."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from enum import IntEnum
from shutil import get_terminal_size

import click

from missionc.base.diagnostics.code import OUT_OF_MEMORY
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.diagnostics.render import as_json, plain, render_json, render_text, wrapped
from missionc.cli.streams import HUNG_UP, NOT_SAID


class Status(IntEnum):
    """Exit statuses of commands; after a signal it is 128 plus the number of the signal."""

    DONE = 0
    MISSION_ERRORS = 1
    USAGE = 2
    IMPOSSIBLE = 3
    UNDECIDED = 4
    NOT_VERIFIED = 5
    NO_MOTION = 6
    VIOLATED = 3
    DEFECT = 70
    NOT_SAID = NOT_SAID
    HUNG_UP = HUNG_UP


def status_of(passed: bool, undecided: bool) -> Status:
    """Exit status after the verification of a readable folder.

    Args:
        passed: whether all checks passed.
        undecided: whether only checks failed that cannot be done here.
    """
    if passed:
        return Status.DONE
    return Status.UNDECIDED if undecided else Status.NOT_VERIFIED


def say(findings: Iterable[Diagnostic], lines: Iterable[str], form: str, document: dict[str, object]) -> None:
    """Print findings to standard error and results to standard output, or one document with both.

    Args:
        findings: errors and warnings.
        lines: results as text.
        form: output format: ``text``, ``json`` or ``sarif``.
        document: results for JSON.
    """
    if form == "sarif":
        from missionc.base.diagnostics.sarif import render_sarif  # rarely used

        click.echo(as_json(render_sarif(list(findings))))
        return
    if form == "json":
        click.echo(as_json({**document, "diagnostics": render_json(list(findings))}))
        return
    text = render_text(list(findings), in_colour(sys.stderr.isatty()), columns(sys.stderr.isatty()))
    if text:
        click.echo(text, err=True, color=True)
    for line in lines:
        say_line(line)


def say_line(line: str) -> None:
    """Print a line on standard output, sanitized and wrapped for a terminal."""
    text = plain(line)
    width = 0 if "\n" in text else columns(sys.stdout.isatty())
    words = text.lstrip(" ")
    begin = len(text) - len(words)
    click.echo(" " * begin + wrapped(words, width, begin + 2, begin))


def out_of_memory() -> Diagnostic:
    """Finding that memory was exhausted, by raised limits or a large team."""
    help_ = "make the mission smaller"
    return Diagnostic(OUT_OF_MEMORY, "not enough memory for this mission", None, help=help_)


def columns(terminal: bool) -> int:
    """Width of the terminal in columns; 0 if output is not to a terminal, where lines are not wrapped."""
    return get_terminal_size().columns if terminal else 0


def in_colour(terminal: bool) -> bool:
    """Return whether output is coloured; ``terminal`` states whether it goes to a terminal."""
    return terminal and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
