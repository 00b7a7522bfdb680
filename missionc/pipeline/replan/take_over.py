"""Motions near the plan that was flown: all who are left back onto it, or one of them in the place of one who is lost.

in   the mission that is left, the plan's positions in the steps that are left, who is left, where they are
out  Traces, the one that keeps most first; none of them need keep anything

A motion is back on the plan as soon as its agent can be, straight ahead; nothing else is looked at.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.base.units import Seconds
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.monitoring.monitor import monitor

MOST = 60
"""Motions that are compared."""


def near_motions(
    mission: Mission, kernel: Kernel, plan: Trace, left: Sequence[int], lost: Sequence[int], starts: Array
) -> list[Trace]:
    """The motions, those first of which fewer requirements fail, and then the ones whose worst fails by less.

    Args:
        plan: of all agents of the plan that was flown, lost ones too, in the steps that are left.
        left, lost: their indices.
        starts: (agents that are left, dim), metres.
    """
    found = [_back_on(mission, plan, rows, starts) for rows in _roles(plan, left, lost, starts)]
    return sorted(found, key=lambda trace: _failing(mission, kernel, trace)) if len(found) > 1 else found


def _roles(plan: Trace, left: Sequence[int], lost: Sequence[int], starts: Array) -> Iterator[list[int]]:
    """Whose way each agent goes that is left: its own, and by turns that of a lost one, the nearest first."""
    yield list(left)
    pairs = [(number, gone) for gone in lost for number in range(len(left))]
    pairs.sort(key=lambda pair: float(np.linalg.norm(starts[pair[0]] - plan.position[pair[1], 0])))
    for number, gone in pairs[: MOST - 1]:
        rows = list(left)
        rows[number] = gone
        yield rows


def _back_on(mission: Mission, plan: Trace, rows: Sequence[int], starts: Array) -> Trace:
    """From where everybody is onto the ways of ``rows``, as fast as agents go, and on along them."""
    wanted = plan.position[list(rows)]
    position = wanted.copy()
    position[:, 0] = starts
    for index, agent in enumerate(mission.agents):
        reach = agent.dynamics.top_speed * float(mission.step)
        for step in range(1, position.shape[1]):
            way = wanted[index, step] - position[index, step - 1]
            far = float(np.linalg.norm(way))
            position[index, step] = position[index, step - 1] + way * min(1.0, reach / far if far else 1.0)
    velocity = np.zeros_like(position)
    velocity[:, :-1] = np.diff(position, axis=1) / mission.step
    return Trace(Seconds(mission.step), position, velocity, plan.heading[list(rows)])


def _failing(mission: Mission, kernel: Kernel, trace: Trace) -> tuple[int, float]:
    judged = monitor(mission, kernel, trace).requirements
    return sum(not each.satisfied for each in judged), -min((each.robustness for each in judged), default=0.0)
