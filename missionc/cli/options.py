"""Command-line options that several commands share: flags, and parsers of their values."""

from __future__ import annotations

import errno
import math
import os
from collections.abc import Callable, Collection, Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar, assert_never

import click
from click.shell_completion import CompletionItem

from missionc.backends.options import DESCRIBED, Described, OneOf, Real, Switch, Whole
from missionc.backends.registry import AUTO, BACKENDS
from missionc.base.continuous_time import ContinuousTime
from missionc.base.deadline import DEFAULT_TIME_LIMIT
from missionc.base.diagnostics.suggest import nearest
from missionc.base.extensions import Registry
from missionc.base.limits import Limits, most
from missionc.cli import stage_names
from missionc.ir.vehicle_profiles import profiles
from missionc.output.export.form_names import FORMATS
from missionc.output.plot.figure_request import MOST_MOMENTS, SUFFIXES, WIDTHS

Command = TypeVar("Command", bound=Callable[..., Any])


Pairs = tuple[tuple[str, str], ...]
"""Values of a repeatable flag that takes NAME=VALUE."""

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]

SIZES = {"": 1 << 20, "B": 1, "KB": 1 << 10, "MB": 1 << 20, "GB": 1 << 30}
"""Bytes in each unit of memory; a number without a unit is in megabytes."""


UNBOUNDED = 1e6
"""Minimum upper bound that help texts omit."""


class Number(click.FloatRange):
    """Parameter type of a finite number within bounds; negative 0 becomes 0."""

    def _describe_range(self) -> str:
        if self.max is not None and self.max < UNBOUNDED:
            return f"{self.min:g} to {self.max:g}"
        return f"{'above' if self.min_open else 'at least'} {self.min:g}"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> float:
        number = float(super().convert(value, parameter, context))
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number.", parameter, context)
        return number + 0.0


class Count(click.IntRange):
    """Parameter type of an integer within bounds."""

    def _describe_range(self) -> str:
        return f"{self.min} to {self.max}"


def of_a_plan(*names: str) -> Callable[[Command], Command]:
    """Decorator that adds the flags of these plan options in order, as described in ``backends.options``."""

    def with_flags(command: Command) -> Command:
        for name in reversed(names):
            command = _flag(DESCRIBED[name])(command)
        return command

    return with_flags


def _flag(option: Described) -> Callable[[Command], Command]:
    flag = option.flag
    arguments: dict[str, Any] = {"help": option.help or None, "default": option.default}
    match option.kind:
        case OneOf(words):
            return click.option(flag, type=click.Choice(words), show_default=True, **arguments)
        case Whole(least, most):
            known = option.default is not None
            return click.option(flag, type=Count(least, most), show_default=known, metavar=option.metavar, **arguments)
        case Real(least, most):
            return click.option(flag, type=Number(least, most), metavar=option.metavar, **arguments)
        case Switch():
            return click.option(flag, is_flag=True, **arguments)
        case _:
            assert_never(option.kind)


def existing(value: str) -> Path:
    """Parse the path of an existing file; ``read_file`` checks its contents.

    Raises:
        click.UsageError: there is no such file, or it is a folder.
    """
    path = _path(value)
    if not os.path.exists(path):
        raise click.UsageError(f"there is no file `{value}`; check the path")
    if os.path.isdir(path):
        raise click.UsageError(f"`{value}` is a folder; give the path of a file")
    return path


def folder(value: str) -> Path:
    """Parse the path of an existing folder.

    Raises:
        click.UsageError: there is no such folder, or it is a file.
    """
    path = _path(value)
    if not os.path.exists(path):
        raise click.UsageError(f"there is no folder `{value}`; check the path")
    if not os.path.isdir(path):
        raise click.UsageError(f"`{value}` is a file; give the path of a plan folder")
    return path


def file_or_folder(value: str) -> Path:
    """Parse the path of an existing file or folder.

    Raises:
        click.UsageError: there is neither.
    """
    return folder(value) if os.path.isdir(value) else existing(value)


def named(path: Path) -> Path:
    """Absolute path of a folder, next to which files with its name are written.

    Raises:
        click.UsageError: the path has no name, such as the root.
    """
    whole = Path(os.path.abspath(path))
    if not whole.name:
        raise click.UsageError(f"`{path}` has no name for the output; add `-o PATH`")
    return whole


def folder_to_write(value: str) -> Path:
    """Parse the path of a folder to write; ``output.folder.write_folder`` checks the permission.

    Raises:
        click.UsageError: the path is invalid.
    """
    return _path(value)


