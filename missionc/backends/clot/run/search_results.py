"""Search results of Algorithm 2: final joint trajectories, and the closest infeasible candidates."""

from __future__ import annotations

from missionc.backends.api import Attempt, Violation
from missionc.backends.clot.optimise.active_set import Choices
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.ir.kernel.walk import postorder


class Searched(Record, eq=False):
    """Result of a search: joint trajectories, each (agents, steps + 1, dim), metres, the cheapest first; possibly none.

    ``planned`` is the largest number of agents planned together, and ``margin`` the best margin of such a candidate,
    metres. ``iterations`` counts the local optimisations of complete rounds, ``found`` all joint trajectories.

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
        """Numbers of local iterations and joint trajectories, by name, for the report."""
        return {"local iterations": self.iterations, "joint motions": self.found}

    @property
    def rank(self) -> tuple[int, float]:
        """Sort key of the result; larger means more agents planned."""
        return self.planned, self.margin


def near(mission: Mission) -> float:
    """Shortfall up to which a candidate trajectory is optimised again, metres."""
    settings = clot_settings(mission).attempts
    furthest = max(agent.dynamics.top_speed for agent in mission.agents) * mission.step
    return max(settings.near, settings.near * furthest)


def freed(choices: Choices, graph: Kernel, come_to: Attempt) -> Choices:
    """Choices without those of violated requirements, so that their times and agents are chosen again."""
    names = {each.name for each in come_to.violated}
    free = set(postorder(wanted.formula for wanted in graph.requirements if wanted.name in names))
    return {key: chosen for key, chosen in choices.items() if key[0] not in free}


def failure_statement(best: Attempt | None, furthest: Searched | None, mission: Mission) -> str:
    """Text of the best candidate's violations; without a candidate, of the search's progress."""
    if best is None and furthest is not None:
        count, agents, margin = furthest.planned, len(mission.agents), furthest.margin
        return f"{count} of {agents} agents planned; the last agent lacks {-margin:.3g} m of margin"
    if best is None:
        return "the search completed no candidate plan"
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
