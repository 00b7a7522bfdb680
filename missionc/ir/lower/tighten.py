"""Tightening of a mission by a margin, so that a flight with a small tracking error still satisfies it.

    in   Mission, Kernel, a margin in metres
    out  a stricter Mission and Kernel: a plan that satisfies them satisfies the original with the margin

Requirements are tightened by their sense: a region to enter shrinks, a region to avoid grows. The radius of a graph and
the tolerance of a formation shrink by twice the margin, since both agents may deviate. No region, radius or tolerance
loses more than half of its size. In addition, vehicles need clearance from each other, from obstacles and from the
world's bounds, and plans must be slow enough to fly from rest to rest.

Tightening of a mission by its tolerated delays, so that a delayed agent still satisfies it.

    in   Mission, Kernel
    out  a Kernel with earlier deadlines, a Mission with more clearance between agents and from changing obstacles

At step 0, an *eventually* window ends earlier and an *always* window begins earlier. An agent with a finish region
arrives earlier. A formula about one agent's trajectory then also holds with the delay. A delayed agent deviates from
its plan by at most the distance that it travels in that time, so the separations grow by this distance. ``verify``
checks the result.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import replace
from itertools import combinations
from operator import sub
from typing import assert_never

from missionc import ir
from missionc.base.units import Metres
from missionc.ir import Inside, Mission
from missionc.ir.couplings import with_ranges
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.nodes import Atom, Goal, Kernel, LeafNode, Node, Not
from missionc.ir.kernel.walk import bottom_up, graph_of, postorder, rebuilt
from missionc.ir.lower.flyable_steps import CRUISE

MITRE = 2.0
"""Mitre limit: how far a polygon's corner moves at most when the polygon grows, in multiples of the margin."""

PEAK, START = 1.5, 4.6
"""Measured on straight flights from rest: peak speed / planned speed, acceleration / speed per step duration."""
SHARES = (1.0, 0.5, 0.25)
"""Fractions of the agents' start-time drift at top speed; the largest that starts and finishes permit is used."""
SURELY = 1e-5
"""Additional separation, metres, so that rounding errors of a backend do not violate the separation."""
SPARE = 0.8
"""Fraction of a vehicle's speed limits for plans with gradual starts; rounded corners need the rest."""


def tracking_margin(mission: ir.Mission) -> Metres:
    """Largest tracking error of the mission's vehicles: distance between a flight and its plan, metres."""
    return Metres(max((agent.vehicle.tracking for agent in mission.agents), default=0.0))


def with_vehicle_room(mission: ir.Mission) -> ir.Mission:
    """Mission with the clearance, world bounds and drift that its vehicles need; the same object if nothing changes."""
    rooms = [mission.room(agent.index) for agent in mission.agents]
    # If vehicles differ, use the largest clearance; the flight check uses the exact one.
    low = tuple(min(axis) for axis in zip(*(room[0] for room in rooms), strict=True))
    high = tuple(max(axis) for axis in zip(*(room[1] for room in rooms), strict=True))
    wanted = replace(
        mission,
        world=replace(mission.world, low=low, high=high),
        clearance=Metres(mission.clearance + tracking_margin(mission)),
        drift=_drift(mission),
    )
    before = mission.world, mission.clearance, mission.drift
    return mission if (wanted.world, wanted.clearance, wanted.drift) == before else wanted


def _drift(mission: ir.Mission) -> tuple[Metres, ...]:
    """Distance of each agent from its plan at top speed, metres, if agents start at slightly different times.

    The distance is smaller if starts or finishes are close together, since agents are slow near them. The result is
    empty if no vehicle drifts.
    """
    drift = [
        agent.vehicle.start_skew * min(agent.vehicle.speed, PEAK * agent.dynamics.top_speed) for agent in mission.agents
    ]
    if not any(drift):
        return ()
    for share in SHARES:
        some = replace(mission, drift=tuple(Metres(share * each) for each in drift))
        if _apart(some, mission.starts) and _apart(some, mission.finishes):
            return some.drift
    return ()


def _apart(mission: ir.Mission, ends: Iterable[tuple[ir.Agent, ir.InitialSet]]) -> bool:
    """Return true if all starts (or finishes) that are points satisfy the mission's separations."""
    exact = [(agent.index, place.point) for agent, place in ends if place.point is not None]
    for (one, here), (other, there) in combinations(exact, 2):
        spacing = mission.spacing(one, other)
        if spacing.measured(tuple(map(sub, here, there))) < spacing.sideways + SURELY:
            return False
    return True


