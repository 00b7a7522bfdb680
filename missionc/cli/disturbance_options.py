"""Flags of disturbances, of every command that flies plans in simulation, and the values that they give."""

from __future__ import annotations

import math

import click

from missionc.cli.options import Command, Number, of_registry
from missionc.flight.simulation.trial_bounds import AMOUNTS, ENGINES, MOST_LOST, MOST_WIND, QUADROTOR

engine = of_registry("--engine", "engine", ENGINES, QUADROTOR)


def wind(value: str) -> tuple[float, float]:
    """``MEAN`` or ``MEAN,GUST``, m/s."""
    words = value.split(",")
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 2 or not all(0 <= number <= MOST_WIND for number in numbers):
        raise click.UsageError(f"`{value}` is not a wind such as 1 or 1,0.5, in m/s")
    return numbers[0], numbers[1] if len(numbers) > 1 else 0.0


def loss(value: str) -> tuple[str, float]:
    """``AGENT@T``, with T in seconds."""
    name, _, when = value.rpartition("@")
    try:
        moment = float(when)
    except ValueError:
        moment = math.nan
    if not name or not 0 <= moment < math.inf:
        raise click.UsageError(f"`{value}` is no agent and a second such as drone[0]@5")
    return name, moment + 0.0


def _once(lose: tuple[tuple[str, float], ...]) -> tuple[tuple[str, float], ...]:
    names = [name for name, _ in lose]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise click.UsageError(f"`{twice}` can be lost once")
    if len(lose) > MOST_LOST:
        raise click.UsageError(f"at most {MOST_LOST} agents can be lost")
    return lose


FLAGS = (
    click.option("--wind", "air", type=wind, default="0", metavar="MEAN[,GUST]", help="In m/s; level, from anywhere."),
    *(
        click.option(each.flag, each.field, type=Number(0, each.most), default=0.0, metavar=each.unit, help=each.says)
        for each in AMOUNTS
    ),
    click.option(
        "--lose",
        type=loss,
        multiple=True,
        metavar="AGENT@T",
        help="The motors of an agent stop at second T. Repeatable.",
    ),
)


def of_disturbance(command: Command) -> Command:
    """The flags; their values go to ``disturbance_of``."""
    for flag in reversed(FLAGS):
        command = flag(command)
    return command


def disturbance_of(
    *, air: tuple[float, float], lose: tuple[tuple[str, float], ...], **given: float
) -> tuple[dict[str, float], tuple[tuple[str, float], ...]]:
    """The amounts of a ``Disturbance`` by its fields' names; and who is lost, and when, s."""
    numbers = {each.field: each.of(given[each.field]) for each in AMOUNTS}
    return {"wind": air[0], "gust": air[1], **numbers}, _once(lose)
