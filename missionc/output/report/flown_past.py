"""The past of a mission for the report of its rest: paths flown before the plan begins, and its start time.

in   Mission, the text of ``past.json``
out  a dict that JSON can hold, or None if the text contains no past

The text is shown without a check; ``verify`` checks whether it is a past of the mission.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from missionc.base.limits import Limits
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.planning.progression.past_document import Flown, Past, read_past

FARTHEST = Limits().magnitude
"""Maximum plausible magnitude of a coordinate, metres."""
CLOSE = 1e-9


def flown_past(mission: Mission, text: str) -> dict[str, Any] | None:
    """Start time of the plan in seconds, phases of the flight until then, and path of each agent; None without a past.

    Times count from the beginning of the flight. A path has an agent's name and the number of its flown steps; later
    steps were commanded only.
    """
    past = read_past(text, FARTHEST) if text else ""
    if isinstance(past, str) or any(each.stretch.trace.position.shape[2] != mission.dimension for each in past.flown):
        return None
    begins = _seconds(past.flown)
    end = begins + float(mission.horizon)
    return {
        "begins": begins,
        "phases": [*_phases(past), {"phase": "plan", "begin": begins, "end": end}],
        "lost": list(dict.fromkeys(name for each in past.flown for name in each.stretch.lost)),
        "given_up": list(dict.fromkeys(name for each in past.flown for name in each.stretch.given_up)),
        "ways": [way for each in past.flown for way in _ways(each)],
    }


def _seconds(flown: tuple[Flown, ...]) -> float:
    return round(sum(each.stretch.steps * float(each.stretch.trace.step) for each in flown), 9)


def _phases(past: Past) -> list[dict[str, Any]]:
    """Phases of the past, alternating: flown parts, and commands until the next plan began."""
    phases: list[dict[str, Any]] = []
    for number, each in enumerate(past.flown):
        begin, end = _seconds(past.flown[:number]), _seconds(past.flown[: number + 1])
        told = min(begin + each.until, end)
        for phase, low, high in (("flown", begin, told), ("told", told, end)):
            if high - low <= CLOSE:
                continue
            if phases and phases[-1]["phase"] == phase:
                phases[-1]["end"] = round(high, 9)
            else:
                phases.append({"phase": phase, "begin": low, "end": round(high, 9)})
    return phases


def _ways(flown: Flown) -> Iterator[dict[str, Any]]:
    trace = flown.stretch.trace
    steps = int(np.floor(flown.until / float(trace.step) + CLOSE)) + 1
    for name, way in zip(flown.agents, trace.position, strict=True):
        yield {"agent": name, "flown": min(steps, len(way)), "places": _places(way)}


def _places(way: Array) -> list[list[float]]:
    return [[round(value, 3) + 0.0 for value in place] for place in way.tolist()]
