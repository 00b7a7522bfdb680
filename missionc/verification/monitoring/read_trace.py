"""Reader of traces, recorded or written by hand, and of the flight of a mission so far, from the text of a file.

    in   text of a plan (JSON) or of a table (CSV with ``agent,t,x,y[,z]``), the Mission, the lost agents
    out  Trace: every agent's state at every step; or FlownSoFar: the states at the past steps, and the last positions
    says MC704 MC705

Samples may be more frequent than the mission's steps, and lie between them; an agent moves straight between samples.
Velocities are read if given (``vx,vy[,vz]``), and otherwise follow from the positions, as does the heading (``yaw``) if
the mission does not require it.

A flight so far ends at the earliest last sample of an agent that is not lost. An agent without samples for up to
``UNSEEN`` seconds moved straight across the gap. A lost agent counts as staying at its last position, and has no
requirements.
"""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from missionc.base.diagnostics.code import TRACE_MISMATCH, TRACE_UNREADABLE
from missionc.base.diagnostics.map_error import MapError, too_many
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.base.source import Source, Span, line_ends
from missionc.base.strict_json import NotJsonError, parse_json
from missionc.base.trace import Array, Trace
from missionc.base.units import Steps, plain_number
from missionc.ir import Holds, Mission
from missionc.ir.language.walk_formulas import asked_agents

ON_TIME = 1e-6
"""Tolerance in seconds within which a sample counts as at a step."""

MOST_FINDINGS = 20
"""Maximum number of findings that are reported for a file."""


class State(Record):
    """State of one agent at one time, with its location in the text."""

    agent: str
    time: float
    numbers: dict[str, float]
    span: Span


def read_trace(source: Source, mission: Mission, limits: Limits | None = None) -> tuple[Trace | None, list[Diagnostic]]:
    """The trace that a text contains, or None and every error as a finding.

    Args:
        limits: limits on the samples, and on the ``magnitude`` of numbers.
    """
    states, findings = read_states(source, mission, limits)
    return (None, findings) if findings else assemble(source, mission, states)


def read_states(source: Source, mission: Mission, limits: Limits | None = None) -> tuple[list[State], list[Diagnostic]]:
    """Every agent's states that a text contains, or every error as a finding."""
    limits = limits or Limits()
    opening = source.text.lstrip()[:1]
    try:
        states, findings = _from_json(source, limits) if opening in ("{", "[") else _from_csv(source, mission, limits)
    except MapError as error:
        return [], [error.finding]
    findings += _too_large(states, limits.magnitude)
    return states, findings[:MOST_FINDINGS]


# ----------------------------------------------------------------- reading


def _from_csv(source: Source, mission: Mission, limits: Limits) -> tuple[list[State], list[Diagnostic]]:
    _allow_samples(source, line_ends(source.text.rstrip()), limits)
    lines = source.text.splitlines()
    try:
        rows = list(csv.reader(lines, skipinitialspace=True))
    except csv.Error as error:
        return [], [_unreadable(_first_line(source), f"the table cannot be read: {error}")]
    header = [word.strip() for word in rows[0]] if rows else []
    needed = ["agent", "t", *"xyz"[: mission.dimension]]
    missing = [name for name in needed if name not in header]
    if missing:
        names = ", ".join(f"`{name}`" for name in missing)
        return [], [_unreadable(_first_line(source), f"missing column {names} in the first line", _columns(needed))]
    states, findings = [], []
    for number, row in enumerate(rows[1:], start=2):
        if not row or row == [""]:
            continue
        span = _line(source, number)
        if len(row) != len(header):
            findings.append(
                _unreadable(span, f"the row has {len(row)} values, but the first line has {len(header)} columns")
            )
            continue
        words = {name: word for name, word in zip(header, row, strict=True) if name in _NUMBERS}
        numbers = {name: value for name, word in words.items() if (value := _number(word)) is not None}
        strange = [word for name, word in words.items() if name not in numbers and name in (*needed, *_MOTION)]
        if strange:
            findings.append(_unreadable(span, f"`{strange[0][:40]}` is not a finite number"))
        else:
            states.append(State(row[header.index("agent")].strip(), numbers["t"], numbers, span))
    return states, findings


