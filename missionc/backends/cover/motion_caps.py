"""Motion caps: limits on an agent's speed or path length over the whole mission, derived from requirements.

    in   Mission, Kernel
    out  Caps

On a cover, each step may gain the size of a cell. Limits on the whole trajectory apply over many steps at once.
"""

from __future__ import annotations

import math
from dataclasses import replace

from missionc.base.late_dataclass import Record
from missionc.ir import Compare, Level, Mission, Speed
from missionc.ir.kernel.nodes import Atom, Kernel
from missionc.ir.kernel.walk import Conjunct, conjuncts


class Caps(Record, eq=False):
    """Limits on speeds and path lengths that the requirements imply.

    Args:
        mission: the mission with the speed limits that hold at all times.
        lengths: maximum path lengths of some agents, metres.
        causes: names of the requirements that imply the limits.
    """

    mission: Mission
    lengths: dict[int, float]
    causes: frozenset[str]


def motion_caps(mission: Mission, kernel: Kernel) -> Caps:
    """Limits from requirements on speeds, and on resources consumed along the path, that hold at all times."""
    speeds: dict[int, float] = {}
    lengths: dict[int, float] = {}
    causes: set[str] = set()
    for goal in kernel.requirements:
        for conjunct in conjuncts((goal.formula,)):
            agent = conjunct.agent
            if agent is None or not _lasts(conjunct, mission):
                continue
            match conjunct.formula:
                case Atom(Compare(((weight, Speed()),), constant)) if weight < 0:
                    causes.add(goal.name)
                    speeds[agent] = min(speeds.get(agent, math.inf), max(0.0, -constant / weight))
                case Atom(Compare(((weight, Level(resource)),), constant)) if weight > 0:
                    if resource.per_metre > 0 and not resource.refills and agent in resource.agents:
                        causes.add(goal.name)
                        left = max(0.0, resource.start + constant / weight) / resource.per_metre
                        lengths[agent] = min(lengths.get(agent, math.inf), left)
                case _:
                    pass
    agents = tuple(
        replace(each, dynamics=each.dynamics.at_most(speeds.get(each.index, math.inf), math.inf))
        for each in mission.agents
    )
    return Caps(replace(mission, agents=agents) if speeds else mission, lengths, frozenset(causes))


def _lasts(conjunct: Conjunct, mission: Mission) -> bool:
    """Return true if the conjunct must hold at every step."""
    steps = conjunct.steps
    return steps is not None and steps.start == 0 and (steps.stop is None or steps.stop > mission.steps)
