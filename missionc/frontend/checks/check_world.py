"""Check of a mission against its world: starts, goals, resources, regions, graphs, formations and roadmap.

    in   Mission, its Kernel
    out  nothing but findings
    says MC037 MC221 MC501 MC502 MC503 MC504 MC505 MC506 MC507 MC508 MC509 MC512 MC516 MC518 MC519 MC520 MC530 MC531
         MC536 MC541 MC542 MC543 MC558 MC731

Only what makes every plan impossible is an error: outer bounds prove every report of a goal out of reach or a region
that is too small.

A graph and a formation need enough agents. Sight must not depend on a moving obstacle, and the bodies of a formation
must not touch.

An obstacle lies outside the world if it is too far away to touch a body in it. A beacon, and a region whose distance is
measured, may lie outside the world, up to the length of its diagonal away.

The user's own roadmap is checked once for each size and dynamics of agents. A finding names the first such agent that
is blocked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from operator import sub
from typing import TYPE_CHECKING, TypeAlias

from missionc.base.diagnostics import code as codes
from missionc.base.diagnostics.model import Diagnostic, Label, has_errors, in_text_order
from missionc.frontend.checks.check_goals import check_goals
from missionc.frontend.checks.check_pads import check_pads
from missionc.frontend.checks.check_resources import check_resources
from missionc.frontend.checks.check_starts import check_starts
from missionc.frontend.checks.check_vehicles import check_flown_speeds, check_tracking, check_vehicles
from missionc.frontend.checks.free_space import Containment, FreeSpace
from missionc.geometry.bounding_box import between, gap
from missionc.geometry.configuration_space import disjoint
from missionc.ir import (
    Agent,
    Beacon,
    Compare,
    Connectivity,
    DistanceTo,
    Formation,
    Graph,
    Holds,
    InitialSet,
    Lanes,
    Mission,
    Obstacle,
    Path,
    PlacesFile,
    Region,
    Sight,
    Still,
)
from missionc.ir.agents import ends_by_region
from missionc.ir.couplings import directed
from missionc.ir.kernel.nodes import Any, Atom, Kernel, Node, Not
from missionc.ir.kernel.walk import bottom_up, postorder
from missionc.ir.language.walk_formulas import formulas
from missionc.ir.wording import listed, metres, number, point, spaced

if TYPE_CHECKING:
    from missionc.ir.places import Extents, FileRequest


FEWEST = 2


def check_graphs(mission: Mission) -> list[Diagnostic]:
    """Findings about graphs and formations that are meaningless, such as a graph of a single agent."""
    findings = [_small_graph(graph) for graph in mission.graphs if len(graph.agents) < FEWEST]
    moving = [obstacle for obstacle in mission.obstacles if not obstacle.constant]
    if moving:
        findings.extend(_past_motion(graph, moving) for graph in mission.graphs if isinstance(graph, Sight))
    if mission.solve.connectivity is Connectivity.LAMBDA2:
        findings.extend(_one_way(graph) for graph in _connected(mission) if directed(graph))
    for formation in mission.formations:
        if len(formation.agents) < FEWEST:
            findings.append(_small_formation(formation))
        else:
            tight = list(_tight(mission, formation))
            if tight:
                findings.append(_forbidden(mission, formation, *min(tight, key=lambda pair: pair[2]), len(tight)))
    return findings


def _connected(mission: Mission) -> list[Graph]:
    """Graphs, as declared, whose connectivity some formula tests."""
    asked = {
        formula.predicate.graph.name
        for formula in formulas(mission)
        if isinstance(formula, Holds) and formula.predicate.graph is not None
    }
    return [graph for graph in mission.graphs if graph.name in asked]


def _tight(mission: Mission, formation: Formation) -> Iterator[tuple[int, int, float]]:
    """Yield pairs of agents that a formation holds too close, with their maximum distance in metres."""
    for first, second, target, tolerance in _reaches(formation):
        spacing = mission.spacing(first, second)
        if isinstance(target, tuple):
            most = spacing.measured(target) + tolerance * max(1.0, spacing.flatness)
            if most <= spacing.sideways:
                yield first, second, math.hypot(*target) + tolerance
        elif target + tolerance <= spacing.least:
            yield first, second, target + tolerance


def _reaches(formation: Formation) -> Iterator[tuple[int, int, float | tuple[float, ...], float]]:
    """Yield pairs of agents at the edges of a formation, each with its length or offset and tolerance, metres."""
    tolerance = formation.tolerance
    offsets: list[tuple[tuple[float, ...], int]] = []
    for edge in formation.edges:
        yield edge.first, edge.second, edge.target, tolerance
        if isinstance(edge.target, tuple):
            offsets.append((edge.target, edge.second))
    offsets.sort()
    both = tolerance if formation.total else 2 * tolerance
    for (here, first), (there, second) in pairwise(offsets):
        yield first, second, tuple(map(sub, here, there)), both


# ------------------------------------------------------------------ messages


def _small_graph(graph: Graph) -> Diagnostic:
    return Diagnostic(
        codes.GRAPH_TOO_SMALL,
        f"graph `{graph.name}` has {_agents(len(graph.agents))}; a link needs two",
        Label(graph.span),
        help="name more agents after `over`",
    )


def _past_motion(graph: Graph, moving: list[Obstacle]) -> Diagnostic:
    names = listed([f"`{obstacle.name}`" for obstacle in moving])
    verbs = ["grow" if isinstance(each.motion, Still) else "move" for each in moving]
    does = " or ".join(sorted(set(verbs), reverse=True))
    return Diagnostic(
        codes.SIGHT_PAST_MOTION,
        f"obstacles of the sight graph `{graph.name}` change: {names} {does}{'s' if len(moving) == 1 else ''}",
        Label(graph.span),
        tuple(Label(obstacle.span, f"{verb}s") for obstacle, verb in zip(moving, verbs, strict=True)),
        notes=("lines of sight are computed once, so obstacles must be constant",),
        help="use a `proximity` graph",
    )


def _one_way(graph: Graph) -> Diagnostic:
    return Diagnostic(
        codes.ONE_WAY_LAMBDA2,
        f"`connectivity = lambda2` needs bidirectional links; graph `{graph.name}` has directed links",
        Label(graph.span),
        notes=("λ₂ is an eigenvalue of a symmetric Laplacian",),
        help="set the same range in both directions",
    )


def _small_formation(formation: Formation) -> Diagnostic:
    return Diagnostic(
        codes.FORMATION_TOO_SMALL,
        f"formation `{formation.name}` has {_agents(len(formation.agents))}; it needs two",
        Label(formation.span),
        help="add agents to the formation",
    )


def _agents(count: int) -> str:
    return "one agent" if count == 1 else "no agent"


def _forbidden(mission: Mission, formation: Formation, first: int, second: int, apart: float, pairs: int) -> Diagnostic:
    one, other = mission.agents[first], mission.agents[second]
    needed = mission.spacing(first, second)
    takes = (
        f"the radii {metres(one.radius)} and {metres(other.radius)} and the separation {metres(mission.separation)}"
        f" need {spaced(needed)}"
    )
    if needed.most > one.radius + other.radius + mission.separation:
        takes = f"their vehicles need {spaced(needed)} between centres"
    more = () if pairs == 1 else (f"{pairs - 1:,} more {'pair is' if pairs == 2 else 'pairs are'} too close",)
    return Diagnostic(
        codes.FORMATION_TOO_TIGHT,
        f"formation `{formation.name}` requires `{one.name}` and `{other.name}` within {metres(apart)}",
        Label(formation.span, f"tolerance {metres(formation.tolerance)}"),
        notes=(takes, *more),
        help="increase the spacing of the formation",
    )


Place: TypeAlias = "Obstacle | Region | Beacon"


def check_places(mission: Mission, kernel: Kernel, entered: set[str]) -> tuple[list[Diagnostic], frozenset[str]]:
    """Findings about obstacles, regions and beacons outside the world; those of one file get a single finding.

    Args:
        entered: regions that an agent must enter or avoid, which are an error outside the world (MC504).

    Returns:
        The findings, and the names of the regions with an error.
    """
    measured = _measured(kernel)
    places: tuple[Place, ...] = (*mission.obstacles, *mission.regions, *mission.beacons)
    outside = {place.name: place for place in places if _outside(mission, place, place.name in measured)}
    findings: list[Diagnostic] = []
    misplaced: set[str] = set()
    world = mission.world.low[:2], mission.world.high[:2]
    for file in mission.files:
        there = [outside.pop(name) for name in sorted(file.names & outside.keys())]
        extents, asked = file.summary.extents, file.asked
        if not there or extents is None or asked is None:
            continue
        if len(there) == len(file.names) and between(extents, world) > 0:
            findings.append(_all_outside(mission, file, asked, extents))
            misplaced |= file.names
        else:
            findings.append(_some_outside(mission, file, asked, there))
    findings += [_one_outside(mission, place) for name, place in outside.items() if name not in entered]
    return findings, frozenset(misplaced)


def _outside(mission: Mission, place: Place, measured: bool) -> bool:
    away = _away(mission, place)
    if isinstance(place, Obstacle):
        return away > max(agent.radius for agent in mission.agents) + mission.clearance
    diagonal = math.dist(mission.world.low, mission.world.high)
    return away > (diagonal if measured or isinstance(place, Beacon) else 0.0)


def _away(mission: Mission, place: Place) -> float:
    """Maximum distance of an obstacle, region or beacon from the world in metres, for an obstacle over all its
    motion.
    """
    low, high = mission.world.low, mission.world.high
    if isinstance(place, Beacon):
        return between((place.position, place.position), (low, high))
    if isinstance(place, Obstacle) and isinstance(place.motion, Path):
        offsets = [(*each, *(0.0,) * (mission.dimension - len(each))) for each in place.motion.offsets]
        low = tuple(least - max(moved) for least, *moved in zip(low, *offsets, strict=True))
        high = tuple(most - min(moved) for most, *moved in zip(high, *offsets, strict=True))
    grown = place.grown(mission.horizon) if isinstance(place, Obstacle) else 0.0
    return max(gap(place.shape, low, high) - grown, 0.0)


def _measured(kernel: Kernel) -> set[str]:
    """Names of the regions to which a formula measures the distance."""
    atoms = [node.predicate for node in postorder(kernel.meanings.values()) if isinstance(node, Atom)]
    features = [feature for atom in atoms if isinstance(atom, Compare) for _, feature in atom.terms]
    targets = [feature.target for feature in features if isinstance(feature, DistanceTo)]
    return {target.name for target in targets if isinstance(target, Region)}


# ------------------------------------------------------------------ messages


def _all_outside(mission: Mission, file: PlacesFile, asked: FileRequest, extents: Extents) -> Diagnostic:
    from missionc.base.diagnostics.map_error import MapError  # few missions read files
    from missionc.frontend.maps.likely_cause import likely_cause

    low, high = extents
    (west, south, *_), (east, north, *_) = mission.world.low, mission.world.high
    try:
        way_out = likely_cause(asked, extents, ((west, south), (east, north)))
    except MapError as error:
        return error.finding
    every = f"the {file.kind}" if len(file.names) == 1 else f"all {len(file.names)} {file.kind}s"
    return Diagnostic(
        codes.FILE_OUTSIDE_WORLD,
        f"{every} of `{file.path}` lie{'s' if len(file.names) == 1 else ''} outside the world, from {point(low)} to "
        f"{point(high)} m",
        Label(asked.span),
        (Label(mission.world.span, "the world"),),
        help=way_out,
    )


def _some_outside(mission: Mission, file: PlacesFile, asked: FileRequest, outside: list[Place]) -> Diagnostic:
    first = outside[0].span
    beside = () if first == asked.span else (Label(first, f"`{outside[0].name}`"),)
    return Diagnostic(
        codes.PLACE_OUTSIDE_WORLD,
        f"{len(outside)} of {len(file.names)} {file.kind}s of `{file.path}` lie outside the world",
        Label(asked.span),
        (Label(mission.world.span, "the world"), *beside),
        help="make the world larger",
    )


def _one_outside(mission: Mission, place: Place) -> Diagnostic:
    kind = type(place).__name__.lower()
    return Diagnostic(
        codes.PLACE_OUTSIDE_WORLD,
        f"{kind} `{place.name}` lies outside the world, {metres(round(_away(mission, place), 1))} away",
        Label(place.span),
        (Label(mission.world.span, "the world"),),
        help=f"move the {kind} into the world",
    )


def check_lanes(mission: Mission) -> list[Diagnostic]:
    """Findings about a user's roadmap in the mission; empty without one."""
    lanes = mission.solve.roadmap
    if lanes is None:
        return []
    from missionc.geometry.lane_room import (  # needs arrays
        agents_by_kind,
        lanes_blocked,
        nodes_blocked,
        nodes_outside,
    )

    outside = nodes_outside(mission, lanes)
    findings = [_node_outside(lanes, node) for node in outside]
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
    from missionc.geometry.lane_room import joined_to

    findings = []
    for agent in mission.agents:
        for verb, place in (("starts", agent.start), ("finishes", agent.finish)):
            if place and place.point and joined_to(mission, agent, lanes, place.point) is None:
                findings.append(_unjoined(lanes, agent, verb, place))
    return findings


