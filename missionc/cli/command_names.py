"""Registry of commands: built-in ones, each a module in ``commands``, and those of extensions."""

from __future__ import annotations

import click

from missionc.base.extensions import Kind, Registry, Unfit

BUILT_IN = (
    "check",
    "compile",
    "demo",
    "explain",
    "export",
    "extensions",
    "fly",
    "fmt",
    "init",
    "lsp",
    "monitor",
    "replan",
    "report",
    "simulate",
    "studio",
    "sweep",
    "vehicles",
    "verify",
)
"""Names of the built-in commands, each a module in ``commands``."""


def _command(name: str, value: object) -> click.Command:
    if not isinstance(value, click.Command):
        raise Unfit("a command is a `click.Command`")
    return value


COMMANDS = Registry(Kind.COMMAND, {name: f"missionc.cli.commands.{name}:command" for name in BUILT_IN}, _command)
"""All commands by name."""
