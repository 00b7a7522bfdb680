"""What every formula means, a second time: slow, obvious, and apart from the compiler.

Only fields of IR values are read; nothing of the compiler is called. Both
logics are here: ``truth`` gives True or False, ``robustness`` a number. Their
*and* is ``min`` and their *or* is ``max`` of Python, on either kind of value.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any

from missionc import ir

Value = Any
"""True or False, or a number."""

Point = tuple[float, ...]


@dataclass(frozen=True)
class Run:
    """A mission and how its agents move, in plain lists: ``position[agent][step]``."""

    mission: ir.Mission
    position: list[list[Point]]
    velocity: list[list[Point]]
    heading: list[list[float]] = field(default_factory=list)

    @property
    def last(self) -> int:
        return len(self.position[0]) - 1


def truth(formula: ir.Formula, run: Run, agent: int, step: int) -> bool:
    return bool(Meaning(run, number=False).of(formula, agent, step))


def robustness(formula: ir.Formula, run: Run, agent: int, step: int) -> float:
    return float(Meaning(run, number=True).of(formula, agent, step))


def ahead(formula: ir.Formula) -> int:
    """How many steps ahead the formula looks; a window to the end counts to its start."""
    if isinstance(formula, ir.Apply):
        further = max(ahead(operand) for operand in formula.operands)
        if formula.operator.name in ("once", "historically", "since"):
            assert isinstance(formula.bounds, ir.Window)
            *holds, last = map(ahead, formula.operands)
            return max([0, last - formula.bounds.low, *(holds if formula.bounds.high else ())])
        if isinstance(formula.bounds, ir.Window):
            high = formula.bounds.low if formula.bounds.high is None else formula.bounds.high
            if formula.operator.name in ("until", "release"):
                before, last = map(ahead, formula.operands)
                return max(high + last, high - 1 + before if high > 0 else 0)
            return further + high
        if isinstance(formula.bounds, ir.Period):
            return further + formula.bounds.steps
        return further + (formula.operator.name == "next")
    if isinstance(formula, ir.AtLeastOf | ir.OfAgent | ir.Without):
        return ahead(formula.body)
    return 0


class Meaning:
    """One of the two logics on one run."""

    def __init__(self, run: Run, number: bool, lost: frozenset[int] = frozenset()) -> None:
        self.run, self.number, self.lost = run, number, lost
        self.true: Value = math.inf if number else True
        self.false: Value = -math.inf if number else False
        self.known: dict[tuple[ir.Formula, int, int], Value] = {}

    # ------------------------------------------------------------ the logics

    def no(self, value: Value) -> Value:
        return -value if self.number else not value

    def all(self, values: Iterable[Value]) -> Value:
        return min(values, default=self.true)

    def any(self, values: Iterable[Value]) -> Value:
        return max(values, default=self.false)

    def constant(self, fact: bool) -> Value:
        return self.true if fact else self.false

    def closed(self, margin: float) -> Value:
        """Of something that still holds at its border."""
        return margin if self.number else margin >= 0

    def strict(self, margin: float) -> Value:
        return margin if self.number else margin > 0

    # -------------------------------------------------------------- formulas

    def of(self, formula: ir.Formula, agent: int, step: int) -> Value:
        """What the formula is worth at an agent and a step; worked out once."""
        key = (formula, agent, step)
        if key not in self.known:
            self.known[key] = self.worked_out(formula, agent, step)
        return self.known[key]

    def worked_out(self, formula: ir.Formula, agent: int, step: int) -> Value:
        match formula:
            case ir.Truth(value):
                return self.constant(value)
            case ir.Belongs(agents):
                return self.constant(agent in agents.agents)
            case ir.Holds(predicate):
                return self.predicate(predicate, agent, step)
            case ir.OfAgent(other, body):
                return self.of(body, other, step)
            case ir.AtLeastOf(kind, number, agents, body):
                left = self.remaining(agents.agents)
                each = sorted((self.of(body, other, step) for other in left), reverse=True)
                return self.so_many(each, {"every": len(left), "some": 1}.get(kind, number))
            case ir.Without(number, agents, body):
                left = self.remaining(agents.agents)
                return self.all(
                    Meaning(self.run, self.number, self.lost.union(more)).of(body, agent, step)
                    for more in itertools.combinations(left, min(number, len(left)))
                )
            case ir.Apply(operator, operands):
                return MEANINGS[operator.name](self, formula, *operands)(agent, step)

    def so_many(self, values: list[Value], number: int) -> Value:
        """At least ``number`` of the values: the number-th best decides."""
        if number <= 0:
            return self.true
        return sorted(values, reverse=True)[number - 1] if number <= len(values) else self.false

    def remaining(self, agents: tuple[int, ...]) -> tuple[int, ...]:
        """Who of them is not lost."""
        return tuple(agent for agent in agents if agent not in self.lost)

    def window(self, formula: ir.Apply, step: int) -> range:
        bounds = formula.bounds
        assert isinstance(bounds, ir.Window)
        end = self.run.last if bounds.high is None else step + bounds.high
        return range(step + bounds.low, end + 1)

    # ------------------------------------------------------------ predicates

    def predicate(self, predicate: ir.Predicate, agent: int, step: int) -> Value:
        here = self.run.position[agent][step]
        radius = self.run.mission.agents[agent].radius
        match predicate:
            case ir.Inside(region, body):
                return self.closed(-signed_distance(region.shape, here) - (radius if body else 0.0))
            case ir.Touches(region):
                return self.closed(radius - signed_distance(region.shape, here))
            case ir.Compare(terms, constant, strict):
                value = constant + sum(weight * self.feature(feature, agent, step) for weight, feature in terms)
                return (self.strict if strict else self.closed)(value / metres_of(terms, len(here)))
            case ir.Connected(graph, agents, order):
                agents = self.remaining(agents)
                return self.all(
                    self.any(
                        self.links_of(graph, route, step) for route in simple_routes(one, left) if route[-1] == other
                    )
                    for lost in range(min(order, max(len(agents) - 1, 1)))
                    for left in itertools.combinations(agents, len(agents) - lost)
                    for one in left
                    for other in left
                    if one != other
                )
            case ir.InFormation(formation):
                edges = [edge for edge in formation.edges if self.lost.isdisjoint((edge.first, edge.second))]
                errors = [self.edge_error(edge, step) for edge in edges]
                if self.lost and not edges:
                    return self.true
                return self.closed(formation.tolerance - (sum(errors) if formation.total else max(errors, default=0.0)))
            case ir.Facing(towards, within):
                return self.closed(self.to_spare(here, self.run.heading[agent][step], towards, within))
            case ir.Flagged(flag):
                return self.any(self.set_since(flag, agent, before, step) for before in range(step + 1))

    def set_since(self, flag: ir.Flag, agent: int, before: int, step: int) -> Value:
        """The agent was in the region that sets the flag at a step, and at none after it in the one that clears it."""
        if agent not in flag.agents:
            return self.false
        track = self.run.position[agent]
        sets = self.closed(-signed_distance(flag.set_in.shape, track[before]))
        if flag.cleared_in is None:
            return sets
        away = (
            self.no(self.closed(-signed_distance(flag.cleared_in.shape, at))) for at in track[before + 1 : step + 1]
        )
        return self.all((sets, *away))

    def to_spare(self, here: Point, heading: float, towards: float | ir.Beacon, within: float) -> float:
        """Of a direction, the angle between the heading and where it would be too far aside.

        Of a beacon, how far it is from the two rays beyond which one faces it too far aside.
        """
        if isinstance(towards, ir.Beacon):
            x, y = (there - place for there, place in zip(towards.position[:2], here[:2], strict=True))
            off = angle_between(heading, math.atan2(y, x))
            rays = [(math.cos(heading + turn), math.sin(heading + turn)) for turn in (within, -within)]
            nearest = min(
                abs(x * up - y * along) if x * along + y * up >= 0 else math.hypot(x, y) for along, up in rays
            )
            return math.copysign(nearest, within - off)
        return within - angle_between(heading, towards)

    def left(self, resource: ir.Resource, agent: int, step: int) -> float:
        """What the agent has left, from the first step on."""
        left = resource.start
        for here, there in itertools.pairwise(self.run.position[agent][: step + 1]):
            left -= resource.per_second * self.run.mission.step + resource.per_metre * math.dist(here, there)
            for refill in resource.refills:
                if max(signed_distance(refill.region.shape, place) for place in (here, there)) <= 0:
                    left += refill.per_second * self.run.mission.step
            left = min(left, resource.capacity)
        return left

    def feature(self, feature: ir.Feature, agent: int, step: int) -> float:
        here = self.run.position[agent][step]
        match feature:
            case ir.Coordinate(axis):
                return here[axis]
            case ir.Speed():
                return math.hypot(*self.run.velocity[agent][step])
            case ir.Altitude():
                return here[2] if len(here) == 3 else self.run.mission.agents[agent].altitude
            case ir.DistanceTo(ir.Region() as region):
                return signed_distance(region.shape, here)
            case ir.DistanceTo(ir.Beacon() as beacon):
                return math.dist(here, beacon.position)
            case ir.DistanceTo(int() as other):
                return math.dist(here, self.run.position[other][step])
            case ir.DistanceBetween(first, second):
                return math.dist(self.run.position[first][step], self.run.position[second][step])
            case ir.Level(resource):
                return self.left(resource, agent, step)
        raise AssertionError(feature)

    def edge_error(self, edge: ir.FormationEdge, step: int) -> float:
        first, second = self.run.position[edge.first][step], self.run.position[edge.second][step]
        if isinstance(edge.target, tuple):
            return math.dist(second, tuple(a + b for a, b in zip(first, edge.target, strict=True)))
        return abs(math.dist(first, second) - edge.target)

    # ---------------------------------------------------------------- routes

    def link(self, graph: ir.Graph, one: int, other: int, step: int) -> Value:
        """From the one to the other."""
        here, there = self.run.position[one][step], self.run.position[other][step]
        match graph:
            case ir.Proximity():
                return self.strict(range_of(graph, one, other) - math.dist(here, there))
            case ir.Sight():
                near = self.strict(range_of(graph, one, other) - math.dist(here, there))
                clear = (least_on_line(shape, here, there) - graph.room for shape in graph.shapes)
                return self.all((near, *map(self.strict, clear)))
            case ir.BeaconCover():
                return self.any(
                    self.all(self.strict(graph.radius - math.dist(place, beacon)) for place in (here, there))
                    for beacon in graph.beacons
                )

    def links_of(self, graph: ir.Graph, route: tuple[int, ...], step: int) -> Value:
        return self.all(self.link(graph, one, other, step) for one, other in itertools.pairwise(route))

    def metres(self, route: tuple[int, ...], step: int) -> float:
        places = [self.run.position[agent][step] for agent in route]
        return sum(math.dist(one, other) for one, other in itertools.pairwise(places))

    def at_most(self, bounds: ir.Length, route: tuple[int, ...], bound: float, step: int) -> Value:
        """The route's own length is at most so much. Hops, and a route of none, have no margin."""
        hops = len(route) - 1
        if bounds.metric.name != "METRES" or hops == 0:
            return self.constant(counted(bounds, route) <= bound)
        return self.closed(bound - self.metres(route, step))

    def shorter(self, bounds: ir.Length, route: tuple[int, ...], bound: float, step: int) -> Value:
        hops = len(route) - 1
        if bounds.metric.name != "METRES" or hops == 0:
            return self.constant(counted(bounds, route) < bound)
        return self.strict(bound - self.metres(route, step))

    def length_fits(self, bounds: ir.Length, route: tuple[int, ...], step: int) -> Value:
        """The route's own length is within the bounds; a lower bound of 0 asks nothing."""
        fits = self.at_most(bounds, route, bounds.high, step)
        return fits if bounds.low <= 0 else min(fits, self.no(self.shorter(bounds, route, bounds.low, step)))

    def reach(
        self, bounds: ir.Length, step: int, start: int, through: Callable[[int], Value], end: Callable[[int], Value]
    ) -> Value:
        """Some route within the bounds: ``through`` at every agent before the last, ``end`` at the last."""
        return self.any(
            min(
                self.length_fits(bounds, route, step),
                self.links_of(bounds.graph, route, step),
                self.all(through(agent) for agent in route[:-1]),
                end(route[-1]),
            )
            for route in simple_routes(start, self.remaining(bounds.graph.agents))
        )

    def far_away(self, bounds: ir.Length, step: int, one: int, other: int) -> Value:
        """The shortest way between two agents, over any agents, is within the bounds."""
        routes = [route for route in simple_routes(one, self.remaining(bounds.graph.agents)) if route[-1] == other]
        if not self.number:
            there = [route for route in routes if self.links_of(bounds.graph, route, step)]
            in_metres = bounds.metric.name == "METRES"
            lengths = [self.metres(route, step) if in_metres else counted(bounds, route) for route in there]
            return bool(lengths) and bounds.low <= min(lengths) <= bounds.high
        near = self.some_way(bounds, one, other, lambda route: self.at_most(bounds, route, bounds.high, step), step)
        if bounds.low <= 0:
            return near
        nearer = self.some_way(bounds, one, other, lambda route: self.shorter(bounds, route, bounds.low, step), step)
        return min(near, -nearer)

    def some_way(
        self, bounds: ir.Length, one: int, other: int, fits: Callable[[tuple[int, ...]], Value], step: int
    ) -> Value:
        """Some route between the two agents, over any agents, is of a length that fits."""
        return self.any(
            min(fits(route), self.links_of(bounds.graph, route, step))
            for route in simple_routes(one, self.remaining(bounds.graph.agents))
            if route[-1] == other
        )