_MOTION = ("vx", "vy", "vz", "yaw")
_NUMBERS = ("t", "x", "y", "z", *_MOTION)
"""Names of the numeric columns of a trace table."""


def _number(word: object) -> float | None:
    if isinstance(word, bool) or not isinstance(word, str | int | float):
        return None
    value = plain_number(word.strip()) if isinstance(word, str) else float(word)
    return value if math.isfinite(value) else None


def _allow_samples(source: Source, count: int, limits: Limits) -> None:
    """Check the number of samples of a file.

    Raises:
        MapError: the file has more samples than the limit.
    """
    if count > limits.trace_samples:
        raise too_many(source, "samples", "trace_samples", count, limits, Span(source, 0, 0))


def _from_json(source: Source, limits: Limits) -> tuple[list[State], list[Diagnostic]]:
    try:
        document = parse_json(source.text, limits.json_values, finite=False)
    except NotJsonError as error:
        place = Span(source, error.place, min(error.place + 1, len(source.text)))
        return [], [_unreadable(place, error.reason)]
    try:
        times, agents = _list(document["times"]), _list(document["agents"])
    except (KeyError, TypeError):
        return [], [_unreadable(_first_line(source), "the lists `times` and `agents` are missing", _PLAN)]
    _allow_samples(source, len(agents) * max(1, len(times)), limits)
    states: list[State] = []
    findings: list[Diagnostic] = []
    places = _name_places(source)
    for agent in agents:
        span = _named(source, agent, places)
        try:
            states += _agent_states(span, times, agent)
        except _StrangeError as strange:
            findings.append(_unreadable(span, strange.args[0], _PLAN))
    return states, findings


class _StrangeError(Exception):
    """Error: a plan has an invalid entry, which the text names."""


def _agent_states(span: Span, times: list[Any], agent: Any) -> list[State]:
    if not isinstance(agent, dict) or not isinstance(agent.get("name"), str):
        raise _StrangeError("an agent has no name")
    name = agent["name"]
    columns: dict[str, Any] = {key: agent.get(key) for key in ("position", "velocity", "yaw")}
    states = []
    for key, values in columns.items():
        if (values is None and key == "position") or not isinstance(values, list | None):
            raise _StrangeError(f"`{name}` has no list `{key}`")
        if values is not None and len(values) != len(times):
            raise _StrangeError(f"`{name}` has {len(values)} entries in `{key}`for {len(times)} times")
    for index, time in enumerate(times):
        numbers = _vector(name, "position", ("x", "y", "z"), columns["position"][index])
        if columns["velocity"] is not None:
            numbers |= _vector(name, "velocity", ("vx", "vy", "vz"), columns["velocity"][index])
        if columns["yaw"] is not None:
            numbers |= _vector(name, "yaw", ("yaw",), [columns["yaw"][index]])
        when = _number(time)
        if when is None:
            raise _StrangeError("a time is not a finite number")
        states.append(State(name, when, numbers, span))
    return states


def _vector(agent: str, key: str, axes: tuple[str, ...], value: Any) -> dict[str, float]:
    numbers = [_number(entry) for entry in value] if isinstance(value, list) else []
    finite = {axis: number for axis, number in zip(axes, numbers, strict=False) if number is not None}
    if not numbers or len(finite) != len(numbers):
        raise _StrangeError(f"`{agent}` has an entry in `{key}` without {len(axes)} finite numbers")
    return finite


def _too_large(states: list[State], magnitude: float) -> list[Diagnostic]:
    """Findings about numbers whose magnitude exceeds the limit, so that arithmetic could overflow doubles."""
    return [
        _unreadable(
            state.span,
            f"`{name}` of `{state.agent}` is {number:g} at {state.time:g} s; the limit is {magnitude:g}",
            "write positions in metres from a nearby origin",
        )
        for state in states
        for name, number in {"t": state.time, **state.numbers}.items()
        if abs(number) > magnitude
    ]


