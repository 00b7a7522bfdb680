"""Tightening of a mission by its tolerated delays, so that a delayed agent still satisfies it.

    in   Mission, Kernel
    out  a Kernel with earlier deadlines, a Mission with more clearance between agents and from changing obstacles

At step 0, an *eventually* window ends earlier and an *always* window begins earlier. An agent with a finish region
arrives earlier. A formula about one agent's trajectory then also holds with the delay. A delayed agent deviates from
its plan by at most the distance that it travels in that time, so the separations grow by this distance. ``verify``
checks the result.
"""

from __future__ import annotations

from dataclasses import replace

from missionc.base.units import Metres
from missionc.ir import Inside, Mission
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import bottom_up, rebuilt
from missionc.ir.lower.tighten import moved


def ahead_of_time(mission: Mission, kernel: k.Kernel) -> k.Kernel:
    """Kernel in which the goals of agents that may be delayed are due earlier, by the largest tolerated delay."""
    delay = max((tolerance.steps for tolerance in mission.tolerances), default=0)
    late = {agent for tolerance in mission.tolerances for agent in tolerance.agents}

    def early(node: k.Node, below: tuple[k.Node, ...]) -> k.Node:
        match node:
            case k.At(agent) if agent not in late:
                return node
            case k.All() | k.Any() | k.AtLeast() | k.At():
                return rebuilt(node, below)
            case k.Eventually(low=low, high=high) | k.Until(low=low, high=high):
                last = mission.steps if high is None else high
                return replace(node, high=max(low, last - delay))
            case k.Always(low=low) | k.Release(low=low):
                return replace(node, low=max(0, low - delay))
            case _:
                return node

    nodes = bottom_up((goal.formula for goal in kernel.requirements), early)
    goals = [replace(goal, formula=nodes[goal.formula]) for goal in kernel.requirements]
    return replace(kernel, requirements=(*goals, *_finishes(mission)))


def with_room_for_delays(mission: Mission, share: float) -> Mission:
    """Mission with separations and clearances from changing obstacles increased by ``share`` times the distance that an
    agent travels during a tolerated delay."""
    most = max(
        (
            mission.agents[agent].dynamics.top_speed * mission.step * tolerance.steps
            for tolerance in mission.tolerances
            for agent in tolerance.agents
        ),
        default=0.0,
    )
    obstacles = tuple(
        each if each.constant else replace(each, shape=moved(each.shape, share * most)) for each in mission.obstacles
    )
    return replace(mission, separation=Metres(mission.separation + share * most), obstacles=obstacles)


def _finishes(mission: Mission) -> list[k.Goal]:
    """Goals that each agent that may be delayed arrives in its finish region early, by the tolerated delay."""
    goals = []
    for tolerance in mission.tolerances:
        for agent in tolerance.agents:
            place = mission.agents[agent].finish
            if place is not None and place.region is not None:
                there = k.Atom(Inside(place.region, False), place.span)
                stays = k.Always(there, mission.steps - tolerance.steps, mission.steps, place.span)
                goals.append(k.Goal("finish", k.At(agent, stays, place.span), place.span))
    return goals
