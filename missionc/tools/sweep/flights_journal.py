"""Journal of simulated flights, from which an interrupted command resumes.

    in   the path of the file, the settings that determine the flights
    out  the finished flights, by number; a further line for the next ones
    says MC706 MC707 MC763

The first line states the settings. Each further line has the records of some flights with consecutive numbers. A record
is JSON from which the report of trials can be made. It omits the states at the steps, which only displayed flights
need.
"""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from missionc.base.diagnostics.code import CHECKPOINT_MISMATCH, CHECKPOINT_UNREADABLE
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.strict_json import NotJsonError, parse_json, parse_record
from missionc.base.trace import Judgement
from missionc.compiler.checkpoint_file import Identity, difference
from missionc.extension import Trace
from missionc.flight.simulation.judge_flight import Error, Flight
from missionc.output.folder.ownership import ANOTHER_FILE, cannot_write, reason, shown
from missionc.tools.sweep import run_answer
from missionc.tools.sweep.append_journal import LARGEST, Journal, locked
from missionc.verification.certificate import Check


def flights_text(flights: Iterable[Flight], curves: bool) -> bytes:
    """Records of flights as JSON; every number reads back as the same double.

    Args:
        flights: flights.
        curves: whether to include the error over time.
    """
    return json.dumps([_record(each, curves) for each in flights], separators=(",", ":")).encode("ascii")


def parse_flights(content: bytes, trace: Trace) -> list[Flight]:
    """Parse the JSON of ``flights_text``.

    Args:
        content: JSON text.
        trace: states at the steps, used for every flight since records omit them.
    """
    return read_flights(parse_json(content, finite=False), trace)


def read_flights(records: Iterable[dict[str, Any]], trace: Trace) -> list[Flight]:
    """Parse flights from JSON values.

    Args:
        records: parsed records.
        trace: states at the steps, used for every flight.

    Raises:
        ValueError, KeyError, TypeError: a record is not a valid flight.
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


SCHEMA = "missionc.flights/1"
ANOTHER = "another file with `--journal`"


class FlightsJournal:
    """Journal of flights, open for appending; ``over`` contains its flights by number."""

    def __init__(self, path: Path, journal: Journal) -> None:
        self._path = path
        self._journal = journal
        self.over: dict[int, Flight] = {}

    def begin(self, of: Identity, like: Flight) -> Diagnostic | None:
        """Read the contents, and write the first line of an empty file.

        Args:
            of: settings that determine the flights.
            like: a flight of the same folder, with the same agents and requirements.

        Returns:
            An error if the file is unreadable or belongs to other flights, or None.
        """
        try:
            if self._journal.size > LARGEST:
                return _unreadable(self._path, f"it is larger than {LARGEST:,} bytes")
            *lines, half = self._journal.read().split(b"\n")
            if not (lines or _first(of).startswith(half)):
                return _unreadable(self._path, "its first line is missing")
            wrong = self._read(lines, of, like) if lines else None
            if wrong:
                return wrong
            self._journal.cut()
            if not lines:
                self._journal.add(_first(of))
        except OSError as error:
            return cannot_write(self._path, reason(error), ANOTHER_FILE)
        return None

    def add(self, first: int, records: bytes, flights: Iterable[Flight]) -> Diagnostic | None:
        """Append flights; return an error of writing, or None.

        Args:
            first: number of the first flight.
            records: their JSON text.
            flights: the flights.
        """
        try:
            self._journal.add(b'{"first":%d,"flights":%s}' % (first, records))
            self._journal.sync()
            self.over |= enumerate(flights, first)
        except OSError as error:
            return cannot_write(self._path, reason(error), ANOTHER_FILE)
        return None

    def _read(self, lines: list[bytes], of: Identity, like: Flight) -> Diagnostic | None:
        number = 1
        try:
            other = _not_of(lines[0], of)
            if other:
                return _other(self._path, other)
            for line in lines[1:]:
                number += 1
                self.over |= _flights(line, like)
        except (ValueError, KeyError, TypeError) as error:
            why = f": {error.reason}" if isinstance(error, NotJsonError) else ""
            return _unreadable(self._path, f"invalid line {number}{why}")
        return None


@contextmanager
def opened(path: Path) -> Iterator[FlightsJournal | Diagnostic]:
    """Yield the locked journal at a path before ``begin``, or the finding that it is in use."""
    real = Path(os.path.realpath(path))
    with locked(real, path, ANOTHER) as journal:
        yield FlightsJournal(path, journal) if isinstance(journal, Journal) else journal


def _first(of: Identity) -> bytes:
    return run_answer.one_line({"schema": SCHEMA, "run": dict(of)}).encode("ascii")


def _not_of(line: bytes, of: Identity) -> str:
    """Reason why a first line belongs to other flights; empty if it does not."""
    document = parse_record(line)
    if document["schema"] != SCHEMA:
        return f"its schema is `{str(document['schema'])[:40]}`, not `{SCHEMA}`"
    what, why = difference(dict(document["run"]), of) or ("", "")
    return "the plan folder is different or was compiled again" if what == "folder" else why


def _flights(line: bytes, like: Flight) -> dict[int, Flight]:
    """Flights of a line by number.

    Args:
        line: JSON text.
        like: a flight of the same folder.

    Raises:
        NotJsonError: a flight has other agents or requirements.
    """
    document = parse_json(line, finite=False)
    first, flights = document["first"], read_flights(document["flights"], like.trace)
    if type(first) is not int or not all(_alike(each, like) for each in flights):
        raise NotJsonError("its flights belong to another team")
    return dict(enumerate(flights, first))


def _alike(flight: Flight, like: Flight) -> bool:
    """Return whether two flights have the same entries with values of the same types."""
    own, other = (_entries(each) for each in (flight, like))
    return (
        len(flight.error) == len(like.error)
        and [each.name for each in flight.requirements] == [each.name for each in like.requirements]
        and [each.name for each in flight.preferences] == [each.name for each in like.preferences]
        and [each.subject for each in flight.room] == [each.subject for each in like.room]
        and all(
            _is_like(getattr(one, entry.name), getattr(two, entry.name), optional=entry.default is None)
            for one, two in zip(own, other, strict=True)
            for entry in fields(two)
        )
    )


def _entries(flight: Flight) -> list[Error | Judgement | Check]:
    return [*flight.error, *flight.requirements, *flight.preferences, *flight.room]


def _is_like(value: object, like: object, *, optional: bool) -> bool:
    """Return whether two values have the same type.

    All kinds of numbers are equal, and an optional value can be None.
    """
    if value is None:
        return optional
    if isinstance(like, bool | str):
        return type(value) is type(like)
    if isinstance(like, tuple):
        return isinstance(value, tuple) and all(isinstance(each, str) for each in value)
    return isinstance(value, float | int) and not isinstance(value, bool) and value == value


# ---------------------------------------------------------------- messages


def _other(path: Path, why: str) -> Diagnostic:
    message = f"`{shown(path)}` belongs to other flights"
    return Diagnostic(CHECKPOINT_MISMATCH, message, None, notes=(why,), help=f"use {ANOTHER}")


def _unreadable(path: Path, why: str) -> Diagnostic:
    message = f"`{shown(path)}` is not a journal of flights"
    return Diagnostic(CHECKPOINT_UNREADABLE, message, None, notes=(why[:200],), help=f"use {ANOTHER}")
