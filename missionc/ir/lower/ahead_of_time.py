"""Tightening of a mission by the delays that it tolerates, so that whoever is late still keeps what is asked.

    in   Mission, Kernel
    out  a Kernel that is done earlier, a Mission with more room between agents and beside what moves or grows

A window that is asked at step 0 loses its end where something has to come within it, and begins earlier where something
has to last throughout it; whoever has a region to finish in is there earlier. An agent whose motion alone such a
formula is about keeps it with the delay too. One that is late is no further from where it would be than it goes in that
time: bodies that are so much further apart keep their distances. What comes of it is judged by ``verify``.
"""

from __future__ import annotations

from dataclasses import replace

from missionc.base.units import Metres
from missionc.ir import Inside, Mission
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import bottom_up, rebuilt
from missionc.ir.lower.tighten import moved


def ahead_of_time(mission: Mission, kernel: k.Kernel) -> k.Kernel:
    """The kernel with all that is asked of agents who may be late early by the longest delay that is tolerated."""
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
    """The mission with bodies further apart, and from obstacles that change, by a share of what a delay takes."""
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
    """That those who may be late are in the regions they finish in so much earlier."""
    goals = []
    for tolerance in mission.tolerances:
        for agent in tolerance.agents:
            place = mission.agents[agent].finish
            if place is not None and place.region is not None:
                there = k.Atom(Inside(place.region, False), place.span)
                stays = k.Always(there, mission.steps - tolerance.steps, mission.steps, place.span)
                goals.append(k.Goal("finish", k.At(agent, stays, place.span), place.span))
    return goals
