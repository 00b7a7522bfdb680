"""Conditions of a simulated flight, as a record from which the flight can be repeated.

in   Trial, the mission's length; or such a record
out  the record; or Trial
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, fields
from importlib.metadata import PackageNotFoundError, version

from missionc.base.strict_json import is_finite_number
from missionc.flight.simulation.controller import Gains
from missionc.flight.simulation.default_engine import COMMANDS
from missionc.flight.simulation.disturbance import (
    GUST_SECONDS,
    NOISE_SECONDS,
    SETPOINTS_PER_SECOND,
    UNDISTURBED,
    Disturbance,
)
from missionc.flight.simulation.quadrotor import Vehicle
from missionc.flight.simulation.trial_bounds import (
    ENGINES,
    LARGEST_SEED,
    MOST,
    MOST_FLIGHTS,
    MOST_LOST,
    QUADROTOR,
)
from missionc.flight.simulation.trials import Trial
from missionc.version import __version__

BROUGHT = {
    "rotorpy": ("rotorpy.vehicles.crazyflie_params", "rotorpy.controllers.quadrotor_control.SE3Control", 1),
    "crazyflow": ("Drone.cf2x_L250, Dynamics.first_principles", "Control.state, hovering before the start", COMMANDS),
}
"""Vehicle, controller, and number of commands per setpoint of each optional engine."""


def conditions(trial: Trial, seconds: float) -> dict[str, object]:
    """All inputs of a simulated flight of ``seconds`` except the polynomials, as a record; times in seconds."""
    own = (asdict(Vehicle()), asdict(Gains()), COMMANDS)
    foreign = (trial.engine, trial.engine, 1)
    vehicle, controller, commands = own if trial.engine == QUADROTOR else BROUGHT.get(trial.engine, foreign)
    setpoint = 1 / SETPOINTS_PER_SECOND
    return {
        "engine": trial.engine,
        "versions": versions(trial.engine),
        "seed": trial.seed,
        "flights": trial.flights,
        "disturbance": asdict(trial.disturbance),
        "seconds": {
            "flight": seconds,
            "setpoint": setpoint,
            "command": setpoint / commands,
            "gust": GUST_SECONDS,
            "noise": NOISE_SECONDS,
        },
        "vehicle": vehicle,
        "controller": controller,
    }


def versions(engine: str) -> dict[str, str]:
    """Versions of this package and of another engine's package; ``unknown`` if not reported."""
    try:
        own = {engine: version(ENGINES.package(engine) or engine)} if engine != QUADROTOR else {}
    except PackageNotFoundError:
        own = {engine: "unknown"}
    return {"missionc": __version__, **own}


def trial_of(record: Mapping[str, object]) -> Trial | str:
    """Settings of trials from a record, or the name of its first invalid entry."""
    engine, flights, seed = record.get("engine"), record.get("flights"), record.get("seed")
    if not (isinstance(engine, str) and engine in ENGINES):
        return "engine"
    if not _whole(flights, 1, MOST_FLIGHTS):
        return "flights"
    if not _whole(seed, 0, LARGEST_SEED):
        return "seed"
    disturbance = _disturbance(record.get("disturbance"))
    if disturbance is None or (engine != QUADROTOR and (flights != 1 or disturbance != UNDISTURBED)):
        return "disturbance"
    assert isinstance(flights, int)
    assert isinstance(seed, int)
    return Trial(engine, flights, disturbance, seed)


def _disturbance(record: object) -> Disturbance | None:
    names = [field.name for field in fields(Disturbance)]
    if not isinstance(record, dict) or sorted(record) != sorted(names):
        return None
    lose = _lose(record["lose"])
    amounts = [name for name in names if name != "lose"]
    if lose is None or not all(_within(record[name], MOST[name]) for name in amounts):
        return None
    return Disturbance(**{name: float(record[name]) for name in amounts}, lose=lose)


def _lose(record: object) -> tuple[tuple[str, float], ...] | None:
    """Pairs of an agent's name and a time in seconds, every name once; None if the record is invalid."""
    if not isinstance(record, list) or len(record) > MOST_LOST:
        return None
    found = []
    for each in record:
        if not (isinstance(each, list) and len(each) == 2 and isinstance(each[0], str) and _within(each[1], math.inf)):
            return None
        found.append((each[0], float(each[1])))
    return tuple(found) if len({name for name, _ in found}) == len(found) else None


def _within(value: object, most: float) -> bool:
    return is_finite_number(value) and 0 <= value <= most


def _whole(value: object, least: int, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most
