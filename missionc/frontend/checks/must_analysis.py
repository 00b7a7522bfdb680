"""Must analysis: agents for which a formula is certainly true or false at every step of every plan.

Constants are folded: a formula and its negation, a region that covers the world, a speed that no agent has. Formulas
that are equal syntactically get the same number, a formula and its negation opposite numbers. Sets of agents are the
bits of a number.

Value ranges of comparisons: interval bounds on the difference of their two sides, for every plan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterable
from dataclasses import field
from typing import assert_never

from missionc import ir
from missionc.base.late_dataclass import Record, dataclass
from missionc.frontend.checks.free_space import Containment, FreeSpace
from missionc.frontend.checks.literals import MOST_RULES, Literal, comparison_literal, nowhere_literal
from missionc.geometry.configuration_space import empty
from missionc.ir import Agent, Compare, Formula, Graph, Holds, Predicate
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import children, postorder
from missionc.ir.language.walk_formulas import bits_of
from missionc.ir.wording import number


class Range(Record):
    """Closed interval of real numbers from ``low`` to ``high``."""

    low: float
    high: float

    def __add__(self, other: Range) -> Range:
        return Range(self.low + other.low, self.high + other.high)

    def scaled(self, weight: float) -> Range:
        ends = (self.low * weight, self.high * weight)
        return Range(min(ends), max(ends))


def of_comparison(ground: FreeSpace, agent: ir.Agent, comparison: ir.Compare) -> Range:
    """Range of a comparison's difference, which must be at least 0, for an agent and all others of its kind."""
    total = Range(comparison.constant, comparison.constant)
    for weight, feature in comparison.terms:
        total += of_feature(ground, agent, feature).scaled(weight)
    return total


def of_feature(ground: FreeSpace, agent: ir.Agent, feature: ir.Feature) -> Range:
    """Range of a state or a distance, in SI units, for an agent and all others of its kind."""
    mission = ground.mission
    low, high = mission.world.low, mission.world.high
    match feature:
        case ir.Coordinate(axis):
            return Range(low[axis], high[axis])
        case ir.Speed():
            return Range(agent.dynamics.lowest_speed, agent.dynamics.top_speed)
        case ir.Altitude():
            return Range(low[2], high[2]) if mission.dimension == 3 else Range(agent.altitude, agent.altitude)
        case ir.Level(resource):
            most = mission.horizon * (resource.per_second + resource.per_metre * agent.dynamics.top_speed)
            return Range(resource.start - most, resource.capacity)
        case ir.DistanceBetween(first, second):
            return _between(mission, first, second)
        case ir.DistanceTo(int()):
            return Range(0.0, math.dist(low, high))
        case ir.DistanceTo(ir.Beacon() as beacon):
            return Range(0.0, _farthest(mission, beacon.position, beacon.position))
        case ir.DistanceTo(region):
            assert isinstance(region, ir.Region)
            area = ground.atlas.outer(region.shape)
            if empty(area):
                return Range(-math.inf, math.inf)
            corners = ground.atlas.bounds(area)
            deepest = min(b - a for a, b in zip(*corners, strict=True)) / 2
            return Range(-deepest, _farthest(mission, *corners))


def _between(mission: ir.Mission, first: int, second: int) -> Range:
    if first == second:
        return Range(0.0, 0.0)
    bodies = mission.agents[first].radius + mission.agents[second].radius + mission.separation
    return Range(bodies, math.dist(mission.world.low, mission.world.high))


def _farthest(mission: ir.Mission, low: ir.Vector, high: ir.Vector) -> float:
    """Upper bound on the distance from a point of the world to a point in a box, metres."""
    spans = zip(mission.world.low, mission.world.high, low, high, strict=True)
    return math.hypot(*(max(d - a, b - c, 0.0) for a, b, c, d in spans))


