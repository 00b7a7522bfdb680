"""Quality of a plan: the preferences that it keeps, the margin, and what is to be least."""

from __future__ import annotations

from typing import TypeAlias

from missionc.backends.api import Planned
from missionc.base.trace import Trace
from missionc.ir import Mission, Objective
from missionc.kernel.nodes import Kernel
from missionc.monitoring.monitor import monitor

Quality: TypeAlias = tuple[tuple[bool, ...], float, float]


def quality(mission: Mission, kernel: Kernel, planned: Planned) -> Quality:
    """The less the better: preferences that are not kept, the heaviest first; then the share of the margin that is not;
    then ``objective_value``."""
    kept = {each.name: each.satisfied for each in monitor(mission, kernel, planned.trace).preferences}
    wishes = sorted(kernel.preferences, key=lambda each: -(each.weight or 0.0))
    unkept = tuple(not kept[each.name] for each in wishes)
    return unkept, 1.0 - planned.report.kept, objective_value(mission.objective, planned.trace)


def objective_value(objective: Objective, trace: Trace) -> float:
    """What a mission makes least of; metres, where nothing is asked to be least."""
    match objective:
        case Objective.DURATION:
            return float(trace.lasts)
        case Objective.ENERGY:
            return trace.effort
        case _:
            return trace.metres


UNITS = {Objective.DURATION: "steps", Objective.ENERGY: "m^2/s^3"}


def amount(objective: Objective, trace: Trace) -> str:
    """The same in words."""
    return f"{objective_value(objective, trace):.6g} {UNITS.get(objective, 'm')}"