def _list(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise TypeError(value)
    return value


# ---------------------------------------------------------------- assembly


def assemble(source: Source, mission: Mission, states: list[State]) -> tuple[Trace | None, list[Diagnostic]]:
    """The trace of the states over the complete mission, or None and every error as a finding."""
    own: dict[str, list[State]] = {agent.name: [] for agent in mission.agents}
    strangers: dict[str, State] = {}
    for state in states:
        if state.agent in own:
            own[state.agent].append(state)
        else:
            strangers.setdefault(state.agent, state)
    findings = [mismatch(first.span, f"the mission has no agent `{name}`") for name, first in strangers.items()]
    for name, samples in own.items():
        samples.sort(key=lambda state: state.time)
        findings += _misfits(source, mission, name, samples)
    if not findings:
        findings += _unknown_headings(mission, own)
    if findings:
        return None, findings[:MOST_FINDINGS]
    return _trace(mission, list(own.values())), []


def _unknown_headings(mission: Mission, own: dict[str, list[State]]) -> list[Diagnostic]:
    """Finding about the first agent whose heading the mission uses and the samples lack; empty if there is none."""
    for formula, agents in asked_agents(mission):
        if isinstance(formula, Holds) and formula.predicate.reads_heading:
            for agent in agents:
                name = mission.agents[agent].name
                bare = next((state for state in own[name] if "yaw" not in state.numbers), None)
                if bare is not None:
                    message = f"missing `yaw` of `{name}`: the mission uses its heading"
                    return [mismatch(bare.span, message, "add `yaw` at each time, in rad")]
    return []


def _misfits(source: Source, mission: Mission, name: str, samples: list[State]) -> list[Diagnostic]:
    """Findings about an agent's samples, in order of time, that do not cover the complete mission."""
    if not samples:
        return [mismatch(_first_line(source), f"no samples of `{name}`", _times(mission))]
    axes = "xyz"[: mission.dimension]
    for state in samples:
        if any(axis not in state.numbers for axis in axes):
            message = f"`{name}` has a position without {' and '.join(axes)}; the world has {len(axes)} coordinates"
            return [mismatch(state.span, message)]
    last = mission.step * mission.steps
    if samples[0].time > ON_TIME:
        message = f"`{name}` has its first sample at {samples[0].time:g} s; the mission begins at 0 s"
        return [mismatch(samples[0].span, message, _times(mission))]
    if samples[-1].time < last - ON_TIME:
        message = f"`{name}` has its last sample at {samples[-1].time:g} s; the mission lasts {last:g} s"
        return [mismatch(samples[-1].span, message, _times(mission))]
    for before, after in pairwise(samples):
        if after.time - before.time <= ON_TIME / 2:
            return [mismatch(after.span, f"`{name}` has two positions at {after.time:g} s", _times(mission))]
        if after.time - before.time > mission.step + ON_TIME:
            message = f"`{name}` has no samples from {before.time:g} s to {after.time:g} s, longer than a step"
            return [mismatch(after.span, message, _times(mission))]
    return []


def _trace(mission: Mission, own: list[list[State]]) -> Trace:
    steps: Array = mission.step * np.arange(mission.steps + 1, dtype=np.float64)

    def gathered(names: tuple[str, ...]) -> Array | None:
        if not all(name in state.numbers for samples in own for state in samples for name in names):
            return None
        return np.stack([[_at_steps(samples, name, steps, mission.step) for name in names] for samples in own])

    position = gathered(tuple("xyz"[: mission.dimension]))
    assert position is not None
    position = np.swapaxes(position, 1, 2)
    speeds, yaw = gathered(("vx", "vy", "vz")[: mission.dimension]), gathered(("yaw",))
    velocity = _velocities(mission, position) if speeds is None else np.swapaxes(speeds, 1, 2)
    heading = _headings(velocity) if yaw is None else yaw[:, 0]
    derived = tuple(name for name, read in (("velocity", speeds), ("heading", yaw)) if read is None)
    return Trace(mission.step, position, velocity, heading, derived=derived)


def _at_steps(samples: list[State], name: str, steps: Array, step: float) -> Array:
    """Values of one number (such as ``x``) at the mission's steps, (steps,), in its unit.

    A value is exact for a sample at the step, and otherwise interpolated.

    Args:
        steps: times of the steps, (steps,), seconds.
        step: duration of a step, seconds.
    """
    times = np.array([state.time for state in samples])
    near = np.rint(times / step) * step
    times = np.where(np.abs(times - near) <= ON_TIME, near, times)
    values = np.array([state.numbers[name] for state in samples])
    if name == "yaw":
        # A heading is constant until the next one: the middle of 359 and 1 degrees is not 180.
        return np.asarray(values[np.searchsorted(times, steps, side="right") - 1])
    return np.asarray(np.interp(steps, times, values))


def _velocities(mission: Mission, position: Array) -> Array:
    """Velocities from positions: (agents, steps + 1, dim), m/s.

    The velocity at a step is that of the motion that starts there; for second-order agents, it is the mean of the two
    adjacent motions.
    """
    if position.shape[1] == 1:
        return np.zeros_like(position)
    velocity = np.diff(position, axis=1) / mission.step
    first_order = np.concatenate([velocity, velocity[:, -1:]], axis=1)
    second_order = np.gradient(position, mission.step, axis=1)
    second = np.array([agent.dynamics.has_momentum for agent in mission.agents])
    return np.asarray(np.where(second[:, None, None], second_order, first_order))


def _headings(velocity: Array) -> Array:
    """Headings in the direction of motion, (agents, steps + 1), rad.

    At rest, the previous heading or else the first.
    """
    moving = np.linalg.norm(velocity[..., :2], axis=-1) > 1e-9
    heading = np.arctan2(velocity[..., 1], velocity[..., 0])
    steps = np.arange(moving.shape[1])
    last = np.maximum.accumulate(np.where(moving, steps, -1), axis=1)
    source = np.where(last >= 0, last, moving.argmax(axis=1)[:, None])
    return np.asarray(np.take_along_axis(np.where(moving, heading, 0.0), source, axis=1))


# ------------------------------------------------------------------ messages

_PLAN = "write `times` and `agents`, each with `name` and `position`, as in `plan.json`"


def _columns(needed: list[str]) -> str:
    return f"begin the file with the header `{','.join(needed)}`"


def _times(mission: Mission) -> str:
    return f"add positions at least every {mission.step:g} s, from 0 s to {mission.step * mission.steps:g} s"


def _unreadable(span: Span, message: str, help: str = "") -> Diagnostic:
    return Diagnostic(TRACE_UNREADABLE, message, Label(span), help=help)


def mismatch(span: Span, message: str, help: str = "") -> Diagnostic:
    """Finding about a trace that does not fit the mission."""
    return Diagnostic(TRACE_MISMATCH, message, Label(span), help=help)


def _first_line(source: Source) -> Span:
    return _line(source, 1)


def _line(source: Source, number: int) -> Span:
    number = min(number, len(source.line_starts))
    start = source.line_starts[number - 1]
    return Span(source, start, start + len(source.line(number)))


def _name_places(source: Source) -> dict[str, tuple[int, int]]:
    """Start and end offset of the first occurrence of each quoted name in a plan."""
    return {found[1]: found.span(1) for found in reversed(list(_NAME.finditer(source.text)))}


_NAME = re.compile(r'"name"\s*:\s*("(?:[^"\\]|\\.)*")')


def _named(source: Source, agent: Any, places: dict[str, tuple[int, int]]) -> Span:
    """Source span of the agent's name in a plan."""
    place = places.get(json.dumps(agent.get("name"))) if isinstance(agent, dict) else None
    return Span(source, *place) if place else _first_line(source)


UNSEEN = 1.0
"""Longest time without samples, seconds, after which an agent's position is still interpolated."""


class FlownSoFar(Record, eq=False):
    """The flight of a mission so far.

    Args:
        trace: states at the steps from 0 to the last completed step.
        until: end of the flight so far, seconds.
        last: (agents, dim), metres: positions then.
        seen: (agents,), seconds: time of each agent's last sample up to then.
    """

    trace: Trace
    until: float
    last: Array
    seen: Array


def read_flown(
    source: Source, mission: Mission, lost: Sequence[str], limits: Limits | None = None
) -> tuple[FlownSoFar | None, list[Diagnostic]]:
    """The flight so far that a text contains, or None and every error as a finding.

    Args:
        lost: names of the lost agents.
    """
    states, findings = read_states(source, mission, limits)
    if findings:
        return None, findings
    own: dict[str, list[State]] = {agent.name: [] for agent in mission.agents}
    for state in states:
        own.setdefault(state.agent, []).append(state)
    for samples in own.values():
        samples.sort(key=lambda state: state.time)
    ends = [samples[-1].time for name, samples in own.items() if samples and name not in lost]
    end = mission.step * mission.steps
    until = min([*ends, end])
    if ends and until >= end - ON_TIME:
        over = next(samples[-1] for name, samples in own.items() if samples and name not in lost)
        return None, [mismatch(over.span, f"the mission ended at {end:g} s; no time is left to plan")]
    kept = [
        _without_holes(_until(samples, until, name in lost, mission.step), mission.step)
        for name, samples in own.items()
    ]
    steps = math.floor(until / mission.step + ON_TIME)
    so_far = replace(mission, steps=Steps(max(steps, 0)))
    trace, findings = assemble(source, so_far, [state for samples in kept for state in samples])
    if trace is None:
        return None, findings
    axes = "xyz"[: mission.dimension]
    last = np.array([[_at(samples, axis, until) for axis in axes] for samples in kept[: len(mission.agents)]])
    seen = np.array([min(own[agent.name][-1].time, until) for agent in mission.agents])
    return FlownSoFar(trace, until, last, seen), []


def _until(samples: list[State], until: float, lost: bool, step: float) -> list[State]:
    """Samples of an agent up to a time; for a lost agent, its last sample is repeated until then.

    Args:
        step: duration of a step, seconds.
    """
    kept = [state for state in samples if state.time <= until + step]
    if not lost or not kept:
        return kept
    begin, missing = kept[-1].time, until - kept[-1].time
    more = math.ceil(missing / step) if missing > ON_TIME else 0
    return kept + [replace(kept[-1], time=min(begin + step * number, until)) for number in range(1, more + 1)]


def _without_holes(samples: list[State], step: float) -> list[State]:
    """Samples with one per time, and with interpolated samples in gaps of more than a step."""
    if not samples:
        return []
    first = samples[0]
    filled = [replace(first, time=0.0)] if ON_TIME < first.time <= UNSEEN else []
    for state in samples:
        before = filled[-1] if filled else None
        if before is not None and state.time - before.time <= ON_TIME:
            continue
        if before is not None and step < state.time - before.time <= UNSEEN:
            missing = math.ceil((state.time - before.time) / step - ON_TIME) - 1
            filled += [_between(before, state, number / (missing + 1)) for number in range(1, missing + 1)]
        filled.append(state)
    return filled


def _between(before: State, after: State, share: float) -> State:
    """State interpolated between two others; a value that only one of them has is left out."""
    numbers = {
        name: value + share * (after.numbers[name] - value)
        for name, value in before.numbers.items()
        if name in after.numbers and name != "yaw"
    }
    if "yaw" in before.numbers and "yaw" in after.numbers:
        numbers["yaw"] = before.numbers["yaw"]
    return replace(before, time=before.time + share * (after.time - before.time), numbers=numbers)


def _at(samples: list[State], axis: str, time: float) -> float:
    return float(np.interp(time, [state.time for state in samples], [state.numbers[axis] for state in samples]))