def file_to_write(value: str) -> Path:
    """Parse the path of a file to write.

    Raises:
        click.UsageError: the path is invalid or that of a folder.
    """
    path = _path(value)
    if os.path.isdir(path):
        raise click.UsageError(f"`{value}` is a folder; give the path of a file")
    return path


def picture(value: str) -> Path:
    """Parse the path of a picture to write.

    Raises:
        click.UsageError: the path is invalid, or its ending is not that of a supported format.
    """
    path = file_to_write(value)
    if path.suffix not in SUFFIXES:
        raise click.UsageError(f"`{value}` has no picture format; end the name with one of {', '.join(SUFFIXES)}")
    return path


def moments(value: str | tuple[float, ...]) -> tuple[float, ...]:
    """Parse times in seconds such as `0,2,5.5`; the result is sorted and without duplicates.

    Raises:
        click.UsageError: one of them is not a time.
    """
    if isinstance(value, tuple):
        return value
    found = []
    for word in value.split(",") if value else ():
        try:
            found.append(float(word))
        except ValueError:
            found.append(math.nan)
        if not 0 <= found[-1] < math.inf:
            raise click.UsageError(f"`{word}` is not a time; write seconds, such as `--at 0,2,5.5`")
    if len(found) > MOST_MOMENTS:
        raise click.UsageError(f"`--at` has {len(found)} times; give at most {MOST_MOMENTS}")
    return tuple(sorted(set(found)))


def _path(value: str) -> Path:
    """Parse a path that is valid on the system; it need not exist.

    Raises:
        click.UsageError: the path is invalid.
    """
    if not value:
        raise click.UsageError("a path is empty; give a file or a folder")
    try:
        os.lstat(value)
    except ValueError:
        raise click.UsageError(f"`{value}` contains characters that a path cannot have; rename it") from None
    except OSError as error:
        if error.errno == errno.ENAMETOOLONG:
            raise click.UsageError(f"the path `{value[:40]}…` is too long for this system; shorten it") from None
    return Path(value)


def vehicle_name(value: str) -> str:
    """Parse the name of a vehicle profile; an unknown one is a ``click.UsageError``."""
    return _known(value, profiles(), "vehicle", "`missionc vehicles` lists all vehicles")


def _known(value: str, known: Collection[str], what: str, otherwise: str) -> str:
    if value not in known:
        near = nearest(value, known)
        hint = f"did you mean `{near}`?" if isinstance(near, str) else otherwise
        raise click.UsageError(f"unknown {what} `{value}`; {hint}")
    return value


def registered(registry: Registry[Any], noun: str, *further: str) -> Callable[[str], str]:
    """Parser for a name in a registry or one of some further words; a built-in name reads no metadata.

    Args:
        registry: registry.
        noun: kind of its values, for messages.
        further: words that are valid too.
    """

    def name(value: str) -> str:
        if value in further or value in registry:
            return value
        known = [*further, *registry]
        return _known(value, known, noun, f"use one of {', '.join(known)}")

    return name


def of_registry(
    flag: str, noun: str, registry: Registry[Any], default: str, says: str, *further: str
) -> Callable[..., Any]:
    """Decorator that adds a flag for the name of a value in a registry.

    Args:
        flag: flag.
        noun: kind of the values, for messages.
        registry: registry.
        default: default name.
        says: help text.
        further: words that are valid too.
    """
    return click.option(
        flag,
        type=registered(registry, noun, *further),
        shell_complete=one_of(lambda: (*further, *registry)),
        default=default,
        show_default=True,
        metavar=f"[{'|'.join((*further, *registry.built_in))}|NAME]",
        help=says,
    )


def continuous_time(continuous: bool, at_steps: bool) -> ContinuousTime:
    """Setting of evaluation between the steps from the flags ``--continuous`` and ``--at-steps``.

    Raises:
        click.UsageError: both are given.
    """
    if continuous and at_steps:
        raise click.UsageError("`--continuous` and `--at-steps` exclude each other; remove one of them")
    return ContinuousTime.REQUIRED if continuous else ContinuousTime.AT_STEPS if at_steps else ContinuousTime.WANTED


