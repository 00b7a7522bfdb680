"""Remaining mission after some steps, with the remaining agents at their positions at that time.

    in   the mission with its present world, the number of completed steps, the states, levels and remaining agents
    out  Mission, whose step 0 follows the completed steps

Obstacles continue from their positions and sizes at that time. An agent that has taken off from a pad is in the air;
its return and landing are part of the remaining mission.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from missionc import ir
from missionc.base.trace import Array
from missionc.base.units import Seconds, Steps
from missionc.ir.dynamics import at_most

NO_PADS: Mapping[str, ir.Pad] = {}
NOBODY_MOVES: Mapping[str, Array] = {}


def rest_of(
    mission: ir.Mission,
    elapsed: int,
    position: Array,
    left: tuple[str, ...],
    levels: Mapping[tuple[str, str], float],
    moving: Mapping[str, Array] = NOBODY_MOVES,
    pads: Mapping[str, ir.Pad] = NO_PADS,
) -> ir.Mission:
    """Mission for the remaining steps and agents.

    Args:
        elapsed: number of completed steps, fewer than the mission has.
        position: positions of the remaining agents, (agents, dim), metres.
        left: names of the remaining agents, in mission order.
        levels: resource levels by resource and agent name.
        moving: states of agents in motion, (5, 4), by agent name, as in ``ir.Agent.begins``.
        pads: pad from which an agent took off and to which it returns, by agent name.
    """
    places = dict(zip(left, position.tolist(), strict=True))
    index = {agent.index: number for number, agent in enumerate(each for each in mission.agents if each.name in places)}
    agents = tuple(
        replace(
            agent,
            index=index[agent.index],
            start=ir.InitialSet(agent.start.span, tuple(places[agent.name])),
            pad=pads.get(agent.name),
            begins=tuple(map(tuple, moving[agent.name].tolist())) if agent.name in moving else (),
        )
        for agent in mission.agents
        if agent.index in index
    )

    def those(indices: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(index[each] for each in indices if each in index)

    def sets(some: tuple[ir.AgentSet, ...]) -> tuple[ir.AgentSet, ...]:
        return tuple(replace(each, agents=those(each.agents)) for each in some)

    seconds = mission.step * elapsed
    return replace(
        mission,
        steps=Steps(mission.steps - elapsed),
        obstacles=tuple(_later(obstacle, seconds) for obstacle in mission.obstacles),
        agents=agents,
        teams=sets(mission.teams),
        groups=sets(mission.groups),
        graphs=tuple(_graph(graph, index) for graph in mission.graphs),
        formations=tuple(_formation(formation, index) for formation in mission.formations),
        tolerances=tuple(replace(each, agents=those(each.agents)) for each in mission.tolerances),
        resources=tuple(
            replace(resource, agents=(index[agent],), start=levels[resource.name, mission.agents[agent].name])
            for resource in mission.resources
            for agent in resource.agents
            if agent in index
        ),
        flags=tuple(replace(flag, agents=those(flag.agents)) for flag in mission.flags),
        requirements=(),
        preferences=(),
        lets=(),
    )


def slowed(mission: ir.Mission, slow: Mapping[str, float]) -> ir.Mission:
    """Mission with lower speed limits, m/s, for the named agents and their vehicles."""
    agents = tuple(agent if agent.name not in slow else _no_faster(agent, slow[agent.name]) for agent in mission.agents)
    return replace(mission, agents=agents)


def _no_faster(agent: ir.Agent, speed: float) -> ir.Agent:
    vehicle = agent.vehicle
    return replace(
        agent,
        dynamics=at_most(agent.dynamics, speed, agent.dynamics.top_acceleration),
        vehicle=replace(vehicle, speed=min(vehicle.speed, speed), vertical_speed=min(vehicle.vertical_speed, speed)),
    )


def team_at(mission: ir.Mission, seconds: float, position: Array, left: tuple[str, ...]) -> ir.Mission:
    """Mission of the remaining agents at ``position``, (agents, dim), metres, with the obstacles as they are after
    ``seconds``.

    The result serves only collision checks: it has all steps of the mission, and its resources are empty.

    Args:
        left: names of the remaining agents, in mission order.
    """
    levels = {(resource.name, agent.name): 0.0 for resource in mission.resources for agent in mission.agents}
    return counted_from(rest_of(mission, 0, position, left, levels), seconds)


def counted_from(mission: ir.Mission, seconds: float) -> ir.Mission:
    """Mission with its obstacles as they are ``seconds`` later, otherwise unchanged."""
    return replace(mission, obstacles=tuple(_later(obstacle, seconds) for obstacle in mission.obstacles))


def _later(obstacle: ir.Obstacle, seconds: float) -> ir.Obstacle:
    """Obstacle with its times counted from ``seconds`` on."""
    motion = obstacle.motion
    if isinstance(motion, ir.Path):
        motion = ir.Path(tuple(Seconds(time - seconds) for time in motion.times), motion.offsets)
    return replace(obstacle, motion=motion, age=obstacle.age + seconds)


def _graph(graph: ir.Graph, index: Mapping[int, int]) -> ir.Graph:
    """Graph over the remaining agents, with the ranges and weights of their pairs."""

    def some(indices: frozenset[int]) -> frozenset[int]:
        return frozenset(index[each] for each in indices if each in index)

    members = tuple(index[each] for each in graph.agents if each in index)
    weights = tuple(
        replace(
            weight,
            pairs=tuple(
                replace(pair, senders=some(pair.senders), receivers=some(pair.receivers)) for pair in weight.pairs
            ),
        )
        for weight in graph.weights
    )
    left: ir.Graph = replace(graph, agents=members, weights=weights)
    if isinstance(left, ir.Proximity | ir.Sight):
        ranges = (replace(pair, senders=some(pair.senders), receivers=some(pair.receivers)) for pair in left.ranges)
        return replace(left, ranges=tuple(ranges))
    return left


def _formation(formation: ir.Formation, index: Mapping[int, int]) -> ir.Formation:
    """Formation of the remaining agents, with the edges between them."""
    edges = tuple(
        replace(edge, first=index[edge.first], second=index[edge.second])
        for edge in formation.edges
        if edge.first in index and edge.second in index
    )
    return replace(formation, agents=tuple(index[each] for each in formation.agents if each in index), edges=edges)