def with_flyable_speeds(mission: ir.Mission, share: float | None = None) -> ir.Mission:
    """Mission with top speeds at which its vehicles can fly the plan smoothly; the same object if nothing changes.

    A first-order plan starts at full speed, but its flight starts at rest. In a step of duration d that covers v d, the
    flight reaches up to ``PEAK`` v, with an acceleration of up to ``START`` v / d.

    Args:
        share: fraction of a vehicle's limits for plans with gradual starts (``lower.flyable_steps``). If None, speeds
            are low enough for plans that start at full speed.
    """
    agents = tuple(
        replace(agent, dynamics=_slower(agent.dynamics, agent.vehicle, float(mission.step), share))
        for agent in mission.agents
    )
    same = all(slow.dynamics == agent.dynamics for slow, agent in zip(agents, mission.agents, strict=True))
    return mission if same else replace(mission, agents=agents)


def _slower(dynamics: ir.Dynamics, vehicle: ir.Vehicle, step: float, share: float | None) -> ir.Dynamics:
    if dynamics.has_momentum:
        part = SPARE if share is None else share
        return dynamics.at_most(part * vehicle.speed, part * vehicle.acceleration)
    # An agent that cannot fly so slowly is planned without this limit.
    at_once = min(vehicle.speed / PEAK, vehicle.acceleration * step / START)
    return dynamics.at_most(at_once if share is None else share * vehicle.speed / CRUISE, math.inf)


def tightened(mission: ir.Mission, kernel: Kernel, margin: Metres) -> tuple[ir.Mission, Kernel]:
    """Mission and kernel with all requirements tightened by the margin, metres; preferences are unchanged."""
    if margin <= 0:
        return mission, kernel
    tighter, wider = _Borders(-margin), _Borders(margin)
    goals = _tightened(kernel.requirements, tighter, wider)
    regions = tuple(tighter.region(region) for region in mission.regions)
    graphs = tuple(tighter.graph(graph) for graph in mission.graphs)
    return replace(mission, regions=regions, graphs=graphs), replace(kernel, requirements=goals)


def tightened_alone(kernel: Kernel, names: Set[str], margin: Metres) -> Kernel:
    """Kernel with the named requirements tightened by the margin, metres; the other requirements are the same
    objects."""
    if margin <= 0:
        return kernel
    some = [goal for goal in kernel.requirements if goal.name in names]
    tighter = dict(zip(some, _tightened(some, _Borders(-margin), _Borders(margin)), strict=True))
    return replace(kernel, requirements=tuple(tighter.get(goal, goal) for goal in kernel.requirements))


def margin_limits(kernel: Kernel, margin: Metres) -> dict[str, Metres]:
    """Margins of the regions, graphs and formations that ``tightened`` shrinks by less than the margin, by name."""
    tighter = _Borders(-margin)
    nodes = postorder(goal.formula for goal in kernel.requirements)
    negated = {node.body for node in nodes if isinstance(node, Not)}
    for node in nodes:
        if isinstance(node, Atom) and node not in negated:
            node.predicate.moved(tighter)
        elif not isinstance(node, LeafNode | Not) and (graph := graph_of(node)) and not node.every:
            tighter.graph(graph)
    return {name: kept for name, kept in tighter.kept() if kept < margin * (1 - 1e-9)}


def _tightened(goals: Sequence[Goal], tighter: _Borders, wider: _Borders) -> tuple[Goal, ...]:
    nodes = bottom_up((goal.formula for goal in goals), lambda node, below: _more(node, below, tighter, wider))
    return tuple(replace(goal, formula=nodes[goal.formula]) for goal in goals)


def _more(node: Node, below: tuple[Node, ...], tighter: _Borders, wider: _Borders) -> Node:
    """Stricter form of a node over stricter children."""
    match node:
        case Atom(predicate):
            return replace(node, predicate=predicate.moved(tighter))
        case Not(Atom(predicate) as leaf):
            return replace(node, body=replace(leaf, predicate=predicate.moved(wider)))
        case LeafNode():
            return node  # a shortest path may lengthen or shorten with the links, so neither direction is stricter
        case _:
            graph = graph_of(node)
            return rebuilt(node, below, graph and (wider if node.every else tighter).graph(graph))


