"""State of a search that ended without an answer: its stage, and the closest infeasible candidate."""

from __future__ import annotations

from missionc.backends.acceptance import attempt as come_to
from missionc.backends.api import Attempt
from missionc.backends.smt.lift import lift
from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.refine.problem import Problem
from missionc.base.trace import counted
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel

FEW = "planning a few agents at a time"
"""Description of the stage of prioritized planning."""


def under_way(mission: Mission, layer: str, planner: PrioritizedPlanner | None, problem: Problem | None) -> str:
    """Description of the stage at which the search ended, with its progress."""
    if problem is not None:
        search = problem.search
        least = f" (at least {counted(search.fewest, 'conflict')} between agents)" if search.fewest else ""
        rounds = f"round {search.rounds}" if search.rounds != 1 else "the first round"
        return f"{layer} {search.clauses.count} clauses for all agents, in {rounds}{least}"
    if layer == FEW and planner is not None:
        settled, agents = len(planner.reservations.agents), len(mission.agents)
        return f"{layer}, with {settled} of {agents} planned"
    return layer


def nearest(
    mission: Mission, kernel: Kernel, planner: PrioritizedPlanner | None, problem: Problem | None
) -> Attempt | None:
    """Candidate with the fewest violations, from prioritized planning or the SAT problem; None without candidates."""
    traces = [] if planner is None or planner.nearest is None else [planner.nearest]
    if problem is not None and problem.search.nearest is not None:
        traces.append(lift(problem.search.nearest, problem.motion.own_roadmaps, mission))
    attempts = [come_to(mission, kernel, trace) for trace in traces]
    return min(attempts, key=lambda each: each.wrong, default=None)
