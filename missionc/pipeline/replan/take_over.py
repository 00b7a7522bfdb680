"""Motions near the plan that was flown: all who are left back onto it, or one of them in the place of one who is lost.

in   the mission that is left, the plan's positions in the steps that are left, who is left, where they are
out  Traces, the one that keeps most first; none of them need keep anything

A motion is back on the plan as soon as its agent can be, straight ahead; nothing else is looked at.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.base.trace import Array, Trace
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
    own = [_way(mission, index, plan.position[row], starts) for index, row in enumerate(left)]
    found = [_motion(plan, left, own)]
    for index, gone in _substitutes(plan, left, lost, starts):
        rows, ways = list(left), list(own)
        rows[index], ways[index] = gone, _way(mission, index, plan.position[gone], starts)
        found.append(_motion(plan, rows, ways))
    return sorted(found, key=lambda trace: _failing(mission, kernel, trace)) if len(found) > 1 else found


def _substitutes(plan: Trace, left: Sequence[int], lost: Sequence[int], starts: Array) -> list[tuple[int, int]]:
    """Who, of those that are left, may go the way of which lost one, the nearest first."""
    pairs = [(index, gone) for gone in lost for index in range(len(left))]
    pairs.sort(key=lambda pair: float(np.linalg.norm(starts[pair[0]] - plan.position[pair[1], 0])))
    return pairs[: MOST - 1]


def _way(mission: Mission, index: int, wanted: Array, starts: Array) -> Array:
    """(steps, dim): from where an agent is onto a way, (steps, dim), as fast as it goes, and on along it."""
    reach = mission.agents[index].dynamics.top_speed * float(mission.step)
    position = wanted.copy()
    position[0] = starts[index]
    for step in range(1, len(position)):
        way = wanted[step] - position[step - 1]
        far = float(np.linalg.norm(way))
        position[step] = position[step - 1] + way * min(1.0, reach / far if far else 1.0)
    return position


def _motion(plan: Trace, rows: Sequence[int], ways: Sequence[Array]) -> Trace:
    """Everybody on these ways, with the headings of the agents of the plan whose ways they are."""
    position = np.stack(ways)
    velocity = np.zeros_like(position)
    velocity[:, :-1] = np.diff(position, axis=1) / plan.step
    return Trace(plan.step, position, velocity, plan.heading[list(rows)])


def _failing(mission: Mission, kernel: Kernel, trace: Trace) -> tuple[int, float]:
    judged = monitor(mission, kernel, trace).requirements
    return sum(not each.satisfied for each in judged), -min((each.robustness for each in judged), default=0.0)