def files(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Shell completion of paths of existing files."""
    return [CompletionItem(incomplete, type="file")]


def folders(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Shell completion of paths of existing folders."""
    return [CompletionItem(incomplete, type="dir")]


def one_of(names: Callable[[], Iterable[str]]) -> Completer:
    """Shell completion with one of some names, which are computed on demand."""

    def complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return [CompletionItem(name) for name in names() if name.startswith(incomplete)]

    return complete


def several_of(names: Callable[[], Iterable[str]]) -> Completer:
    """Shell completion of comma-separated names: completes the last one, without duplicates."""

    def complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
        before, comma, last = incomplete.rpartition(",")
        left = [name for name in names() if name not in before.split(",")]
        return [CompletionItem(before + comma + name) for name in left if name.startswith(last)]

    return complete


def exports() -> Collection[str]:
    """Names of the available export formats."""
    return list(FORMATS)


def pair(value: str) -> tuple[str, str]:
    """Parse ``NAME=VALUE``.

    Raises:
        click.UsageError: the text is not a pair.
    """
    name, equals, text = value.partition("=")
    if not (name.strip() and equals and text.strip()):
        raise click.UsageError(f"`{value}` is not a pair; write NAME=VALUE")
    return name.strip(), text.strip()


def memory(value: str) -> int:
    """Parse a size in bytes from megabytes or a number with a unit: ``512``, ``2GB``.

    Raises:
        click.UsageError: the text is not a size.
    """
    word = value.strip().upper().replace(" ", "")
    number = word.rstrip("KMGB")
    try:
        size = float(number) * SIZES[word[len(number) :]]
    except (ValueError, KeyError):
        raise click.UsageError(f"`{value}` is not a memory size; write for example 512MB or 2GB") from None
    if not 1 <= size <= 1 << 60:  # nor anything that is no number
        raise click.UsageError(f"the memory size `{value}` is out of range; write for example 2GB")
    return int(size)


def staged(value: str) -> tuple[str, ...]:
    """Parse comma-separated names of stages; an unknown one is a ``click.UsageError``."""
    words = tuple(word.strip() for word in value.split(","))
    for word in words:
        if word not in stage_names.ALL:
            raise click.UsageError(f"unknown stage `{word}`; use one of {', '.join(stage_names.ALL)}")
    return words


export_name = registered(FORMATS, "export")


def export_names(value: str) -> tuple[str, ...]:
    """Parse comma-separated names of export formats.

    Raises:
        click.UsageError: a format is unknown.
    """
    return tuple(export_name(word.strip()) for word in value.split(","))


def read_limits(pairs: tuple[tuple[str, str], ...]) -> Limits:
    """Default limits with changes given as pairs of name and value.

    Raises:
        click.UsageError: a limit is unknown or its value is invalid.
    """
    limits = Limits()
    kinds = {field.name: type(getattr(limits, field.name)) for field in fields(limits)}
    for name, text in pairs:
        if name not in kinds:
            near = nearest(name, kinds)
            hint = f"; did you mean `{near}`?" if isinstance(near, str) else f"; use one of {', '.join(kinds)}"
            raise click.UsageError(f"unknown limit `{name}`{hint}")
        try:
            value = float(text)
        except ValueError:
            raise click.UsageError(f"the limit `{name}` is not a number: `{text}`; write a number") from None
        if not 0 < value <= most(name):
            raise click.UsageError(
                f"the limit `{name}` is out of range; write a number above 0 and at most {most(name):g}"
            )
        if kinds[name] is int and not value.is_integer():
            raise click.UsageError(f"the limit `{name}` is not a whole number: `{text}`; write a whole number")
        limits = replace(limits, **{name: kinds[name](value)})
    return limits


FORMS = ("text", "json")
"""Output formats of most commands."""


def form_of(forms: tuple[str, ...]) -> Callable[[Command], Command]:
    """Decorator that adds the flag ``--format`` with these output formats."""
    words = "Output format. `json` prints one JSON document." if "sarif" not in forms else "Output format."
    return click.option("--format", "form", type=click.Choice(forms), default="text", help=words)


form_flag = form_of(FORMS)


memory_limit = click.option(
    "--memory-limit",
    type=memory,
    metavar="SIZE",
    default="8GB",
    show_default=True,
    help="Memory limit of the compiler and its solver. Without a unit, the size is in MB.",
)

backend = of_registry(
    "--backend", "backend", BACKENDS, AUTO, "Planning backend; `auto` runs all suitable backends in turns.", AUTO
)

vehicle = click.option(
    "--vehicle",
    type=vehicle_name,
    shell_complete=one_of(profiles),
    metavar="NAME",
    help="Vehicle profile of teams without `vehicle`. `missionc vehicles` lists all profiles.",
)

poses = click.option(
    "--from",
    "poses",
    type=existing,
    shell_complete=files,
    metavar="FILE",
    help="File of measured start positions: a CSV table with agent,x,y,z, or a JSON list.",
)

force = click.option("--force", is_flag=True, help="Replace an existing folder that the compiler wrote.")

quiet = click.option("--quiet", is_flag=True, help="Print no summary and no progress line.")

quiet_progress = click.option("--quiet", is_flag=True, help="Print no progress line.")

plot_width = click.option(
    "--plot-width", type=click.Choice([*WIDTHS]), help="Plot width: one or two columns of a paper."
)


def output(says: str, page: bool = False) -> Callable[[Command], Command]:
    """Decorator that adds the flag ``-o`` for the path to write.

    Args:
        says: help text.
        page: whether the path is that of a page; otherwise of a folder.
    """
    kind, metavar = (file_to_write, "FILE") if page else (folder_to_write, "FOLDER")
    return click.option("-o", "--output", type=kind, metavar=metavar, help=says)


def seed(most: int = 2**32 - 1) -> Callable[[Command], Command]:
    """Decorator that adds the flag ``--seed``, 0 by default and at most ``most``."""
    return click.option(
        "--seed", type=Count(0, most), default=0, show_default=True, metavar="N", help="Seed of all random choices."
    )


def exported(says: str) -> Callable[[Command], Command]:
    """Decorator that adds the repeatable flag ``--export`` (tuples of names); ``says`` is the help text."""
    return click.option(
        "--export",
        "exported",
        type=export_names,
        shell_complete=several_of(exports),
        multiple=True,
        metavar="NAME[,NAME...]",
        help=says,
    )


def plot(says: str) -> Callable[[Command], Command]:
    """Decorator that adds the flag ``--plot`` for the path of a picture; ``says`` begins the help text."""
    return click.option("--plot", type=picture, metavar="FILE", help=f"{says} to an SVG, PNG or PDF file.")


def time_limit(says: str) -> Callable[[Command], Command]:
    """Decorator that adds the flag ``--time-limit`` in seconds; ``says`` is the help text."""
    return click.option(
        "--time-limit",
        type=Number(min=0, min_open=True, max=1e9),
        default=int(DEFAULT_TIME_LIMIT),
        show_default=True,
        metavar="SECONDS",
        help=says,
    )


def between_steps(command: Command) -> Command:
    """Decorator that adds the flags ``--continuous`` and ``--at-steps``, which ``continuous_time`` reads."""
    refuse = click.option(
        "--continuous", is_flag=True, help="Accept only plans that satisfy every requirement in continuous time."
    )
    take = click.option(
        "--at-steps", is_flag=True, help="Accept the first plan that satisfies every requirement at the sample times."
    )
    return refuse(take(command))


watch = click.option("--watch", is_flag=True, help="Rerun after each change of the mission files, until Ctrl-C.")

verbose = click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Print all requirements, warnings, notes and files, and the smallest margin of each kind of check.",
)

