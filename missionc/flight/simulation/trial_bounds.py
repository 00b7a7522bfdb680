"""Limits of simulated trials, as plain values: engines, numbers of flights, and each disturbance with its flag.

The command line and the repetition of records reject values beyond them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from missionc.base.extensions import Kind, Registry, Unfit
from missionc.base.late_dataclass import Record

QUADROTOR = "quadrotor"
"""Name of the built-in engine."""

OTHERS = ("rotorpy", "crazyflow")
"""Names of the optional engines; like those of extensions, they simulate one undisturbed flight."""


def _engine(name: str, value: object) -> Callable[..., Any]:
    if not callable(value):
        raise Unfit("a simulator is a function of the polynomials and the duration of a flight")
    return value


ENGINES = Registry(
    Kind.SIMULATOR,
    {
        QUADROTOR: "missionc.flight.simulation.default_engine:fly",
        **{name: f"missionc.flight.simulation.engines.with_{name}:fly" for name in OTHERS},
    },
    _engine,
)
"""Simulation function of each engine, by name."""

MOST_FLIGHTS = 100_000
LARGEST_SEED = 2**32 - 1

MOST_WIND = 100
"""Maximum speed of mean wind and of gusts, m/s."""

MOST_CLOCK_ERROR = 1
"""Maximum delay of the start by clock error, seconds."""

MOST_LOST = 1000
"""Maximum number of lost agents in a trial."""


class Amount(Record):
    """One numeric disturbance, with its command-line flag and its maximum.

    Args:
        field: field of a ``Disturbance``.
        flag: flag on the command line, in ``unit``.
        most: maximum in that unit.
        says: help text.
    """

    field: str
    flag: str
    unit: str
    most: float
    says: str

    def of(self, given: float) -> float:
        """Value of the disturbance's field from the value given on the command line; percentages become fractions."""
        return given / (100 if self.unit == "PERCENT" else 1)


AMOUNTS = (
    Amount(
        "mass",
        "--mass-error",
        "PERCENT",
        50,
        "Largest difference of the true mass from the mass in the controller.",
    ),
    Amount("start", "--start-error", "METRES", 1, "Largest offset of the start position, along x and y."),
    Amount("clock", "--clock-error", "SECONDS", MOST_CLOCK_ERROR, "Largest delay of the start of a vehicle."),
    Amount(
        "noise",
        "--noise",
        "METRES",
        1,
        "Standard deviation of the position estimate, along each axis.",
    ),
    Amount("latency", "--latency", "SECONDS", 1, "Delay of the position and velocity estimates."),
    Amount("packets", "--packet-loss", "PERCENT", 100, "Share of position updates that are lost."),
    Amount("missed", "--missed-start", "PERCENT", 100, "Share of vehicles that miss the start command."),
    Amount("battery", "--battery-sag", "PERCENT", 100, "Loss of maximum motor thrust by the end of the flight."),
    Amount("motor", "--weak-motor", "PERCENT", 100, "Largest loss of thrust of one motor of each vehicle."),
    Amount(
        "downwash",
        "--downwash",
        "FACTOR",
        10,
        "Downwash force on lower vehicles, as a multiple of a published model.",
    ),
)
"""All disturbances given by a single number; wind is given by two, and a lost agent by a name and a time."""

MOST = {"wind": float(MOST_WIND), "gust": float(MOST_WIND), **{each.field: each.of(each.most) for each in AMOUNTS}}
"""Maximum of each numeric field of a ``Disturbance``."""
