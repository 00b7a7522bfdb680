"""Flags of disturbances, of every command that flies plans in simulation, and the values that they give."""

from __future__ import annotations

import math

import click

from missionc.cli.options import Command, Number
from missionc.simulate.trial_bounds import (
    MOST_CLOCK_ERROR,
    MOST_DOWNWASH,
    MOST_LATENCY,
    MOST_LOSS,
    MOST_LOST,
    MOST_MASS_ERROR,
    MOST_NOISE,
    MOST_START_ERROR,
    MOST_WIND,
)


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
    click.option(
        "--mass-error",
        type=Number(0, MOST_MASS_ERROR),
        default=0.0,
        metavar="PERCENT",
        help="Each vehicle weighs up to so much more or less than its controller thinks.",
    ),
    click.option(
        "--start-error",
        type=Number(0, MOST_START_ERROR),
        default=0.0,
        metavar="METRES",
        help="Each begins up to so far beside its start, along x and along y.",
    ),
    click.option(
        "--clock-error",
        type=Number(0, MOST_CLOCK_ERROR),
        default=0.0,
        metavar="SECONDS",
        help="Each begins up to so late.",
    ),
    click.option(
        "--noise",
        type=Number(0, MOST_NOISE),
        default=0.0,
        metavar="METRES",
        help="The controller is shown a position that is off by so much, the standard deviation along each axis.",
    ),
    click.option(
        "--latency",
        type=Number(0, MOST_LATENCY),
        default=0.0,
        metavar="SECONDS",
        help="It is shown position and velocity so late.",
    ),
    click.option(
        "--packet-loss",
        type=Number(0, MOST_LOSS),
        default=0.0,
        metavar="PERCENT",
        help="So many position updates are lost.",
    ),
    click.option(
        "--missed-start",
        type=Number(0, MOST_LOSS),
        default=0.0,
        metavar="PERCENT",
        help="So many vehicles never hear the start.",
    ),
    click.option(
        "--battery-sag",
        type=Number(0, MOST_LOSS),
        default=0.0,
        metavar="PERCENT",
        help="The most that a motor gives falls by so much until the end.",
    ),
    click.option(
        "--weak-motor",
        type=Number(0, MOST_LOSS),
        default=0.0,
        metavar="PERCENT",
        help="One motor of each gives up to so much less than it is told.",
    ),
    click.option(
        "--downwash",
        type=Number(0, MOST_DOWNWASH),
        default=0.0,
        metavar="FACTOR",
        help="Those below are pushed down by so many times a published model's force.",
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
    *,
    air: tuple[float, float],
    mass_error: float,
    start_error: float,
    clock_error: float,
    noise: float,
    latency: float,
    packet_loss: float,
    missed_start: float,
    battery_sag: float,
    weak_motor: float,
    downwash: float,
    lose: tuple[tuple[str, float], ...],
) -> tuple[dict[str, float], tuple[tuple[str, float], ...]]:
    """The amounts of a ``Disturbance`` by its fields' names; and who is lost, and when, s."""
    amounts = {
        "wind": air[0],
        "gust": air[1],
        "mass": mass_error / 100,
        "start": start_error,
        "clock": clock_error,
        "noise": noise,
        "latency": latency,
        "packets": packet_loss / 100,
        "missed": missed_start / 100,
        "battery": battery_sag / 100,
        "motor": weak_motor / 100,
        "downwash": downwash,
    }
    return amounts, _once(lose)
