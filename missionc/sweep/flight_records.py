"""Records of flights, from which what is said of trials can be made: numbers and words, in JSON and back.

The states at the steps are not among them: of a flight that is not shown
nobody needs them.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from missionc.base.judgement import Judgement
from missionc.base.strict_json import parse_json
from missionc.base.trace import Trace
from missionc.simulate.judge_flight import Error, Flight
from missionc.verify.certificate import Check


def written(flights: Iterable[Flight], curves: bool) -> bytes:
    """The records; every number reads back as the same double.

    Args:
        curves: whether the error over time is among them.
    """
    return json.dumps([_record(each, curves) for each in flights], separators=(",", ":")).encode("ascii")


def read(content: bytes, trace: Trace) -> list[Flight]:
    """The flights of some records; ``trace`` stands for the states of each."""
    return flights(parse_json(content, finite=False), trace)


def flights(records: Iterable[dict[str, Any]], trace: Trace) -> list[Flight]:
    """The same, of records that were read as JSON before.

    Raises:
        ValueError, KeyError, TypeError: one is none of a flight.
    """
    return [_flight(each, trace) for each in records]


def _record(flight: Flight, curves: bool) -> dict[str, Any]:
    return {
        "error": [asdict(each) for each in flight.error],
        "requirements": [asdict(each) for each in flight.requirements],
        "preferences": [asdict(each) for each in flight.preferences],
        "room": [asdict(each) for each in flight.room],
        "largest": base64.b64encode(flight.largest.astype("<f8").tobytes()).decode("ascii") if curves else "",
    }


def _flight(record: dict[str, Any], trace: Trace) -> Flight:
    return Flight(
        tuple(Error(**each) for each in record["error"]),
        np.frombuffer(base64.b64decode(record["largest"]), dtype="<f8").astype(np.float64),
        trace,
        _judgements(record["requirements"]),
        _judgements(record["preferences"]),
        tuple(Check(**{**each, "agents": tuple(each["agents"])}) for each in record["room"]),
    )


def _judgements(records: Sequence[dict[str, Any]]) -> tuple[Judgement, ...]:
    return tuple(Judgement(**{**each, "agents": tuple(each["agents"])}) for each in records)
