"""Guard of the comparison of options: for plans whose mission makes something least, or whose world moves.

Loads nothing that plans or draws: every compilation asks.
"""

from __future__ import annotations

from missionc.backends.api import Planned
from missionc.backends.offers import OFFERS
from missionc.ir import Mission, Objective
from missionc.lower.choose_backend import Choice


def weighs_options(mission: Mission, planned: Planned, choice: Choice) -> bool:
    """Whether the backend chose among options by an estimate, and the estimate is not what the mission asks for.

    A schedule estimates lengths, and its ways see nothing of obstacles that move.
    """
    offer = OFFERS.get(planned.report.engine or choice.backend)
    moving = any(not obstacle.constant for obstacle in mission.obstacles)
    asked = mission.objective is not Objective.NONE or moving
    return asked and offer is not None and not offer.weighs and planned.report.cut_short is None
