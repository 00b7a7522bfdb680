"""Scenarios: events of a simulated flight, from a small TOML file.

in   the text
out  Scenario, or its errors
says MC751

A scenario has a `[wind]`, the quality of reports (`[reports]`), and `[[event]]`s.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from missionc import Diagnostic, Limits, Source
from missionc.base.diagnostics.code import SCENARIO_UNUSABLE
from missionc.base.diagnostics.model import Label
from missionc.base.source import Span
from missionc.base.strict_json import is_finite_number
from missionc.flight.simulation.trial_bounds import MOST_CLOCK_ERROR, MOST_WIND

MOST_EVENTS = 100


@dataclass(frozen=True, slots=True)
class Event:
    """Event of a flight: one of ``lose``, ``slow`` and ``change`` is not empty.

    Args:
        at: time of the event, s.
        lose: agent whose motors stop.
        slow: agent whose speed is limited from then on.
        to: the limit as a fraction of its maximum speed.
        change: text of a patch of the mission from then on, which ground control receives at the same time.
    """

    at: float
    lose: str = ""
    slow: str = ""
    to: float = 1.0
    change: str = ""


@dataclass(frozen=True, slots=True)
class Scenario:
    """Conditions and events of a flight.

    Args:
        wind, gust: as in ``Disturbance``, m/s.
        noise: standard deviation of a reported position along each axis, m.
        dropped: fraction of reports that never arrive.
        late: maximum delay of reports and uploads, s.
        skew: maximum delay of an agent's clock, s.
        events: events in the order of their times.
    """

    wind: float = 0.0
    gust: float = 0.0
    noise: float = 0.0
    dropped: float = 0.0
    late: float = 0.0
    skew: float = 0.0
    events: tuple[Event, ...] = ()


NUMBERS: Mapping[str, Mapping[str, float]] = {
    "wind": {"mean": MOST_WIND, "gust": MOST_WIND},
    "reports": {"noise": 1.0, "dropped": 0.95, "late": 2.0, "skew": MOST_CLOCK_ERROR},
}
"""Maximum of each number, by table and key; the minimum is 0."""
KINDS = ("lose", "slow", "change")
LONGEST = Limits().magnitude
"""Maximum time of an event, seconds."""
HALF = 0.5
"""Default of ``to``: the speed of a slow agent as a fraction of its maximum speed."""


def read_scenario(source: Source, agents: tuple[str, ...]) -> Scenario | list[Diagnostic]:
    """Parse a scenario; return all its errors if there are any.

    Args:
        source: TOML text.
        agents: names of the agents.
    """
    try:
        document = tomllib.loads(source.text)
    except ValueError as error:  # a number of more than 4,300 digits has no error class of its own
        where = re.search(r"line (\d+)", str(error))
        line = int(where[1]) if where else len(source.line_starts) if "end of document" in str(error) else 1
        return [_wrong(source, line, "not valid TOML")]
    except RecursionError:
        return [_wrong(source, 1, "nested too deeply")]
    strange = [key for key in document if key not in (*NUMBERS, "event")]
    findings = [_wrong(source, _line(source, key), f"unknown key `{key}`") for key in strange]
    numbers = {
        name: _number(source, document.get(table), table, name, most, findings)
        for table, names in NUMBERS.items()
        for name, most in names.items()
    }
    listed = document.get("event", [])
    if not isinstance(listed, list) or len(listed) > MOST_EVENTS:
        findings.append(_wrong(source, _line(source, "event"), f"expected at most {MOST_EVENTS} `[[event]]` tables"))
        listed = []
    lines = [number for number, line in enumerate(source.text.split("\n"), 1) if line.strip().startswith("[[event]]")]
    events = [_event(each, agents) for each in listed]
    for index, each in enumerate(events):
        if isinstance(each, str):
            findings.append(_wrong(source, lines[index] if index < len(lines) else 1, each))
    if findings:
        return findings
    happening = tuple(sorted((each for each in events if isinstance(each, Event)), key=lambda each: each.at))
    return Scenario(
        numbers["mean"],
        numbers["gust"],
        numbers["noise"],
        numbers["dropped"],
        numbers["late"],
        numbers["skew"],
        happening,
    )


def _number(source: Source, table: Any, name: str, key: str, most: float, findings: list[Diagnostic]) -> float:
    if table is None:
        return 0.0
    if not isinstance(table, dict) or any(each not in NUMBERS[name] for each in table):
        known = ", ".join(f"`{each}`" for each in NUMBERS[name])
        finding = _wrong(source, _line(source, name), f"unknown key in `[{name}]`; use {known}")
        findings += [finding] if not findings or findings[-1].message != finding.message else []
        return 0.0
    value = table.get(key, 0.0)
    if not is_finite_number(value) or not 0 <= value <= most:
        findings.append(_wrong(source, _line(source, key), f"`{key}` must be a number from 0 to {most:g}"))
        return 0.0
    return float(value)


def _event(entry: Any, agents: tuple[str, ...]) -> Event | str:
    """Parse an entry of ``[[event]]``, or return its error in words.

    Args:
        entry: parsed TOML value.
        agents: names of the agents.
    """
    kinds = [kind for kind in KINDS if isinstance(entry, dict) and kind in entry]
    if len(kinds) != 1 or set(entry) - {"at", "to", *kinds}:
        return "an event needs `at` and one of `lose`, `slow` (with `to`) or `change`"
    at, to, what = entry.get("at"), entry.get("to", HALF), entry[kinds[0]]
    if not is_finite_number(at) or not 0 <= at <= LONGEST:
        return f"`at` of an event must be a time from 0 s to {LONGEST:g} s"
    if not isinstance(what, str) or not what:
        return f"`{kinds[0]}` of an event must be a text"
    if kinds[0] != "change" and what not in agents:
        return f"the mission has no agent `{what}`"
    if not (is_finite_number(to) and 0 < to <= 1) or ("to" in entry and kinds != ["slow"]):
        return "`to`, a fraction of the top speed, must be above 0 and at most 1"
    return Event(float(at), **{kinds[0]: what}, to=float(to) if kinds == ["slow"] else 1.0)


def _line(source: Source, word: str) -> int:
    """Line number of the first line that starts with a key, or 1 if there is none."""
    lines = source.text.split("\n")
    return next((number for number, line in enumerate(lines, 1) if line.lstrip(" [").startswith(word)), 1)


def _wrong(source: Source, line: int, message: str) -> Diagnostic:
    line = min(line, len(source.line_starts))
    start = source.line_starts[line - 1]
    span = Span(source, start, start + len(source.line(line)))
    return Diagnostic(SCENARIO_UNUSABLE, message, Label(span), help="see the full scenario in docs/fly.md")