def _regions(mission: Mission, lanes: Lanes) -> list[Diagnostic]:
    from missionc.geometry.lane_room import nodes_within

    findings = []
    for region, crowd in ends_by_region(mission.starts).items():
        nodes = len(nodes_within(lanes, region.shape))
        if nodes < len(crowd):
            findings.append(_too_few(lanes, region, crowd, nodes))
    return findings


# ------------------------------------------------------------------ messages


def _node_outside(lanes: Lanes, node: int) -> Diagnostic:
    where = ", ".join(map(number, lanes.nodes[node].position))
    return Diagnostic(
        codes.LANE_NODE_MISPLACED,
        f"node `{lanes.nodes[node].name}` of the roadmap is at ({where}), outside the world",
        Label(lanes.nodes[node].span),
        (Label(lanes.span, "roadmap of the mission"),),
        help="move the node into the world",
    )


def _blocked_node(mission: Mission, lanes: Lanes, node: int, agent: Agent) -> Diagnostic:
    from missionc.geometry.lane_room import in_the_way

    place = lanes.nodes[node].position
    obstacle = in_the_way(mission, agent, place, place)
    return Diagnostic(
        codes.LANE_NODE_MISPLACED,
        f"node `{lanes.nodes[node].name}` of the roadmap is too close to `{obstacle.name}` for `{agent.name}`",
        Label(lanes.nodes[node].span),
        (Label(obstacle.span, "the obstacle"), Label(lanes.span, "roadmap of the mission")),
        notes=(_body(mission, agent),),
        help="move the node",
    )


