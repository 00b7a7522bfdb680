"""Receding horizon: a joint problem of the first steps only, after which each agent continues alone.

    in   roadmaps, possible states of each agent, and the last step with joint conditions
    out  the same for those steps; then each agent's whole path, beginning with the result

Without joint conditions after a step, the solver does not need the later steps. At the last of its steps, an agent may
be in any state from which it can still reach its goals in time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from missionc.backends.smt.prioritized.reservations import Reservations
from missionc.backends.smt.prioritized.single_agent_planning import SingleAgentPlanning
from missionc.backends.smt.prioritized.single_agent_search import SingleAgentSearch
from missionc.backends.smt.refine.problem import Setting
from missionc.backends.smt.roadmap.roadmap import Roadmap
from missionc.base.trace import Flags, Indices
from missionc.base.units import Steps
from missionc.ir import Mission
from missionc.ir.kernel.analysis import steps_ahead
from missionc.ir.kernel.nodes import Node


def last_asked(formulas: Sequence[Node], mission: Mission) -> int:
    """Last step that matters for joint formulas at step 0; the mission's last step if the last step is not much
    later."""
    shorter = 2  # least ratio of the mission's steps to those of a part planned alone
    ahead = steps_ahead(formulas, mission.steps)
    last = max((ahead[formula] for formula in formulas), default=0) + 1
    return last if shorter * last <= mission.steps else mission.steps


def first_steps(
    setting: Setting, roadmaps: tuple[Roadmap, ...], ways: Sequence[Flags], last: int
) -> tuple[Setting, tuple[Roadmap, ...], tuple[Flags, ...]]:
    """Setting, roadmaps and possible states, (steps + 1, states) each, truncated after the step ``last``; unchanged for
    the mission's last step."""
    if last == setting.mission.steps:
        return setting, roadmaps, tuple(ways)
    mission = replace(setting.mission, steps=Steps(last))
    shorter = tuple(
        replace(
            roadmap,
            standing=roadmap.standing[: last + 1],
            allowed=roadmap.allowed[:last],
            finishes=tuple(np.flatnonzero(ways[agent][last]) for agent in roadmap.agents),
        )
        for roadmap in roadmaps
    )
    return replace(setting, mission=mission), shorter, tuple(way[: last + 1] for way in ways)


def continued(
    planning: SingleAgentPlanning, reservations: Reservations, agents: Sequence[int], begun: Indices
) -> Indices | None:
    """Whole paths of agents, states (agents of the mission, steps + 1), planned one by one; None if an agent has none.

    Args:
        reservations: reservations of all others.
        begun: first steps of the paths, (agents of the mission, some steps).
    """
    whole, limit = reservations.copy(), planning.setting.budget.limits.clauses
    never, exclusions = dict(planning.requirements.never), planning.requirements.exclusions
    steps = np.arange(begun.shape[1])
    for agent in agents:
        elsewhere = np.zeros_like(whole.motion.roadmap(agent).standing)
        elsewhere[steps] = True
        elsewhere[steps, begun[agent]] = False
        never[agent] = elsewhere | never[agent] if agent in never else elsewhere
    search = SingleAgentSearch(planning.order.labels, never, whole, limit, exclusions=exclusions)
    with planning.counted(search):
        for agent in agents:
            way = search.way(agent, (), whole)
            if way is None:
                return None
            whole.reserve((agent,), np.broadcast_to(way, whole.states.shape))
    return np.asarray(whole.states)
