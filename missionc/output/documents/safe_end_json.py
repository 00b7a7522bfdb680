"""Safe ends as JSON: at each of many times polynomials that bring every agent to rest, and the order of landing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.base.strict_json import NotJsonError, parse_record
from missionc.base.units import is_number
from missionc.geometry.curves.piecewise_polynomials import Pieces, values
from missionc.ir import Mission
from missionc.output.json_layout import compact, document, listed
from missionc.verification.certificate import Certificate
from missionc.verification.flight.verify_safe_end import HOVER, WAIT, WITHOUT
from missionc.verification.flight.verify_whole_flight import Stop

SCHEMA = "missionc.safe_end/1"
MOST_MOMENTS = 1000
"""Maximum number of stop times in a file."""


def safe_end_json(mission: Mission, stops: Sequence[Stop]) -> str:
    """Content of ``safe_end.json``; nine digits distinguish all float32 numbers."""
    names = [agent.name for agent in mission.agents]
    rows = []
    for stop in stops:
        landing = {index for turn in stop.turns for index in turn}
        rows.append(
            {
                "at": stop.at,
                "seconds": stop.seconds,
                "land": [[names[index] for index in turn] for turn in stop.turns],
                "hover": [name for index, name in enumerate(names) if index not in landing],
                "stops": [[float(f"{each:.9g}") + 0.0 for each in _numbers(own)] for own in stop.pieces],
            }
        )
    head = {"schema": SCHEMA, "mission": mission.name, "agents": names}
    return document(head, listed("moments", map(compact, rows)))


def safe_end_noted(certificate: Certificate) -> list[str]:
    """Note for the user that states whether the flight can be ended safely at every time, as a list.

    Empty if unknown.
    """
    figures = {figure.name: figure.value for figure in certificate.figures}
    wait, without = figures.get(WAIT), figures.get(WITHOUT)
    if wait is None or without is None:
        return []
    if without == 0:
        return [f"a verified safe end exists at every time; it starts within {wait:.3g} s"]
    return [f"no safe end was found for the last {without:.4g} s; before that, a safe end starts within {wait:.3g} s"]


def _numbers(own: Pieces) -> list[float]:
    """Polynomial coefficients of a stop: eight ascending ones each for x, y, z and yaw."""
    numbers: list[float] = own.coefficients[0].reshape(-1).tolist()
    return numbers


def read_safe_end(text: str, mission: Mission) -> tuple[Stop, ...] | str:
    """Stops in the text of ``safe_end.json``, with numbers as in the firmware, or a text that describes the error."""
    try:
        value = parse_record(text, SCHEMA)
    except NotJsonError as error:
        return error.reason
    names = [agent.name for agent in mission.agents]
    if set(value) != {"schema", "mission", "agents", "moments"}:
        return "its keys are not those of safe ends"
    if value["agents"] != names or not isinstance(value["moments"], list):
        return "it has other agents, or no list of times"
    if len(value["moments"]) > MOST_MOMENTS:
        return f"it has more than {MOST_MOMENTS} times"
    stops = []
    for number, row in enumerate(value["moments"], 1):
        stop = _stop(row, names)
        if stop is None:
            return f"time {number} is not a stop of all agents"
        stops.append(stop)
    return tuple(stops)


def _stop(row: object, names: list[str]) -> Stop | None:
    if not isinstance(row, dict) or set(row) != {"at", "seconds", "land", "hover", "stops"}:
        return None
    numbers = row["stops"]
    if not (is_number(row["at"]) and is_number(row["seconds"]) and isinstance(numbers, list)):
        return None
    sound = len(numbers) == len(names) and all(isinstance(own, list) and len(own) == 32 for own in numbers)
    if not sound or not all(is_number(each) for own in numbers for each in own):
        return None
    turns = _turns(row["land"], names)
    with np.errstate(over="ignore", invalid="ignore"):
        seconds = np.float32(row["seconds"])
        if turns is None or not 0 < seconds < np.inf:
            return None
        pieces = tuple(_pieces(own, float(seconds)) for own in numbers)
    if not all(np.isfinite(own.coefficients).all() for own in pieces):
        return None
    return Stop(float(row["at"]), pieces, turns)


def _pieces(numbers: list[float], seconds: float) -> Pieces:
    moving = np.array(numbers, dtype=np.float64).astype(np.float32).astype(np.float64).reshape(4, 8)
    still = np.zeros_like(moving)
    still[:, 0] = values(moving, np.asarray(seconds)).astype(np.float32)
    return Pieces(np.array([seconds, float(np.float32(HOVER))]), np.stack([moving, still]))


def _turns(land: object, names: list[str]) -> tuple[tuple[int, ...], ...] | None:
    """Landing turns by agent index; None if a turn is empty, or if an agent is repeated or unknown."""
    if not isinstance(land, list) or not all(isinstance(turn, list) and turn for turn in land):
        return None
    known = {name: index for index, name in enumerate(names)}
    called = [name for turn in land for name in turn]
    if not all(isinstance(name, str) and name in known for name in called) or len(set(called)) < len(called):
        return None
    return tuple(tuple(known[name] for name in turn) for turn in land)
