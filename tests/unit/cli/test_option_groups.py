"""Help of commands: every option in one section, and a help text for each."""

from __future__ import annotations

import re

import click
import pytest

from missionc.cli.command_names import BUILT_IN, COMMANDS
from missionc.cli.option_groups import COMMON, FURTHER, GROUPS, GroupedCommand


def command_of(name: str) -> click.Command:
    command = COMMANDS.get(name)
    assert isinstance(command, click.Command)
    return command


def options_of(command: click.Command) -> list[click.Option]:
    return [each for each in command.params if isinstance(each, click.Option)]


def test_every_flag_in_a_group_belongs_to_a_command() -> None:
    flags = {flag for name in BUILT_IN for option in options_of(command_of(name)) for flag in option.opts}
    assert set(GROUPS) <= flags
    assert len(GROUPS) == sum(len(group.split()) for group in FURTHER.values())


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_option_has_a_help_text_that_is_a_sentence(name: str) -> None:
    for option in options_of(command_of(name)):
        assert re.fullmatch(r"[A-Z`].*[.\]]", option.help or "", re.DOTALL), (option.opts, option.help)


@pytest.mark.parametrize("name", [name for name in BUILT_IN if isinstance(COMMANDS.get(name), GroupedCommand)])
def test_grouped_help_lists_every_option_once(name: str) -> None:
    command = command_of(name)
    text = command.get_help(click.Context(command, info_name=name))
    listed = re.findall(r"^  (?:-\w, )?(--?[\w-]+)", text, re.MULTILINE)
    assert sorted(listed) == sorted([*(option.opts[-1] for option in options_of(command)), "--help"])
    assert text.index(COMMON) < text.index("Output options") < text.index("Advanced options")


def test_long_commands_are_grouped() -> None:
    assert all(isinstance(command_of(name), GroupedCommand) for name in BUILT_IN if len(command_of(name).params) > 12)
