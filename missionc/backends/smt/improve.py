"""From a plan to a better one, while there is time: preferences by weight, then what is to be least."""

from __future__ import annotations

import time

from missionc.backends.api import Progress
from missionc.backends.smt.distance import shorten_distance
from missionc.backends.smt.duration import shorten_duration
from missionc.backends.smt.search import Found, Search
from missionc.backends.smt.solve import Stopped, Unsatisfiable
from missionc.ir import Mission, Objective
from missionc.kernel.nodes import Kernel

PATIENCE = 60.0
"""Seconds for each preference and for the objective, if the time limit leaves them."""


def improve(found: Found, mission: Mission, kernel: Kernel, literals: tuple[int, ...], search: Search) -> Found:
    """The same plan or one that is better; what was and was not reached is noted.

    Args:
        literals: what asks for each requirement, then for each preference.
    """
    kept = literals[: len(kernel.requirements)]
    wishes = zip(kernel.preferences, literals[len(kept) :], strict=True)
    for goal, literal in sorted(wishes, key=lambda wish: -(wish[0].weight or 0.0)):
        search.listen(Progress("prefer", search.rounds, f"`{goal.name}`"))
        result = search.find((*kept, literal), time.monotonic() + PATIENCE)
        match result:
            case Found():
                found, kept = result, (*kept, literal)
                search.account.notes.append(f"`{goal.name}` is kept")
            case Unsatisfiable():
                search.account.notes.append(f"`{goal.name}` is not kept: no plan on this roadmap keeps it too")
            case Stopped():
                search.account.notes.append(f"`{goal.name}` is not kept: the search ended first")
                return found
    match mission.objective:
        case Objective.DURATION:
            return shorten_duration(found, kept, search)
        case Objective.DISTANCE:
            return shorten_distance(found, kept, search)
        case _:
            return found