def range_in_words(comparison: ir.Compare, values: Range) -> str:
    """Text for the range of the single state or distance in a comparison."""
    match comparison.terms:
        case ((weight, feature),) if weight != 0:
            both = (values + Range(-comparison.constant, -comparison.constant)).scaled(1 / weight)
            what = {ir.Speed: "the speed", ir.Altitude: "the altitude"}.get(type(feature), "the distance")
            if isinstance(feature, ir.Coordinate):
                what = f"`{'xyz'[feature.axis]}`"
            if isinstance(feature, ir.Level):
                what = f"`{feature.resource.name}`"
            low, high = number(round(both.low, 4)), number(round(both.high, 4))
            says = f"{what} is {low}" if low == high else f"{what} stays between {low} and {high}"
            return f"{says} {feature.unit}".rstrip()
        case _:
            return "the difference of both sides never changes sign"


TRUE, FALSE = 1, -1
"""Numbers of formulas that are constantly true and constantly false."""

MOST_MEMBERS = 64
"""Maximum number of operands of a conjunction that are compared with one another."""


class MustTruth(Record):
    """Bit sets of the agents for which a formula is certainly true, and certainly false.

    Formulas with equal ``number`` are equal.
    """

    number: int
    true: int
    false: int

    @property
    def opposite(self) -> MustTruth:
        return MustTruth(-self.number, self.false, self.true)


@dataclass(slots=True, eq=False)
class MustAnalysis:
    """Certain truth of the formulas in a mission; ``everyone`` is the bit set of all agents."""

    ground: FreeSpace
    kernel: k.Kernel
    everyone: int
    kinds: tuple[tuple[Agent, int], ...]
    """One agent of each kind (equal except for the name), and the bit set of all agents of that kind."""
    sure: dict[k.Node, MustTruth] = field(default_factory=dict)
    numbers: dict[Hashable, int] = field(default_factory=dict)
    members: dict[int, frozenset[int]] = field(default_factory=dict)
    predicates: dict[Predicate, tuple[int, int]] = field(default_factory=dict)

    def of(self, formula: Formula) -> MustTruth:
        """Certain truth of a formula of the resolved mission."""
        return self.sure[self.kernel.meanings[formula]]


def must_analysis(kernel: k.Kernel, ground: FreeSpace) -> MustAnalysis:
    """Certain truth of every formula in the mission's goals."""
    agents = ground.mission.agents
    kinds: dict[Hashable, tuple[Agent, int]] = {}
    for agent in agents:
        key = (agent.radius, agent.dynamics, agent.altitude)
        first, bits = kinds.get(key, (agent, 0))
        kinds[key] = (first, bits | 1 << agent.index)
    known = MustAnalysis(ground, kernel, (1 << len(agents)) - 1, tuple(kinds.values()))
    connected = _connected(known)
    for node in postorder(kernel.meanings.values()):
        known.sure[node] = connected.get(node) or _of_node(known, node, [known.sure[child] for child in children(node)])
    return known


def _connected(known: MustAnalysis) -> dict[k.Node, MustTruth]:
    """Certain truth of connectivity predicates: only that graphs with too few agents are connected.

    Such graphs get their own finding.
    """
    found: dict[k.Node, MustTruth] = {}
    for formula, node in known.kernel.meanings.items():
        if isinstance(formula, Holds) and formula.predicate.graph:
            found[node] = MustTruth(_number(known, formula.predicate), 0, 0)
            if node in known.kernel.opposites:
                found[known.kernel.opposites[node]] = found[node].opposite
    return found


