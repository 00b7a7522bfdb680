"""Printer of horizons: the look-ahead of each requirement, as text.

in   Mission
out  text, the same for the same mission
"""

from __future__ import annotations

import math

from missionc.checks.check_horizons import steps_ahead
from missionc.ir import Mission
from missionc.language.walk_formulas import goals


def show_horizons(mission: Mission) -> str:
    """One line for each requirement and preference: its name, and the last step that can change its truth."""
    looks = steps_ahead(goal.formula for goal in goals(mission))
    rows = [(goal.name, looks[goal.formula].total) for goal in goals(mission)]
    width = max((len(name) for name, _ in rows), default=0)
    lines = [f"mission {mission.name}: {mission.steps} steps, {mission.horizon:g} s"]
    lines += [f"  {name:<{width}}  {_steps(total, mission)}" for name, total in rows]
    return "\n".join(lines) + "\n"


def _steps(total: float, mission: Mission) -> str:
    if math.isinf(total):
        return "without end"
    return f"{total:g} step{'' if total == 1 else 's'}, {total * mission.step:g} s"
