"""Motion of a recording in continuous time: straight from sample to sample, also from those between the steps.

in   Mission, the Trace of a recording, its samples
out  Curves
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from missionc.base.trace import Trace
from missionc.curves.piecewise_polynomials import Curves, motion
from missionc.ir import Mission
from missionc.monitoring.read_trace import ON_TIME, State


def recorded_motion(mission: Mission, trace: Trace, states: Iterable[State]) -> Curves:
    """The motion that samples show.

    With recorded velocities and samples at the steps alone, as in a plan, it is that of the dynamics (``motion``).

    Args:
        trace: the states at the steps, which the motion passes through.
        states: all samples, of every agent from the first to the last step.
    """
    last = float(mission.step * mission.steps)
    own: dict[str, list[State]] = {agent.name: [] for agent in mission.agents}
    for state in sorted(states, key=lambda state: state.time):
        own[state.agent].append(state)
    steps = mission.step * np.arange(mission.steps + 1)
    seen = np.unique([state.time for samples in own.values() for state in samples])
    between = seen[(seen > 0) & (seen < last)]
    between = between[np.abs(between - steps[np.rint(between / mission.step).astype(int)]) > ON_TIME]
    recorded = "velocity" not in trace.derived
    if mission.steps == 0 or (recorded and not between.size):
        return motion(mission, trace)
    apart = np.diff(between, prepend=-np.inf) > ON_TIME
    moments = np.sort(np.concatenate([steps, between[apart]]))
    places = np.stack([_places(samples, moments, "xyz"[: mission.dimension]) for samples in own.values()])
    places[:, np.searchsorted(moments, steps)] = trace.position
    slopes = np.diff(places, axis=1) / np.diff(moments)[:, None]
    return Curves(moments, np.stack([places[:, :-1], slopes], axis=-1))


def _places(samples: list[State], moments: np.ndarray, axes: str) -> np.ndarray:
    """Positions of an agent, (moments, dim), metres."""
    times = [state.time for state in samples]
    return np.stack([np.interp(moments, times, [state.numbers[axis] for state in samples]) for axis in axes], axis=-1)
