"""The commands: flags in, files and words out. Nothing about missions is decided here.

Diagnostics go to standard error, results to standard output; with ``--format
json`` standard output is one document that holds the diagnostics too.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module

import click

from missionc.answers import Status, defect, say
from missionc.version import __version__

MODULES = (
    "check",
    "compile",
    "demo",
    "explain",
    "export",
    "fmt",
    "init",
    "lsp",
    "monitor",
    "report",
    "simulate",
    "vehicles",
    "verify",
)
"""The commands, each in a module of its own."""


def main(arguments: list[str] | None = None) -> int:
    """Run one command and return its exit status; nothing comes out but ``Stopped``, a traceback least of all."""
    words = sys.argv[1:] if arguments is None else arguments
    try:
        return int(commands.main(args=words, prog_name="missionc", standalone_mode=False) or Status.DONE)
    except click.exceptions.Exit as left:
        return left.exit_code
    except click.ClickException as error:
        error.show()
        return Status.USAGE
    except Exception as error:
        if os.environ.get("MISSIONC_TRACEBACK"):
            raise
        say([defect(error)], [], _form(words), {})
        return Status.DEFECT


class Commands(click.Group):
    """The commands, in ``missionc.commands``, are loaded when they are called."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(MODULES)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name not in MODULES:
            return None
        command = import_module(f"missionc.commands.{name}").command
        assert isinstance(command, click.Command)
        return command


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, message="missionc %(version)s")
def commands() -> None:
    """A compiler for multi-robot missions.

    A mission says what must be true; trajectories that provably do it come back.
    """


def _form(words: list[str]) -> str:
    """The form of answers that a command line asks for, whatever else is wrong with it."""
    named = {word.removeprefix("--format=") for word in words}
    return next((form for form in ("json", "sarif") if form in named), "text")