def _blocked_lane(mission: Mission, lanes: Lanes, lane: int, agent: Agent) -> Diagnostic:
    from missionc.geometry.lane_room import in_the_way

    source, target = lanes.nodes[lanes.lanes[lane].source], lanes.nodes[lanes.lanes[lane].target]
    obstacle = in_the_way(mission, agent, source.position, target.position)
    return Diagnostic(
        codes.LANE_BLOCKED,
        f"the lane from `{source.name}` to `{target.name}` is too close to `{obstacle.name}` for `{agent.name}`",
        Label(lanes.lanes[lane].span),
        (Label(obstacle.span, "the obstacle"), Label(lanes.span, "roadmap of the mission")),
        notes=(_body(mission, agent),),
        help="add a node to lead the lane around the obstacle",
    )


def _body(mission: Mission, agent: Agent) -> str:
    beside = f", and the clearance is {number(mission.clearance)} m" if mission.clearance else ""
    return f"`{agent.name}` has a radius of {number(agent.radius)} m{beside}"


def _unjoined(lanes: Lanes, agent: Agent, verb: str, place: InitialSet) -> Diagnostic:
    return Diagnostic(
        codes.NOT_ON_LANES,
        f"`{agent.name}` {verb} without a free straight path to a node of the roadmap",
        Label(place.span, f"{verb} here"),
        (Label(lanes.span, "roadmap of the mission"),),
        help="add a node near this position",
    )


