"""Flags of disturbances, shared by all simulation commands, and their values."""

from __future__ import annotations

import math

import click

from missionc.cli.options import Command, Number, of_registry
from missionc.flight.simulation.trial_bounds import AMOUNTS, ENGINES, QUADROTOR
from missionc.tools.api.disturbances import amounts_of

engine = of_registry("--engine", "engine", ENGINES, QUADROTOR, "Simulator of the flights.")


def wind(value: str) -> tuple[float, float]:
    """Parse ``MEAN`` or ``MEAN,GUST``, both in m/s.

    Raises:
        click.UsageError: the text has another form, or a number is out of its range.
    """
    words = value.split(",")
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 2:
        raise click.UsageError(f"`{value}` is not a wind speed; write MEAN or MEAN,GUST in m/s, such as 1,0.5")
    return numbers[0], numbers[1] if len(numbers) > 1 else 0.0


def loss(value: str) -> tuple[str, float]:
    """Parse ``AGENT@T``, with T in seconds.

    Raises:
        click.UsageError: the text has another form.
    """
    name, _, when = value.rpartition("@")
    try:
        moment = float(when)
    except ValueError:
        moment = math.nan
    if not name or not 0 <= moment < math.inf:
        raise click.UsageError(f"`{value}` is not an agent and a time; write AGENT@SECONDS, such as drone[0]@5")
    return name, moment + 0.0


FLAGS = (
    click.option(
        "--wind",
        type=wind,
        default="0",
        metavar="MEAN[,GUST]",
        help="Mean wind from a random direction, and standard deviation of gusts, in m/s.",
    ),
    *(
        click.option(each.flag, type=Number(0, each.most), default=0.0, metavar=each.unit, help=each.says)
        for each in AMOUNTS
    ),
    click.option(
        "--lose",
        type=loss,
        multiple=True,
        metavar="AGENT@T",
        help="Stop the motors of an agent after T seconds; repeatable.",
    ),
)


def of_disturbance(command: Command) -> Command:
    """Decorator that adds the flags to a command; their values are arguments of ``disturbance_of``."""
    for flag in reversed(FLAGS):
        command = flag(command)
    return command


def disturbance_of(**given: object) -> tuple[dict[str, float], tuple[tuple[str, float], ...]]:
    """Amounts by field name of ``Disturbance``, and the lost agents with their times in seconds.

    Raises:
        click.UsageError: an amount is out of its range, or an agent is lost twice.
    """
    try:
        return amounts_of("simulate", given)
    except ValueError as wrong:
        raise click.UsageError(str(wrong)) from None
