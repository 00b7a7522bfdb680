"""Bounds of simulated trials: which engines fly, how many flights, and each disturbance with its flag; values alone.

The command line refuses what is beyond them, and so does whoever flies a record again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from missionc.base.extensions import Kind, Registry, Unfit
from missionc.base.late_dataclass import dataclass

QUADROTOR = "quadrotor"
"""The engine that is always there."""

OTHERS = ("rotorpy", "crazyflow")
"""Those that are installed on request; like those of extensions they fly once and undisturbed."""


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
"""Every engine by its name, as the function that flies."""

MOST_FLIGHTS = 100_000
LARGEST_SEED = 2**32 - 1

MOST_WIND = 100
"""Metres per second, of the mean and of the gusts."""

MOST_CLOCK_ERROR = 1
"""Seconds."""

MOST_LOST = 1000
"""Agents that are lost."""


@dataclass(frozen=True, slots=True)
class Amount:
    """One disturbance: from nothing to the most that there may be of it.

    Args:
        field: of a ``Disturbance``.
        flag: on the command line, where it is given in ``unit``.
        most: in that unit.
        says: its help.
    """

    field: str
    flag: str
    unit: str
    most: float
    says: str

    def of(self, given: float) -> float:
        """What the field is, of what was given: percents are shares there."""
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
"""All that are a number; the wind is two, and who is lost is a name and a time."""

MOST = {"wind": float(MOST_WIND), "gust": float(MOST_WIND), **{each.field: each.of(each.most) for each in AMOUNTS}}
"""The most that each field of a ``Disturbance`` may be, but for whom it loses."""