def _too_few(lanes: Lanes, region: Region, crowd: list[tuple[Agent, InitialSet]], nodes: int) -> Diagnostic:
    agents = f"`{crowd[0][0].name}` starts" if len(crowd) == 1 else f"{len(crowd)} agents start"
    has = {0: "no node", 1: "one node"}.get(nodes, f"{nodes} nodes")
    return Diagnostic(
        codes.NOT_ON_LANES,
        f"{agents} in `{region.name}`, but the roadmap has {has} there",
        Label(crowd[0][1].span, "starts here"),
        (Label(lanes.span, "roadmap of the mission"),),
        help=f"add a node in `{region.name}` for each agent",
    )


def check_world(mission: Mission, kernel: Kernel, ground: FreeSpace | None = None) -> list[Diagnostic]:
    """Findings about the world and its contents.

    Args:
        ground: the mission's free space, if known.
    """
    if mission.world.flat:
        return [_flat_world(mission)]
    ground = ground or FreeSpace.of(mission)
    entered = _entered(mission, kernel)
    outside, misplaced = check_places(mission, kernel, entered)
    found = [
        *outside,
        *_check_regions(mission, ground, entered - misplaced),
        *check_graphs(mission),
        *check_starts(mission, ground),
        *check_goals(mission, kernel, ground),
        *check_resources(mission, kernel, ground),
        *check_vehicles(mission, ground),
        *check_tracking(mission),
        *check_pads(mission),
        *check_lanes(mission),
    ]
    return in_text_order(found if has_errors(found) else [*found, *check_flown_speeds(mission, kernel)])