def angle_between(one: float, other: float) -> float:
    """The shorter way round, rad."""
    return math.acos(max(-1.0, min(1.0, math.cos(one) * math.cos(other) + math.sin(one) * math.sin(other))))


def simple_routes(start: int, members: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Every sequence of different agents from ``start`` on; an agent outside the graph goes nowhere."""

    def onward(route: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        yield route
        for agent in members:
            if agent not in route:
                yield from onward((*route, agent))

    return onward((start,)) if start in members else iter([(start,)])


@cache
def least_on_line(shape: ir.Shape, here: Point, there: Point) -> float:
    """The least signed distance of the points between two, for convex shapes: it falls, then rises."""
    low, high = 0.0, 1.0

    def at(share: float) -> float:
        return signed_distance(shape, tuple(a + share * (b - a) for a, b in zip(here, there, strict=True)))

    for _ in range(80):
        one, other = low + (high - low) / 3, high - (high - low) / 3
        low, high = (low, other) if at(one) < at(other) else (one, high)
    return min(at(low), at(0.0), at(1.0))


def signed_distance(shape: ir.Shape, point: Point) -> float:
    match shape:
        case ir.Box(low, high):
            beyond = [max(a - x, x - b) for a, x, b in zip(low, point, high, strict=True)]
            if max(beyond) <= 0:
                return max(beyond)
            return math.hypot(*(max(excess, 0.0) for excess in beyond))
        case ir.Disc(centre, radius, band):
            return within_band(math.dist(point[:2], centre) - radius, band, point)
        case ir.Ball(centre, radius):
            return math.dist(point, centre) - radius
        case ir.Polygon(corners, band):
            return within_band(from_polygon(corners, point[0], point[1]), band, point)
        case ir.Intersection(left, right):
            return max(signed_distance(left, point), signed_distance(right, point))
        case ir.Difference(left, right):
            return max(signed_distance(left, point), -signed_distance(right, point))
        case ir.Union(left, right):
            return min(signed_distance(left, point), signed_distance(right, point))
    raise AssertionError(shape)


def within_band(plane: float, band: ir.Prism | None, point: Point) -> float:
    """The distance from a plane shape that goes from a height to another, by that in the plane."""
    if band is None:
        return plane
    height = max(band.low - point[2], point[2] - band.high)
    return math.hypot(max(plane, 0.0), max(height, 0.0)) if max(plane, height) > 0 else max(plane, height)


def from_polygon(corners: tuple[tuple[float, float], ...], x: float, y: float) -> float:
    """Negative where the polygon goes round the point: the angles at which its sides are seen add up to a turn."""
    nearest, turned = math.inf, 0.0
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        length = math.dist((ax, ay), (bx, by))
        if length == 0:
            continue
        along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length
        along = min(max(along, 0.0), length) / length
        nearest = min(nearest, math.dist((x, y), (ax + along * (bx - ax), ay + along * (by - ay))))
        one, other = (ax - x, ay - y), (bx - x, by - y)
        turned += math.atan2(one[0] * other[1] - one[1] * other[0], one[0] * other[0] + one[1] * other[1])
    return -nearest if abs(turned) > math.pi else nearest


def metres_of(terms: tuple[tuple[float, ir.Feature], ...], dimension: int) -> float:
    """How much the terms can change for each metre of the agent's way; without metres, the weight of the rest."""

    def along(feature: ir.Feature) -> int:
        if isinstance(feature, ir.Altitude):
            return 2 if dimension == 3 else -1
        return feature.axis if isinstance(feature, ir.Coordinate) else -1

    axes = [sum(weight for weight, feature in terms if along(feature) == axis) for axis in (0, 1, 2)]
    distances = {feature for _, feature in terms if isinstance(feature, ir.DistanceTo | ir.DistanceBetween)}
    change = math.hypot(*axes) + sum(abs(sum(w for w, other in terms if other == each)) for each in distances)
    return change or abs(sum(weight for weight, feature in terms if isinstance(feature, ir.Speed | ir.Level))) or 1.0


# --------------------------------------------------------- one for each operator
# Each takes the logic, the formula and its operands, and gives the value at an agent and a step.

At = Callable[[int, int], Value]


def always(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: m.all(m.of(body, agent, later) for later in m.window(formula, step))


def eventually(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: m.any(m.of(body, agent, later) for later in m.window(formula, step))


def every(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    """In each stretch of the period from now on that the mission does not end before."""
    assert isinstance(formula.bounds, ir.Period)
    period = formula.bounds.steps
    return lambda agent, step: m.all(
        m.any(m.of(body, agent, when) for when in range(begin, begin + period + 1))
        for begin in range(step, m.run.last - period + 1)
    )


def until(m: Meaning, formula: ir.Apply, hold: ir.Formula, end: ir.Formula) -> At:
    return lambda agent, step: m.any(
        min(m.of(end, agent, later), m.all(m.of(hold, agent, before) for before in range(step, later)))
        for later in m.window(formula, step)
    )


def release(m: Meaning, formula: ir.Apply, frees: ir.Formula, held: ir.Formula) -> At:
    """At every step of the window: ``held``, unless ``frees`` was before."""
    return lambda agent, step: m.all(
        max(m.of(held, agent, later), m.any(m.of(frees, agent, before) for before in range(step, later)))
        for later in m.window(formula, step)
    )


def back(formula: ir.Apply, step: int) -> list[int]:
    """The steps of a window that looks back: those that there are, the earliest first."""
    bounds = formula.bounds
    assert isinstance(bounds, ir.Window)
    assert bounds.high is not None
    return [before for before in range(step - bounds.high, step - bounds.low + 1) if before >= 0]


def once(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: m.any(m.of(body, agent, before) for before in back(formula, step))


def historically(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: m.all(m.of(body, agent, before) for before in back(formula, step))


def since(m: Meaning, formula: ir.Apply, hold: ir.Formula, end: ir.Formula) -> At:
    return lambda agent, step: m.any(
        min(m.of(end, agent, before), m.all(m.of(hold, agent, after) for after in range(before + 1, step + 1)))
        for before in back(formula, step)
    )


def next_(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: m.of(body, agent, step + 1)


def arrives(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: min(m.of(body, agent, step), m.no(m.of(body, agent, step - 1))) if step else m.false


def leaves(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: min(m.of(body, agent, step - 1), m.no(m.of(body, agent, step))) if step else m.false


def not_(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: m.no(m.of(body, agent, step))


def and_(m: Meaning, formula: ir.Apply, left: ir.Formula, right: ir.Formula) -> At:
    return lambda agent, step: min(m.of(left, agent, step), m.of(right, agent, step))


def or_(m: Meaning, formula: ir.Apply, left: ir.Formula, right: ir.Formula) -> At:
    return lambda agent, step: max(m.of(left, agent, step), m.of(right, agent, step))


def implies(m: Meaning, formula: ir.Apply, left: ir.Formula, right: ir.Formula) -> At:
    return lambda agent, step: max(m.no(m.of(left, agent, step)), m.of(right, agent, step))


def iff(m: Meaning, formula: ir.Apply, left: ir.Formula, right: ir.Formula) -> At:
    def both_or_neither(agent: int, step: int) -> Value:
        one, other = m.of(left, agent, step), m.of(right, agent, step)
        return max(min(one, other), min(m.no(one), m.no(other)))

    return both_or_neither


def reach(m: Meaning, formula: ir.Apply, through: ir.Formula, end: ir.Formula) -> At:
    return lambda agent, step: m.reach(
        _length(formula), step, agent, lambda at: m.of(through, at, step), lambda at: m.of(end, at, step)
    )


def counted(bounds: ir.Length, route: tuple[int, ...]) -> int:
    """The links of a route, or what they weigh."""
    weight = bounds.weight
    return sum(1 if weight is None else weigh(weight, *pair) for pair in itertools.pairwise(route))


def weigh(weight: ir.Weight, one: int, other: int) -> int:
    said = [pair.weight for pair in weight.pairs if one in pair.senders and other in pair.receivers]
    return said[0] if said else weight.others


def range_of(graph: ir.Proximity | ir.Sight, one: int, other: int) -> float:
    said = [pair.radius for pair in graph.ranges if one in pair.senders and other in pair.receivers]
    return said[0] if said else graph.radius


def somewhere(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    return lambda agent, step: m.reach(_length(formula), step, agent, lambda _: m.true, lambda at: m.of(body, at, step))


def everywhere(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    """At the end of every route within the bounds."""
    return lambda agent, step: m.all(
        max(
            m.no(m.length_fits(_length(formula), route, step)),
            m.no(m.links_of(_length(formula).graph, route, step)),
            m.of(body, route[-1], step),
        )
        for route in simple_routes(agent, m.remaining(_length(formula).graph.agents))
    )


def escape(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    bounds = _length(formula)
    return lambda agent, step: m.any(
        min(
            m.links_of(bounds.graph, route, step),
            m.all(m.of(body, at, step) for at in route),
            m.far_away(bounds, step, agent, route[-1]),
        )
        for route in simple_routes(agent, m.remaining(bounds.graph.agents))
    )


def surround(m: Meaning, formula: ir.Apply, inner: ir.Formula, border: ir.Formula) -> At:
    """``inner`` here, and no ``inner``-route that leads out of it where or how it must not."""
    bounds = _length(formula)
    most = math.inf
    if bounds.metric.name != "METRES":
        heavy = 1 if bounds.weight is None else max((bounds.weight.others, *(p.weight for p in bounds.weight.pairs)))
        most = (len(m.remaining(bounds.graph.agents)) - 1) * heavy

    def breaks(route: tuple[int, ...], step: int) -> Value:
        inside, last = [m.of(inner, at, step) for at in route], route[-1]
        leaves = min(m.all(inside[:-1]), m.no(inside[-1]))
        unguarded = min(leaves, m.no(m.of(border, last, step)), m.at_most(bounds, route, bounds.high, step))
        too_soon = m.false if bounds.low <= 0 else min(leaves, m.shorter(bounds, route, bounds.low, step))
        too_far = m.false
        if bounds.high < most:
            near = m.some_way(bounds, route[0], last, lambda way: m.at_most(bounds, way, bounds.high, step), step)
            too_far = min(m.all(inside), m.no(near))
        return min(m.links_of(bounds.graph, route, step), max(unguarded, too_soon, too_far))

    return lambda agent, step: min(
        m.of(inner, agent, step),
        m.all(m.no(breaks(route, step)) for route in simple_routes(agent, m.remaining(bounds.graph.agents))),
    )


def count(m: Meaning, formula: ir.Apply, body: ir.Formula) -> At:
    bounds = _length(formula)

    def compared(agent: int, step: int) -> Value:
        others = [other for other in m.remaining(bounds.graph.agents) if other != agent]
        each = [min(m.far_away(bounds, step, agent, other), m.of(body, other, step)) for other in others]
        if bounds.low <= 0:
            each.append(m.of(body, agent, step))
        at_least, more = m.so_many(each, formula.number), m.so_many(each, formula.number + 1)
        return {
            ">=": at_least,
            ">": more,
            "<": m.no(at_least),
            "<=": m.no(more),
            "=": min(at_least, m.no(more)),
        }[formula.comparison]

    return compared


def _length(formula: ir.Apply) -> ir.Length:
    assert isinstance(formula.bounds, ir.Length)
    return formula.bounds


MEANINGS: dict[str, Callable[..., At]] = {
    "always": always,
    "eventually": eventually,
    "until": until,
    "release": release,
    "once": once,
    "historically": historically,
    "since": since,
    "every": every,
    "next": next_,
    "arrives": arrives,
    "leaves": leaves,
    "not": not_,
    "and": and_,
    "or": or_,
    "implies": implies,
    "iff": iff,
    "reach": reach,
    "escape": escape,
    "somewhere": somewhere,
    "everywhere": everywhere,
    "surround": surround,
    "count": count,
}
