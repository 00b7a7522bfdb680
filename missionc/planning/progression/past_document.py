"""Past of a mission as JSON, ``missionc.past/1``: the flights before the plan of a folder.

    in   Past; or an untrusted text
    out  its text; or Past

The document lists the completed stretches. Each contains the states of all agents at its steps, and the agents that
were lost, slower or in motion at its end. The document also contains the dropped requirements, and the former texts of
mission files that have changed.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.strict_json import NotJsonError, is_finite_number, parse_record
from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds
from missionc.planning.progression.stretches import Stretch

SCHEMA = "missionc.past/1"
MOST_STRETCHES = 1_000
STATE = 5, 4
"""Shape of an agent's state: position, velocity, acceleration, jerk and snap, each of x, y, z and yaw."""
ENTRIES = frozenset({"step", "until", "lost", "given_up", "slow", "moving", "begins", "texts", "agents"})
STAYS = "stays"
"""Key of a stretch after which no agent returns to its pad; the key is present only in that case."""


class Flown(Record, eq=False):
    """Completed stretch of a mission, as the past document records it.

    Args:
        agents: names of the agents in the trace, in its order.
        until: seconds after the stretch's beginning up to which it was flown; later states are commanded states.
        begins: initial states, (5, 4), of the polynomials of the stretch, by agent name.
        texts: former texts of mission files, by file name; files without an entry are unchanged.
    """

    stretch: Stretch
    agents: tuple[str, ...]
    until: float
    texts: Mapping[str, str] = field(default_factory=dict)
    begins: Mapping[str, Array] = field(default_factory=dict)


class Past(Record, eq=False):
    """Completed stretches of a mission, in order."""

    flown: tuple[Flown, ...]

    @property
    def steps(self) -> int:
        return sum(each.stretch.steps for each in self.flown)


def past_json(past: Past) -> str:
    """Text of ``past.json``; every number is read back as the same double."""
    stretches = []
    for each in past.flown:
        trace = each.stretch.trace
        rows = [
            {
                "name": name,
                "position": trace.position[row].tolist(),
                "velocity": trace.velocity[row].tolist(),
                "yaw": trace.heading[row].tolist(),
            }
            for row, name in enumerate(each.agents)
        ]
        head = {
            "step": float(trace.step),
            "until": each.until,
            "lost": list(each.stretch.lost),
            "given_up": list(each.stretch.given_up),
            "slow": dict(each.stretch.slow),
            "moving": {name: state.tolist() for name, state in each.stretch.moving.items()},
            "begins": {name: state.tolist() for name, state in each.begins.items()},
            "texts": dict(each.texts),
            **({STAYS: True} if each.stretch.stays else {}),
        }
        entries = [f"     {_text(key)}: {_text(value)}" for key, value in head.items()]
        states = ",\n".join(f"       {_text(row)}" for row in rows)
        entries.append(f'     "agents": [\n{states}\n     ]')
        stretches.append("    {\n" + ",\n".join(entries) + "\n    }")
    return "{\n" + f'  "schema": {_text(SCHEMA)},\n  "stretches": [\n' + ",\n".join(stretches) + "\n  ]\n}\n"


def _text(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def read_past(text: str, magnitude: float) -> Past | str:
    """Past that a document describes, or the reason why the document is invalid.

    Args:
        text: contents of ``past.json``.
        magnitude: maximum absolute value of numbers.
    """
    try:
        stretches = parse_record(text, SCHEMA).get("stretches")
    except NotJsonError as error:
        return error.reason
    if not isinstance(stretches, list) or not 1 <= len(stretches) <= MOST_STRETCHES:
        return "no list of stretches"
    flown = [_flown(each, magnitude) for each in stretches]
    wrong = next((each for each in flown if isinstance(each, str)), None)
    return wrong or Past(tuple(each for each in flown if isinstance(each, Flown)))


def _flown(entry: Any, magnitude: float) -> Flown | str:
    if not isinstance(entry, dict) or set(entry) - {STAYS} != ENTRIES or entry.get(STAYS, True) is not True:
        return "a stretch has unexpected entries"
    step, until, lost, given_up = (entry[key] for key in ("step", "until", "lost", "given_up"))
    slow, texts, agents = (entry[key] for key in ("slow", "texts", "agents"))
    if not (_is_within(step, magnitude) and _is_within(until, magnitude)) or step <= 0 or until < 0:
        return "the `step` or `until` of a stretch is invalid"
    if not (_names(lost) and _names(given_up) and isinstance(texts, dict) and _names(list(texts.values()))):
        return "a stretch has invalid names or texts"
    if not isinstance(slow, dict) or not all(_is_within(each, magnitude) and each > 0 for each in slow.values()):
        return "a stretch has invalid speeds"
    if not isinstance(agents, list) or not agents or not all(isinstance(each, dict) for each in agents):
        return "a stretch has no agents"
    names = [each.get("name") for each in agents]
    arrays = [
        [_array(each.get(key), dimensions, magnitude) for each in agents]
        for key, dimensions in (("position", 2), ("velocity", 2), ("yaw", 1))
    ]
    flat = [array for column in arrays for array in column]
    if not _names(names) or any(array is None for array in flat):
        return "the states of an agent are not lists of finite numbers"
    moving, begins = (_states(entry[key], names, magnitude) for key in ("moving", "begins"))
    if moving is None or begins is None:
        return "the states in `moving` or `begins` do not match the agents"
    shapes = [{array.shape for array in column if array is not None} for column in arrays]
    if any(len(each) != 1 for each in shapes) or shapes[0] != shapes[1]:
        return "its agents have different numbers of states"
    position, velocity, heading = (np.stack([array for array in column if array is not None]) for column in arrays)
    if heading.shape != position.shape[:2]:
        return "its agents have different numbers of states"
    trace = Trace(Seconds(float(step)), position, velocity, heading)
    stretch = Stretch(trace, tuple(lost), tuple(given_up), dict(slow), moving, STAYS in entry)
    return Flown(stretch, tuple(names), float(until), dict(texts), begins)


def _states(value: object, names: list[str], magnitude: float) -> dict[str, Array] | None:
    """States from position to snap, (5, 4), metres, rad and seconds, by agent name; None if the JSON value is
    invalid."""
    if not isinstance(value, dict) or not set(value) <= set(names):
        return None
    states = {name: _array(each, 2, magnitude) for name, each in value.items()}
    found = {name: state for name, state in states.items() if state is not None and state.shape == STATE}
    return found if len(found) == len(value) else None


def _names(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(each, str) for each in value)


def _is_within(value: object, magnitude: float) -> bool:
    return is_finite_number(value) and abs(value) <= magnitude


def _array(value: object, dimensions: int, magnitude: float) -> Array | None:
    """Array of ``dimensions`` axes (any shape and unit) from nested lists of finite numbers; None if the JSON value is
    invalid."""
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return None
    fits = array.ndim == dimensions and array.size > 0 and bool((np.abs(array) <= magnitude).all())
    return array if fits else None
