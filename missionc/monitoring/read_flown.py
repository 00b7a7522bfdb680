"""Reader of what was flown of a mission so far, from the text of a file.

    in   the text, as of a trace; the Mission; who is lost
    out  FlownSoFar: the states at the steps that are over, and where everybody was last

It ends where the first agent that is not lost was seen last. Logs of flights have holes: whoever is not seen for up to
``UNSEEN`` seconds went straight from where it was to where it is seen again. Who is lost is, from where it was seen
last, taken to stay there: of what it does nothing is asked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.trace import Array, Trace
from missionc.base.units import Steps
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.monitoring.read_trace import ON_TIME, State, assemble, mismatch, read_states

UNSEEN = 1.0
"""Seconds; who is not seen for longer is not known to have been anywhere."""


@dataclass(frozen=True, slots=True, eq=False)
class FlownSoFar:
    """What was flown.

    Args:
        trace: the states at the steps 0 to the last that is over.
        until: seconds, up to which it was flown.
        last: (agents, dim), metres: where everybody was then.
        seen: (agents,), seconds: when each was seen last, up to then.
    """

    trace: Trace
    until: float
    last: Array
    seen: Array


def read_flown(
    source: Source, mission: Mission, lost: Sequence[str], limits: Limits | None = None
) -> tuple[FlownSoFar | None, list[Diagnostic]]:
    """What a text says was flown, or everything that keeps it from saying so."""
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
        return None, [mismatch(over.span, f"the mission is over at {end:g} s: nothing of it is left to be planned")]
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
    """The samples of an agent up to a time; of one that is lost, its last one again and again until then."""
    kept = [state for state in samples if state.time <= until + step]
    if not lost or not kept:
        return kept
    begin, missing = kept[-1].time, until - kept[-1].time
    more = math.ceil(missing / step) if missing > ON_TIME else 0
    return kept + [replace(kept[-1], time=min(begin + step * number, until)) for number in range(1, more + 1)]


def _without_holes(samples: list[State], step: float) -> list[State]:
    """The samples, once for each time, with others on the straight line wherever they are more than a step apart."""
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
    """A state on the way from one to another; what only one of them says is left out."""
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