no_open = click.option("--no-open", is_flag=True, help="Print the address of the page without opening a browser.")

EXPLAIN_LIMIT = 20
"""Default time limit for an explanation of infeasibility, seconds."""

explain_limit = click.option(
    "--explain-limit",
    type=Number(min=0, max=1e9),
    default=EXPLAIN_LIMIT,
    show_default=True,
    metavar="SECONDS",
    help="Time to search for suggested fixes if no plan is found. The time limit includes this time.",
)


def of_mission(command: Command, forms: tuple[str, ...] = FORMS) -> Command:
    """Decorator that adds the flags of every command that reads a mission.

    Args:
        command: command.
        forms: its output formats.
    """
    define = click.option(
        "-D",
        "overrides",
        type=pair,
        multiple=True,
        metavar="NAME=VALUE",
        help="Set a parameter of the mission, such as T=30s.",
    )
    return define(limits_and_form(command, forms))


def _set_pair(value: str) -> tuple[str, str]:
    """Parse ``NAME=VALUE`` of a setting; the word ``help`` prints all settings and ends the command.

    Raises:
        click.UsageError: the text is not a pair.
    """
    if value == "help":
        from missionc.backends.settings import default_table

        click.echo(default_table(), nl=False)
        raise click.exceptions.Exit(0)
    return pair(value)


set_values = click.option(
    "--set",
    "settings",
    type=_set_pair,
    multiple=True,
    metavar="NAME=VALUE",
    help="Change a setting of a backend. `--set help` lists all settings with units and ranges.",
)


def limits_and_form(command: Command, forms: tuple[str, ...] = FORMS) -> Command:
    """Decorator that adds the flags ``--limit`` and ``--format``.

    Args:
        command: command.
        forms: its output formats.
    """
    limit = click.option(
        "--limit",
        "limits",
        type=pair,
        multiple=True,
        metavar="NAME=VALUE",
        help="Change a size limit of the compiler, such as formula_nodes=100000.",
    )
    return limit(form_of(forms)(command))
