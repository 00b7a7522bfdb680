"""Check of the user's own roadmap against the world, and of the starts and finishes against the roadmap.

    says MC541 MC542 MC543

Agents of different size or dynamics are looked at apart; what stands in the way of the first of them is said of it.
"""

from __future__ import annotations

from missionc.diagnostics.code import LANE_BLOCKED, LANE_NODE_MISPLACED, NOT_ON_LANES
from missionc.diagnostics.model import Diagnostic, Label
from missionc.ir import Agent, Anywhere, Exactly, Lanes, Mission, Region
from missionc.ir.wording import number


def check_lanes(mission: Mission) -> list[Diagnostic]:
    """All that is wrong with a roadmap where it is; nothing without one."""
    lanes = mission.solve.roadmap
    if lanes is None:
        return []
    from missionc.world.lane_room import agents_by_kind, lanes_blocked, nodes_blocked, nodes_outside  # it needs arrays

    outside = nodes_outside(mission, lanes)
    findings = [_outside(lanes, node) for node in outside]
    wrong, shut = set(outside), set[frozenset[int]]()
    for agent in agents_by_kind(mission.agents):
        blocked = [node for node in nodes_blocked(mission, agent, lanes) if node not in wrong]
        findings += [_blocked_node(mission, lanes, node, agent) for node in blocked]
        wrong.update(blocked)
        for lane in lanes_blocked(mission, agent, lanes):
            ends = frozenset((lanes.lanes[lane].source, lanes.lanes[lane].target))
            if ends not in shut and wrong.isdisjoint(ends):
                findings.append(_blocked_lane(mission, lanes, lane, agent))
            shut.add(ends)
    return findings if findings else [*_places(mission, lanes), *_regions(mission, lanes)]


def _places(mission: Mission, lanes: Lanes) -> list[Diagnostic]:
    from missionc.world.lane_room import joined_to

    findings = []
    for agent in mission.agents:
        for verb, place in (("starts", agent.start), ("finishes", agent.finish)):
            if isinstance(place, Exactly) and joined_to(mission, agent, lanes, place.point) is None:
                findings.append(_unjoined(lanes, agent, verb, place))
    return findings


def _regions(mission: Mission, lanes: Lanes) -> list[Diagnostic]:
    from missionc.world.lane_room import nodes_within

    crowds: dict[str, tuple[Region, list[tuple[Agent, Anywhere]]]] = {}
    for agent in mission.agents:
        if isinstance(agent.start, Anywhere):
            crowds.setdefault(agent.start.region.name, (agent.start.region, []))[1].append((agent, agent.start))
    findings = []
    for region, crowd in crowds.values():
        nodes = len(nodes_within(lanes, region.shape))
        if nodes < len(crowd):
            findings.append(_too_few(lanes, region, crowd, nodes))
    return findings


# ------------------------------------------------------------------ messages


def _outside(lanes: Lanes, node: int) -> Diagnostic:
    where = ", ".join(map(number, lanes.nodes[node].position))
    return Diagnostic(
        LANE_NODE_MISPLACED,
        f"node `{lanes.nodes[node].name}` of the roadmap is at ({where}), outside the world",
        Label(lanes.nodes[node].span),
        (Label(lanes.span, "the roadmap is asked for here"),),
        help="move the node, or make the world larger",
    )


def _blocked_node(mission: Mission, lanes: Lanes, node: int, agent: Agent) -> Diagnostic:
    from missionc.world.lane_room import in_the_way

    place = lanes.nodes[node].position
    obstacle = in_the_way(mission, agent, place, place)
    return Diagnostic(
        LANE_NODE_MISPLACED,
        f"at node `{lanes.nodes[node].name}` of the roadmap `{agent.name}` is too near to `{obstacle.name}`",
        Label(lanes.nodes[node].span),
        (Label(obstacle.span, "the obstacle"), Label(lanes.span, "the roadmap is asked for here")),
        notes=(_body(mission, agent),),
        help="move the node, or leave it out",
    )


def _blocked_lane(mission: Mission, lanes: Lanes, lane: int, agent: Agent) -> Diagnostic:
    from missionc.world.lane_room import in_the_way

    source, target = lanes.nodes[lanes.lanes[lane].source], lanes.nodes[lanes.lanes[lane].target]
    obstacle = in_the_way(mission, agent, source.position, target.position)
    return Diagnostic(
        LANE_BLOCKED,
        f"on the lane from `{source.name}` to `{target.name}` `{agent.name}` comes too near to `{obstacle.name}`",
        Label(lanes.lanes[lane].span),
        (Label(obstacle.span, "the obstacle"), Label(lanes.span, "the roadmap is asked for here")),
        notes=(_body(mission, agent),),
        help="lead the lane round it by a further node, or leave it out",
    )


def _body(mission: Mission, agent: Agent) -> str:
    beside = f", and a clearance of {number(mission.clearance)} m is asked for" if mission.clearance else ""
    return f"`{agent.name}` has a radius of {number(agent.radius)} m{beside}"


def _unjoined(lanes: Lanes, agent: Agent, verb: str, place: Exactly) -> Diagnostic:
    return Diagnostic(
        NOT_ON_LANES,
        f"`{agent.name}` {verb} where no straight clear way leads to a node of the roadmap",
        Label(place.span, f"{verb} here"),
        (Label(lanes.span, "the roadmap is here"),),
        help="put a node there, or one that it sees past the obstacles",
    )


def _too_few(lanes: Lanes, region: Region, crowd: list[tuple[Agent, Anywhere]], nodes: int) -> Diagnostic:
    agents = f"`{crowd[0][0].name}` starts" if len(crowd) == 1 else f"{len(crowd)} agents start"
    has = {0: "no node", 1: "one node"}.get(nodes, f"{nodes} nodes")
    return Diagnostic(
        NOT_ON_LANES,
        f"{agents} in `{region.name}`, and the roadmap has {has} there",
        Label(crowd[0][1].span, "starts here"),
        (Label(lanes.span, "the roadmap is here"),),
        help=f"put a node for each of them into `{region.name}`, or start them `at` points",
    )
