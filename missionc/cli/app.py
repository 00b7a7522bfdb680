"""Command-line application: the group of commands, shared flags and exit statuses.

Diagnostics go to standard error, results to standard output; with ``--format json`` standard output is one document
that includes the diagnostics.
"""

from __future__ import annotations

import io
import os
import sys
from importlib.util import find_spec

import click

from missionc.base.diagnostics.code import INTERNAL
from missionc.base.diagnostics.defect import cut_off, defect
from missionc.base.diagnostics.render import plain
from missionc.base.diagnostics.suggest import nearest
from missionc.base.extensions import ExtensionError, Kind, failed
from missionc.base.memory import exhausted
from missionc.base.signals import reraise_stop
from missionc.base.supervision import Cause, Ended
from missionc.cli.command_names import COMMANDS
from missionc.cli.exit_status import Status, out_of_memory, say
from missionc.cli.streams import OutputClosed, speaking
from missionc.frontend.syntax.read_file import nowhere
from missionc.version import __version__

FLYING = ("export", "report", "simulate", "verify")
"""Commands that may fly with crazyflow, which needs scipy's array setting before scipy is loaded."""


def main(arguments: list[str] | None = None, began: float | None = None) -> int:
    """Run one command and return its exit status.

    Args:
        arguments: words of the command line; those of the process if None.
        began: start of the process on the clock of ``time.monotonic``, if its time limit counts from there.

    Raises:
        Stopped: a signal ended the process; there are no other exceptions.
    """
    words = sys.argv[1:] if arguments is None else arguments
    try:
        with speaking():
            return _run(words, began)
    except OutputClosed as unsaid:
        return unsaid.status


def _run(words: list[str], began: float | None) -> int:
    try:
        return int(commands.main(args=words, prog_name="missionc", standalone_mode=False, obj=began) or Status.DONE)
    except click.exceptions.Exit as left:
        return left.exit_code
    except click.ClickException as error:
        return _refused(error)
    except OutputClosed:
        raise
    except Exception as error:
        reraise_stop()
        if exhausted(error):
            say([out_of_memory()], [], _form(words), {})
            return Status.MISSION_ERRORS
        if nowhere():
            return _refused(click.UsageError("the current folder no longer exists; change to another folder"))
        name = words[0] if words else ""
        if name in COMMANDS and name not in COMMANDS.built_in and not isinstance(error, ExtensionError):
            error = failed(Kind.COMMAND, name, error)
        if os.environ.get("MISSIONC_TRACEBACK") and not isinstance(error, ExtensionError):
            raise
        finding = defect(error)
        say([finding], [], _form(words), {})
        return Status.DEFECT if finding.code is INTERNAL else Status.MISSION_ERRORS


def say_ended(ended: Ended, words: list[str]) -> Status:
    """Report the reason why the worker process was ended, and return the exit status.

    Args:
        ended: cause of the end.
        words: words of the command line.
    """
    with speaking():
        say([cut_off(ended)], [], _form(words), {})
        if ended.kept:
            return Status.DONE
        return Status.DEFECT if ended.cause is Cause.CRASH else Status.UNDECIDED


def _refused(error: click.ClickException) -> Status:
    """Print an error in a command line, sanitized since a command line may contain anything."""
    buffer = io.StringIO()
    error.show(buffer)
    click.echo(plain(buffer.getvalue()), err=True, nl=False)
    return Status.USAGE


class Commands(click.Group):
    """Group of the commands, which are loaded when they are called.

    An extension's command is listed if it can be loaded.
    """

    def list_commands(self, context: click.Context) -> list[str]:
        return [*COMMANDS.built_in, *(each.name for each in COMMANDS.extensions() if COMMANDS.state(each) is None)]

    def resolve_command(
        self, context: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Command named by the first argument.

        Raises:
            click.UsageError: the command is unknown; the message suggests a similar name.
        """
        name = args[0]
        if not name.startswith("-") and name not in COMMANDS:
            near = nearest(name, list(COMMANDS))
            hint = f"did you mean `{near}`?" if isinstance(near, str) else "run `missionc --help` to list all commands"
            raise click.UsageError(f"unknown command `{name}`; {hint}", context)
        return super().resolve_command(context, args)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name in FLYING and find_spec("crazyflow"):
            os.environ.setdefault("SCIPY_ARRAY_API", "1")
        return COMMANDS.get(name)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, message="missionc %(version)s")
def commands() -> None:
    """Compile multi-robot missions into verified trajectories.

    Every plan is verified against its mission before it is written. `missionc COMMAND --help` describes a command.
    """


def _form(words: list[str]) -> str:
    """Output format in a command line, even if other parts of it are invalid."""
    named = {word.removeprefix("--format=") for word in words}
    return next((form for form in ("json", "sarif") if form in named), "text")
