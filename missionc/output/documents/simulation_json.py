"""The simulation as JSON, ``simulation.json``: its conditions, its results, and the trajectory of the first flight."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np

from missionc.base.trace import Judgement
from missionc.flight.simulation.default_engine import Flown
from missionc.flight.simulation.disturbance import SETPOINTS_PER_SECOND
from missionc.flight.simulation.flight_conditions import conditions
from missionc.flight.simulation.trials import Fraction, Trials, headline
from missionc.ir import Mission
from missionc.output.folder.file_names import SIMULATION_SCHEMA
from missionc.output.json_layout import document, record

EACH = 4
"""Interval of the samples that are stored: every fourth sample."""
DIGITS = 4
"""Number of decimals of positions in metres: tenths of millimetres."""


def simulation_record(mission: Mission, planned: Sequence[Judgement], trials: Trials) -> dict[str, object]:
    """Conditions and results of the simulated flights, as a JSON record.

    Args:
        planned: verdicts of the plan on the requirements.
    """
    first = trials.flights[0]
    return {
        "passed": trials.passed,
        "headline": headline(trials),
        "kept": _kept(trials),
        **conditions(trials.trial, float(mission.horizon)),
        "planned": [each.as_record() for each in planned],
        "requirements": [each.as_record() for each in first.requirements],
        "fractions": {name: _fraction(each) for name, each in trials.fractions().items()},
        "tracking": [
            {"agent": agent.name, "allowed": most, **asdict(trials.error(agent.index))}
            for agent, most in zip(mission.agents, trials.allowed.tolist(), strict=True)
        ],
        "room": [
            {"subject": check.subject, "margin": check.margin, "at": check.at, "agents": list(check.agents)}
            for check in trials.room()
        ],
        "robustness": {
            each.name: [flight.requirements[index].as_record()["robustness"] for flight in trials.flights]
            for index, each in enumerate(first.requirements)
        },
    }


def _kept(trials: Trials) -> dict[str, object]:
    """Number of flights that satisfy everything; without confidence bounds if all flights are equal."""
    found = _fraction(trials.kept)
    return found if trials.trial.disturbance.random else {**found, "least": None, "low": None, "high": None}


def _fraction(each: Fraction) -> dict[str, object]:
    return {"held": each.held, "of": each.flights, "least": each.least, "low": each.low, "high": each.high}


def simulation_json(mission: Mission, entries: Mapping[str, object], flown: Flown) -> bytes:
    """Bytes of ``simulation.json``, equal for equal flights.

    Args:
        entries: result of ``simulation_record``.
    """
    position = np.round(flown.position[0, :, ::EACH], DIGITS) + 0.0
    paths = {agent.name: position[agent.index].T.tolist() for agent in mission.agents}
    flight = f'{{"samples_per_second": {SETPOINTS_PER_SECOND // EACH}, "agents": {record(paths, depth=1)}}}'
    return document({"schema": SIMULATION_SCHEMA, **entries}, f'  "flight": {flight}').encode()
