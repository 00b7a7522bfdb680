"""Shorter ways of a joint motion that was planned agent by agent, and the least that each needs by itself."""

from __future__ import annotations

from missionc.backends.smt.prioritized.prioritized_planning import PrioritizedPlanner
from missionc.backends.smt.prioritized.progression import TooComplex
from missionc.backends.smt.roadmap.roadmap import Indices
from missionc.backends.smt.settings import smt_settings


def shorter(planner: PrioritizedPlanner, states: Indices) -> Indices:
    """The motion after who was planned alone has been planned again, one by one, by metres alone."""
    settings = smt_settings(planner.setting.mission).prioritized
    gain = 1e-6  # metres that a new path saves at least
    reservations = planner.reservations.emptied()
    everyone = sorted(planner.everyone)
    reservations.reserve(everyone, states)
    search = planner.search(haste=0.0)
    for number, agent in ((number, agent) for number in range(settings.shorter_rounds) for agent in everyone):
        if number and search.work > settings.shorter_work:
            break
        named = [part for part in planner.requirements.parts if agent in part.named]
        if any(len(part.named) > 1 for part in named) or search.work > planner.enough:
            continue
        reservations.release((agent,))
        changed = reservations.states.copy()
        metres = search.metres(agent, changed[agent])
        way = search.way(agent, planner.own_parts(agent), reservations, most=metres)
        if way is not None and search.metres(agent, way) < metres - gain:
            changed[agent] = way
        reservations.reserve((agent,), changed)
    better = reservations.states
    return better if planner.failing(planner.trace(better)) is None else states


def metres_alone(planner: PrioritizedPlanner) -> float | None:
    """The least that all agents have to travel together, each as if it were the only one, if that is known."""
    metres = 0.0
    search = planner.search(haste=0.0)
    for agent in sorted(planner.everyone):
        try:
            way = search.alone(agent, planner.own_parts(agent))
        except TooComplex:
            return None
        if way is None:
            return None
        metres += search.metres(agent, way)
    return metres


def path_length(planner: PrioritizedPlanner, states: Indices) -> float:
    """The metres of a joint motion, (agents, steps + 1)."""
    return sum(planner.single_agent.metres(agent, way) for agent, way in enumerate(states))