def _of_node(known: MustAnalysis, node: k.Node, below: list[MustTruth]) -> MustTruth:
    match node:
        case k.Atom(predicate):
            return _made(known, _number_of_predicate(known, predicate), *_of_predicate(known, predicate))
        case k.Is(agents):
            bits = bits_of(tuple(sorted(agents)))
            return _made(known, _number(known, ("is", agents)), bits, known.everyone & ~bits)
        case k.PathLength(graph, agent, shortest, longest):
            return MustTruth(_number(known, ("length", graph, agent, shortest, longest)), 0, 0)
        case k.Not():
            return below[0].opposite
        case k.AtLeast(count):
            return _enough(known, count, below)
        case k.At(agent):
            return _at(known, agent, below[0])
        case k.All() | k.Any():
            return _of_pair(node.every, below, lambda parts: _conjunction(known, parts))
        case k.WindowNode(_, low, high):
            return _of_pair(node.every, below, lambda parts: _always(known, parts[0], low, high))
        case k.UntilNode(_, _, low, high):
            return _of_pair(not node.every, below, lambda parts: _until(known, parts, low, high))
        case k.NeighbourNode(graph):
            return _of_pair(not node.every, below, lambda parts: _neighbour(known, parts[0], graph))
        case k.ReachNode(graph, _, _, hops):
            return _of_pair(not node.every, below, lambda parts: _route(known, parts, graph, 0, hops))
        case k.RouteNode(graph, _, _, shortest, longest):
            return _of_pair(not node.every, below, lambda parts: _route(known, parts, graph, shortest, longest))
        case _:
            assert_never(node)


def _of_pair(itself: bool, below: list[MustTruth], sure: Callable[[list[MustTruth]], MustTruth]) -> MustTruth:
    """Certain truth of a node or of its dual, where ``sure`` handles the node itself."""
    return sure(below) if itself else sure(_opposites(below)).opposite


def _opposites(parts: Iterable[MustTruth]) -> list[MustTruth]:
    return [part.opposite for part in parts]


def _made(known: MustAnalysis, number: int, true: int, false: int) -> MustTruth:
    """Formula's certain truth with its number; the constants' own numbers if it is true, or false, for all agents.

    Args:
        known: analysis of the mission.
        number: number of the formula.
        true, false: bit sets of agents for which it is certainly true, or certainly false.
    """
    if number == TRUE or true == known.everyone:
        return MustTruth(TRUE, known.everyone, 0)
    if number == FALSE or false == known.everyone:
        return MustTruth(FALSE, 0, known.everyone)
    return MustTruth(number, true, false)


def _number(known: MustAnalysis, key: Hashable) -> int:
    return known.numbers.setdefault(key, len(known.numbers) + 2)


# ----------------------------------------------------- Boolean and temporal nodes


def _conjunction(known: MustAnalysis, parts: list[MustTruth]) -> MustTruth:
    """Certain truth of a flattened conjunction without true parts; false if it contains a part and its negation."""
    true, false = known.everyone, 0
    numbers: set[int] = set()
    for part in parts:
        true, false = true & part.true, false | part.false
        inner = known.members.get(part.number, frozenset((part.number,)))
        numbers |= inner if len(numbers) + len(inner) <= MOST_MEMBERS else {part.number}
    numbers.discard(TRUE)
    if FALSE in numbers or any(_denied(known, number, numbers) for number in numbers):
        return _made(known, FALSE, 0, known.everyone)
    if not numbers:
        return _made(known, TRUE, known.everyone, 0)
    if len(numbers) == 1:
        return _made(known, next(iter(numbers)), true, false)
    whole = frozenset(numbers)
    number = _number(known, whole)
    known.members[number] = whole
    return _made(known, number, true, false)


def _denied(known: MustAnalysis, number: int, numbers: set[int]) -> bool:
    """Return whether a part's negation is among ``numbers``, as one formula or split into its conjuncts."""
    return -number in numbers or (number < 0 and known.members.get(-number, frozenset((0,))) <= numbers)


def _enough(known: MustAnalysis, count: int, parts: list[MustTruth]) -> MustTruth:
    """Certain truth of "at least ``count`` parts", for parts that are equal for all agents.

    Small counts are computed by the negations.
    """
    if 2 * count <= len(parts):
        return _enough(known, len(parts) - count + 1, _opposites(parts)).opposite
    number = _number(known, ("enough", count, tuple(sorted(part.number for part in parts))))
    sure = sum(part.true == known.everyone for part in parts)
    lost = sum(part.false == known.everyone for part in parts)
    return _made(
        known, number, known.everyone if sure >= count else 0, known.everyone if len(parts) - lost < count else 0
    )


