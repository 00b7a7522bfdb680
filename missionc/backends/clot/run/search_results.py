"""Search results: the joint motions that a search ends with, and the closest infeasible candidates."""

from __future__ import annotations

from dataclasses import dataclass

from missionc.backends.api import Attempt, Violation
from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.kernel.walk import postorder


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """Joint motions, each (agents, steps + 1, dim), metres, the cheapest first; none where none was found.

    ``planned`` is how many agents were planned at once at most, and ``margin``
    by how much the best candidate with so many holds, metres. ``iterations``
    are local optimisations of whole rounds, ``found`` is how many joint
    motions there were to choose from.

    Source:
        [clot] V-A.2, which reports both numbers.
    """

    motions: tuple[Array, ...]
    planned: int
    margin: float
    iterations: int = 0
    found: int = 0

    @property
    def sizes(self) -> dict[str, int]:
        """What a report says of the search."""
        return {"local iterations": self.iterations, "joint motions": self.found}

    @property
    def rank(self) -> tuple[int, float]:
        """The more, the further it came."""
        return self.planned, self.margin


def near(mission: Mission) -> float:
    """By how much a motion may fall short to be worth another polish, metres."""
    settings = clot_settings(mission).attempts
    furthest = max(agent.dynamics.top_speed for agent in mission.agents) * mission.step
    return max(settings.near, settings.near * furthest)


def freed(choices: Choices, graph: Kernel, come_to: Attempt) -> Choices:
    """The choices without those of requirements that a motion violates: their times and agents are chosen again."""
    names = {each.name for each in come_to.violated}
    free = set(postorder(wanted.formula for wanted in graph.requirements if wanted.name in names))
    return {key: chosen for key, chosen in choices.items() if key[0] not in free}


def failure_statement(best: Attempt | None, furthest: Searched | None, mission: Mission) -> str:
    """Where the best candidate fails; how far a search came, where there is none."""
    if best is None and furthest is not None:
        count, agents, margin = furthest.planned, len(mission.agents), furthest.margin
        return f"{count} of {agents} agents planned; the last one lacks a margin of {-margin:.3g} m"
    if best is None:
        return "no candidate plan was finished"
    wrong = [
        *(
            Violation(f"`{each.name}`", each.agents, each.step or 0, each.robustness, each.unit)
            for each in best.violated
        ),
        *best.worst_faults(),
    ]
    return f"the best candidate violates {'; '.join(_text(fault, mission) for fault in wrong)}"


def _text(fault: Violation, mission: Mission) -> str:
    who = " and ".join(fault.agents[:2])
    by = f" by {fault.short}" if fault.short else ""
    return f"{fault.what}{f' of {who}' if who else ''} at {fault.step * mission.step:g} s{by}"
