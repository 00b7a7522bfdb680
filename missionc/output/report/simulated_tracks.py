"""Trajectories of a simulated flight from the files of ``simulate``, with its polynomials.

    in   Mission, the text of ``simulation.json``, the flown Curves in space
    out  Simulated, or None if the text is not from this version for this mission

The text is not trusted: errors are computed from its positions.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.strict_json import parse_json
from missionc.base.trace import Array
from missionc.geometry.curves.piecewise_polynomials import Curves
from missionc.ir import Mission
from missionc.output.folder.file_names import SIMULATION_SCHEMA, SIMULATIONS_BEFORE
from missionc.output.report.sample_tracks import Placed
from missionc.verification.certificate import Check

FARTHEST = Limits().magnitude
"""Maximum plausible magnitude of a coordinate, metres."""
MOST_ERRORS = 2_000
"""Maximum number of errors in a chart; adjacent errors are merged by their maximum."""


class Simulated(Record, eq=False):
    """Simulated flight on the report's grid, with its tracking errors and checks.

    Args:
        engine: the simulator.
        placed: positions of all agents on the report's grid.
        error: (agents, moments), metres, evenly spaced from 0 to the end.
        allowed: (agents,), metres.
        checks: checks of the flight, or of the first of several.
    """

    engine: str
    placed: Placed
    error: Array
    allowed: Array
    checks: tuple[Check, ...]


def simulated(mission: Mission, text: str, flown: Curves, rate: int) -> Simulated | None:
    """Simulated flight with ``rate`` samples per step; None if the text is not one of this mission.

    Args:
        text: content of ``simulation.json``.
        flown: polynomials in three coordinates.
    """
    try:
        return _read(mission, parse_json(text), flown, rate)
    except (ValueError, KeyError, TypeError, AttributeError):
        return None


def _read(mission: Mission, document: Any, flown: Curves, rate: int) -> Simulated | None:
    if document["schema"] not in (SIMULATION_SCHEMA, *SIMULATIONS_BEFORE) or not text_of(document["engine"]):
        return None
    often = float(document["flight"]["samples_per_second"])
    places = [document["flight"]["agents"][agent.name] for agent in mission.agents]
    position = np.moveaxis(np.array(places, dtype=np.float64), 1, 2)
    allowed = np.array([float(each["allowed"]) for each in document["tracking"]])
    agents = len(mission.agents)
    if position.shape[0] != agents or position.shape[2] != 3 or position.shape[1] < 2 or allowed.shape != (agents,):
        return None
    if not (often > 0 and (np.abs(position) <= FARTHEST).all() and (np.abs(allowed) <= FARTHEST).all()):
        return None
    times = np.arange(position.shape[1]) / often
    if times[-1] < mission.horizon - 1 / often:
        return None
    error = np.linalg.norm(position - flown.at(np.minimum(times, flown.times[-1])), axis=-1)
    grid = np.asarray(np.arange(rate * mission.steps + 1) * (mission.step / rate), dtype=np.float64)
    placed = Placed(rate, grid, straight(grid, times, position[..., : mission.dimension]))
    return Simulated(document["engine"], placed, fewer(error), allowed, _checks(document))


def straight(grid: Array, times: Array, places: Array) -> Array:
    """Positions interpolated linearly between samples, (agents, samples, dim) -> (agents, grid, dim), metres."""
    return np.stack([np.stack([np.interp(grid, times, axis) for axis in own.T], axis=-1) for own in places])


def text_of(value: object) -> str:
    return value if isinstance(value, str) else ""


def fewer(error: Array) -> Array:
    """Errors merged over time, (agents, samples) -> (agents, moments), to at most ``MOST_ERRORS`` maxima, metres."""
    together = -(-error.shape[1] // MOST_ERRORS)
    padded = np.pad(error, [(0, 0), (0, -error.shape[1] % together)], mode="edge")
    return np.asarray(padded.reshape(len(error), -1, together).max(axis=-1))


def _checks(document: Any) -> tuple[Check, ...]:
    """Checks of the simulated flights: statistics, worst tracking error and clearance of all, requirements of the
    first.
    """
    checks = []
    kept = document.get("kept") or {}
    if isinstance(kept.get("least"), float):
        all_held, share = kept["held"] == kept["of"], 100 * math.floor(1000 * kept["least"]) / 1000
        said = text_of(document["headline"])
        checks.append(Check("simulated flights", "all requirements", share, "% or more", 0.0, all_held, detail=said))
    before = {each["name"]: each["robustness"] for each in document["planned"]}
    by = f"simulated with {document['engine']}"
    for each in document["requirements"]:
        detail = f"{by}; robustness of the plan {_number(before[each['name']]):.3f}"
        name, margin = text_of(each["name"]), _number(each["robustness"])
        checks.append(Check("simulated requirement", name, margin, "m", 0.0, each["satisfied"] is True, detail=detail))
    for each in document["tracking"]:
        spare, who = float(each["allowed"]) - float(each["most"]), text_of(each["agent"])
        detail = f"{by}; largest tracking error {1000 * float(each['most']):.0f} mm"
        checks.append(
            Check("simulated tracking", who, spare, "m", 0.0, spare >= 0, float(each["at"]), (who,), detail=detail)
        )
    for each in document["room"]:
        pair = tuple(map(text_of, each["agents"]))
        margin = float(each["margin"])
        name = "simulated separation" if each["subject"] == "all pairs" else "simulated obstacle"
        at = None if each["at"] is None else float(each["at"])
        subject = text_of(each["subject"])
        checks.append(Check(name, subject, margin, "m", 0.0, margin >= 0, at, pair, f"{by}; distance between bodies"))
    return tuple(checks)


def _number(value: object) -> float:
    """Number from a JSON value; infinite for null or a word, which stand for infinite margins."""
    return float(value) if isinstance(value, int | float) else np.inf