def _check_regions(mission: Mission, ground: FreeSpace, entered: set[str]) -> list[Diagnostic]:
    findings = []
    for region in mission.regions:
        match ground.lies(region.shape):
            case Containment.NOWHERE:
                findings.append(_nothing_left(region))
            case Containment.ELSEWHERE if region.name in entered:
                findings.append(_elsewhere(mission, region))
            case Containment.COVERED if region.name in entered:
                findings.append(_swallowed(region, _around(mission, ground, region)))
            case _:
                pass
    return findings


def _entered(mission: Mission, kernel: Kernel) -> set[str]:
    """Regions whose membership is tested; distances and shapes may use others as well.

    Those that only some alternatives of an ``or`` ask for are left out: a dead alternative has its own warning.
    """
    asked = bottom_up(kernel.formulas, _asked)
    names = set[str]().union(*(entered | avoided for entered, avoided in map(asked.__getitem__, kernel.formulas)))
    ends = (place.region for agent in mission.agents for place in agent.ends)
    return names | {region.name for region in ends if region}


def _asked(
    node: Node, below: tuple[tuple[frozenset[str], frozenset[str]], ...]
) -> tuple[frozenset[str], frozenset[str]]:
    """Regions that a formula asks for, whichever alternative holds, and regions that it asks to avoid."""
    match node:
        case Atom(predicate):
            return frozenset((predicate.region.name,) if predicate.region else ()), frozenset()
        case Not():
            ((entered, avoided),) = below
            return avoided, entered
    entered, avoided = (frozenset[str]().union(*(each[kind] for each in below)) for kind in (0, 1))
    if isinstance(node, Any) and below:
        entered = frozenset.intersection(*(each for each, _ in below))
    return entered, avoided


def _around(mission: Mission, ground: FreeSpace, region: Region) -> list[Obstacle]:
    """The static obstacle that covers a region, or else all static obstacles that intersect it."""
    atlas = ground.atlas
    area = atlas.outer(region.shape)
    still = [obstacle for obstacle in mission.obstacles if isinstance(obstacle.motion, Still)]
    single = [obstacle for obstacle in still if ground.fills(obstacle, area)]
    return single[:1] or [obstacle for obstacle in still if not disjoint(atlas.inner(obstacle.shape), area)]


# ------------------------------------------------------------------ messages


def _flat_world(mission: Mission) -> Diagnostic:
    low, high = (f"({', '.join(map(number, corner))})" for corner in (mission.world.low, mission.world.high))
    return Diagnostic(
        codes.NO_AREA,
        f"the world from {low} to {high} is empty",
        Label(mission.world.span),
        help="make the second corner larger in every coordinate",
    )


def _nothing_left(region: Region) -> Diagnostic:
    return Diagnostic(
        codes.NO_AREA,
        f"region `{region.name}` is empty",
        Label(region.span),
        help="check the shapes that it intersects or subtracts",
    )


def _elsewhere(mission: Mission, region: Region) -> Diagnostic:
    return Diagnostic(
        codes.REGION_OUTSIDE_WORLD,
        f"region `{region.name}` lies outside the world",
        Label(region.span),
        (Label(mission.world.span, "the world"),),
        help="move the region into the world",
    )


def _swallowed(region: Region, obstacles: list[Obstacle]) -> Diagnostic:
    names = listed([f"`{obstacle.name}`" for obstacle in obstacles])
    return Diagnostic(
        codes.REGION_IN_OBSTACLE,
        f"region `{region.name}` lies inside {'obstacle' if len(obstacles) == 1 else 'obstacles'} {names}",
        Label(region.span, "no agent can be here"),
        tuple(Label(obstacle.span, f"`{obstacle.name}`") for obstacle in obstacles[:3]),
        help="move the region out of the obstacle",
    )