class _Borders:
    """Boundaries of regions, graphs and formations moved by ``metres`` (negative is stricter), each object once."""

    def __init__(self, metres: float) -> None:
        self.metres = metres
        self._regions: dict[ir.Region, ir.Region] = {}
        self._graphs: dict[ir.Graph, ir.Graph] = {}
        self._formations: dict[ir.Formation, ir.Formation] = {}

    def region(self, region: ir.Region) -> ir.Region:
        if region not in self._regions:
            self._regions[region] = replace(region, shape=moved(region.shape, self.metres))
        return self._regions[region]

    def graph(self, graph: ir.Graph) -> ir.Graph:
        """Graph with its range moved by the margin, twice for links between two agents (a beacon does not deviate).

        Shapes that block a line of sight grow or shrink by the margin.
        """
        if graph not in self._graphs:
            misses = 2 if graph.by_distance else 1
            ranges = tuple(replace(each, radius=self._by(misses, each.radius)) for each in graph.ranges)
            moved_graph = with_ranges(graph, self._by(misses, graph.radius), ranges)
            if isinstance(moved_graph, ir.Sight):
                moved_graph = replace(moved_graph, room=Metres(moved_graph.room - self.metres))
            self._graphs[graph] = moved_graph
        return self._graphs[graph]

    def formation(self, formation: ir.Formation) -> ir.Formation:
        if formation not in self._formations:
            edges = len(formation.edges) if formation.total else 1
            self._formations[formation] = replace(formation, tolerance=self._by(2 * edges, formation.tolerance))
        return self._formations[formation]

    def kept(self) -> Iterator[tuple[str, Metres]]:
        """Name and margin of everything that was moved inward."""
        for region, small_region in self._regions.items():
            yield region.name, Metres(_depth(region.shape, small_region.shape))
        for graph, small in self._graphs.items():
            yield graph.name, Metres((graph.radius - small.radius) / (2 if graph.by_distance else 1))
        for formation, tight in self._formations.items():
            edges = len(formation.edges) if formation.total else 1
            yield formation.name, Metres((formation.tolerance - tight.tolerance) / (2 * edges))

    def _by(self, misses: int, length: float) -> Metres:
        """Length changed by the margin for each of ``misses`` inexact ends, but by at most half of the length;
        metres."""
        return Metres(length + math.copysign(min(misses * abs(self.metres), length / 2), self.metres))


def moved(shape: ir.Shape, by: float) -> ir.Shape:
    """Shape with its border moved outward by at least ``by`` metres if positive, inward by at least ``-by`` if
    negative.

    A shape loses at most half of its least width.
    """
    match shape:
        case ir.Union(left, right):
            return ir.Union(moved(left, by), moved(right, by))
        case ir.Intersection(left, right):
            return ir.Intersection(moved(left, by), moved(right, by))
        case ir.Difference(left, right):
            return ir.Difference(moved(left, by), moved(right, -by))
        case ir.Box(low, high):
            return ir.Box(*_band(low, high, by))
        case ir.Disc(centre, radius, band):
            return ir.Disc(centre, radius + max(by, -radius / 2), _prism(band, by))
        case ir.Ball(centre, radius):
            return ir.Ball(centre, radius + max(by, -radius / 2))
        case ir.Polygon(corners, band):
            return ir.Polygon(_outline(corners, by), _prism(band, by))
        case _:
            assert_never(shape)


def _depth(shape: ir.Shape, inner: ir.Shape) -> float:
    """Least distance, metres, by which ``moved`` has moved the border of a shape inward to that of ``inner``."""
    match shape, inner:
        case (ir.Union(one, other), ir.Union(inside, beside)) | (
            ir.Intersection(one, other),
            ir.Intersection(inside, beside),
        ):
            return min(_depth(one, inside), _depth(other, beside))
        case ir.Difference(one), ir.Difference(inside):
            return _depth(one, inside)
        case ir.Box(low), ir.Box(lower):
            return min(begin - outer for begin, outer in zip(lower, low, strict=True))
        case ir.Disc(_, radius, band), ir.Disc(_, less, thin):
            return min(radius - less, _less_high(band, thin))
        case ir.Ball(_, radius), ir.Ball(_, less):
            return radius - less
        case ir.Polygon(corners, band), ir.Polygon(within, thin):
            from shapely import LinearRing  # needed only for polygons

            return min(float(LinearRing(corners).distance(LinearRing(within))), _less_high(band, thin))
        case _:
            raise AssertionError("a moved shape is of the same kind")


def _less_high(band: ir.Prism | None, thin: ir.Prism | None) -> float:
    """Distance, metres, by which the lower end of a prism has moved inward; infinite without a prism."""
    return math.inf if band is None or thin is None else thin.low - band.low


def _band(low: ir.Vector, high: ir.Vector, by: float) -> tuple[ir.Vector, ir.Vector]:
    change = [max(by, -(end - begin) / 4) for begin, end in zip(low, high, strict=True)]
    return (
        tuple(begin - each for begin, each in zip(low, change, strict=True)),
        tuple(end + each for end, each in zip(high, change, strict=True)),
    )


def _prism(band: ir.Prism | None, by: float) -> ir.Prism | None:
    if band is None:
        return None
    (low,), (high,) = _band((band.low,), (band.high,), by)
    return ir.Prism(low, high)


def _outline(corners: tuple[tuple[float, float], ...], by: float) -> tuple[tuple[float, float], ...]:
    """Corners of a polygon moved by ``by`` metres, or by less if it would fall apart or get holes."""
    from shapely import Polygon as Outline  # needed only for polygons

    for part in (by, by / 2, by / 4):
        found = Outline(corners).buffer(part, join_style="mitre", mitre_limit=MITRE)
        if isinstance(found, Outline) and not found.is_empty and not found.interiors:
            return tuple((float(x), float(y)) for x, y in list(found.exterior.coords)[:-1])
    return corners


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