def _at(known: MustAnalysis, agent: int, body: MustTruth) -> MustTruth:
    number = _number(known, ("at", agent, abs(body.number)))
    there = known.everyone if body.true >> agent & 1 else 0, known.everyone if body.false >> agent & 1 else 0
    return _made(known, number if body.number > 0 else -number, *there)


def _always(known: MustAnalysis, body: MustTruth, low: int, high: int | None) -> MustTruth:
    if low == high == 0:
        return body
    number = _number(known, ("always", body.number, low, high))
    if high is not None and high < 0:  # the window may contain no step
        return _made(known, number, body.true, 0)
    return _made(known, number, body.true, body.false)


def _until(known: MustAnalysis, parts: list[MustTruth], low: int, high: int | None) -> MustTruth:
    hold, end = parts
    number = _number(known, ("until", hold.number, end.number, low, high))
    if low < 0:
        return _made(known, number, end.true if high == 0 else 0, end.false)
    if low == 0:
        return _made(known, number, end.true, end.false)
    return _made(known, number, hold.true & end.true, hold.false | end.false)


# ------------------------------------------------------------------ spatial nodes


def _neighbour(known: MustAnalysis, body: MustTruth, graph: Graph) -> MustTruth:
    number = _number(known, ("neighbour", graph, body.number))
    return _made(known, number, 0, _not_on_from(known, body, graph))


def _route(known: MustAnalysis, parts: list[MustTruth], graph: Graph, low: float, high: float) -> MustTruth:
    """Certain truth of a route operator.

    If no link is long enough, the agent is the end of its own route; otherwise the route continues to a neighbour.
    """
    through, end = parts
    number = _number(known, ("route", graph, through.number, end.number, low, high))
    stuck = through.false | _not_on_from(known, end, graph)
    if low > 0:
        return _made(known, number, 0, stuck)
    return _made(known, number, end.true, end.false & stuck)


def _not_on_from(known: MustAnalysis, end: MustTruth, graph: Graph) -> int:
    """Bit set of the agents that are linked to no agent for which the formula may be true."""
    linked = bits_of(graph.agents)
    return known.everyone if linked & ~end.false == 0 else known.everyone & ~linked


# ------------------------------------------------------------------ predicates


def _number_of_predicate(known: MustAnalysis, predicate: Predicate) -> int:
    """Number of a predicate; a comparison and its negation (``x <= 3``, ``x > 3``) get opposite numbers."""
    opposite = comparison_literal(Literal(predicate, False))
    if opposite in known.numbers:
        return -known.numbers[opposite]
    return _number(known, predicate)


def _of_predicate(known: MustAnalysis, predicate: Predicate) -> tuple[int, int]:
    if predicate not in known.predicates:
        known.predicates[predicate] = _bits(known, predicate)
    return known.predicates[predicate]


def _bits(known: MustAnalysis, predicate: Predicate) -> tuple[int, int]:
    if predicate.graph or predicate.formation:
        return 0, 0
    if predicate.region and known.ground.lies(predicate.region.shape) is not Containment.OPEN:
        return 0, 0  # a statement about the region itself
    true = false = 0
    for agent, bits in known.kinds:
        holds, fails = _of_kind(known, predicate, agent)
        true, false = true | (bits if holds else 0), false | (bits if fails else 0)
    return true, false


def _of_kind(known: MustAnalysis, predicate: Predicate, agent: Agent) -> tuple[bool, bool]:
    """Return whether the predicate is certainly true, and whether it is certainly false, for agents of this kind."""
    ground = known.ground
    if isinstance(predicate, Compare):
        values = of_comparison(ground, agent, predicate)
        slack = 1e-9 * max(1.0, abs(predicate.constant))
        holds = values.low > slack if predicate.strict else values.low >= 0
        fails = values.high < -slack
        if holds or fails or predicate.about_team:
            return holds, fails
    if len(known.predicates) >= MOST_RULES:
        return False, False
    places = ground.places([agent])
    literal, free = Literal(predicate, True), ground.free(agent.radius)
    return nowhere_literal(places.rule(literal.opposite), free), nowhere_literal(places.rule(literal), free)
