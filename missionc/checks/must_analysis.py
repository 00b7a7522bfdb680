"""Must analysis: the agents that a formula is surely true of, and surely false of, at every step of every plan.

Constants are folded: a formula and its negation, a region that covers the
world, a speed no agent has. Formulas with the same meaning on their face get
the same number, a formula and its negation opposite ones. Sets of agents are
the bits of a number.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import field
from typing import assert_never

from missionc.base.late_dataclass import dataclass
from missionc.checks.free_space import FreeSpace, Lies
from missionc.checks.literals import MOST_RULES, Literal, comparison, nowhere
from missionc.checks.route_conditions import ends_at_once, needed_here, needed_somewhere
from missionc.checks.value_ranges import of_comparison
from missionc.ir import (
    Agent,
    Apply,
    AtLeastOf,
    Belongs,
    Compare,
    Connected,
    Formula,
    Holds,
    InFormation,
    Inside,
    Length,
    OfAgent,
    Predicate,
    Touches,
    Truth,
)
from missionc.kernel.nodes import All, Always, Any, Eventually, Node, Not, Release, Until
from missionc.kernel.normal_form import dual
from missionc.language.walk_formulas import bits_of, formulas, meaning

TRUE, FALSE = 1, -1
"""The numbers of what is simply true, and false."""

MOST_MEMBERS = 64
"""Parts of a conjunction that are compared with one another."""


@dataclass(frozen=True, slots=True)
class Sure:
    """The agents of whom a formula is surely true, and surely false; ``number`` says which formulas are the same."""

    number: int
    true: int
    false: int

    @property
    def opposite(self) -> Sure:
        return Sure(-self.number, self.false, self.true)


@dataclass(slots=True, eq=False)
class MustAnalysis:
    """What is sure of the formulas of a mission; ``everyone`` is the bits of all agents."""

    ground: FreeSpace
    everyone: int
    kinds: tuple[tuple[Agent, int], ...]
    """One agent of each kind (those alike in all but name), and the bits of all of that kind."""
    sure: dict[Formula, Sure] = field(default_factory=dict)
    numbers: dict[Hashable, int] = field(default_factory=dict)
    members: dict[int, frozenset[int]] = field(default_factory=dict)
    predicates: dict[Predicate, tuple[int, int]] = field(default_factory=dict)


def must_analysis(ground: FreeSpace) -> MustAnalysis:
    """The must analysis of every formula in the mission's goals."""
    agents = ground.mission.agents
    kinds: dict[Hashable, tuple[Agent, int]] = {}
    for agent in agents:
        key = (agent.radius, agent.dynamics, agent.altitude)
        first, bits = kinds.get(key, (agent, 0))
        kinds[key] = (first, bits | 1 << agent.index)
    known = MustAnalysis(ground, (1 << len(agents)) - 1, tuple(kinds.values()))
    for formula in formulas(ground.mission):
        known.sure[formula] = _of_formula(known, formula)
    return known


def _of_formula(known: MustAnalysis, formula: Formula) -> Sure:
    match formula:
        case Truth(value):
            return _made(known, TRUE, known.everyone, 0) if value else _made(known, FALSE, 0, known.everyone)
        case Holds(predicate):
            return _made(known, _number_of_predicate(known, predicate), *_of_predicate(known, predicate))
        case Belongs(agents):
            bits = bits_of(agents.agents)
            return _made(known, _number(known, ("belongs", agents.agents)), bits, known.everyone & ~bits)
        case Apply() if formula.operator.spatial:
            return _of_route(known, formula)
        case Apply():
            node, places = meaning(formula)
            operands = (known.sure[operand] for operand in formula.operands)
            return _of_node(known, node, dict(zip(places, operands, strict=True)))
        case AtLeastOf(_, number, agents, body):
            return _of_enough(known, number, agents.agents, known.sure[body])
        case OfAgent(agent, body):
            return _of_enough(known, 1, (agent,), known.sure[body])
        case _:
            assert_never(formula)


def _made(known: MustAnalysis, number: int, true: int, false: int) -> Sure:
    """With the number of what is simply true or false, where it is so of everyone."""
    if number == TRUE or true == known.everyone:
        return Sure(TRUE, known.everyone, 0)
    if number == FALSE or false == known.everyone:
        return Sure(FALSE, 0, known.everyone)
    return Sure(number, true, false)


def _number(known: MustAnalysis, key: Hashable) -> int:
    return known.numbers.setdefault(key, len(known.numbers) + 2)


def _number_of_predicate(known: MustAnalysis, predicate: Predicate) -> int:
    """A comparison and the one that denies it (``x <= 3``, ``x > 3``) get opposite numbers."""
    opposite = comparison(Literal(predicate, False))
    if opposite in known.numbers:
        return -known.numbers[opposite]
    return _number(known, predicate)


def _of_enough(known: MustAnalysis, number: int, agents: tuple[int, ...], body: Sure) -> Sure:
    """At least so many of the agents have the body."""
    bits, size = bits_of(agents), len(agents)
    if 2 * number <= size:
        key = -_number(known, ("enough", size - number + 1, agents, -body.number))
    else:
        key = _number(known, ("enough", number, agents, body.number))
    holds = (body.true & bits).bit_count() >= number
    fails = size - (body.false & bits).bit_count() < number
    return _made(known, key, known.everyone if holds else 0, known.everyone if fails else 0)


def _of_route(known: MustAnalysis, formula: Apply) -> Sure:
    length = formula.bounds
    assert isinstance(length, Length)
    operands = tuple(known.sure[operand] for operand in formula.operands)
    bounds = (length.graph, length.metric, length.low, length.high)
    numbers = tuple(operand.number for operand in operands)
    name = formula.operator.name
    key = _number(known, (name, numbers, bounds, formula.comparison, formula.number))
    true = false = 0
    for operand, sign in needed_here(formula, True):
        false |= known.sure[operand].false if sign else known.sure[operand].true
    for operand, sign in needed_here(formula, False):
        true |= known.sure[operand].false if sign else known.sure[operand].true
    linked = bits_of(length.graph.agents)
    for operand in needed_somewhere(formula):
        never = known.sure[operand].false
        if never & linked == linked:
            false |= never if ends_at_once(formula) else known.everyone
    if name == "everywhere" and operands[0].number == TRUE:
        true = known.everyone
    if name == "count":
        more, fewer = _of_count(formula)
        true, false = (known.everyone if more else 0), (known.everyone if fewer else 0)
    return _made(known, key, true & ~false, false & ~true)


def _of_count(formula: Apply) -> tuple[bool, bool]:
    """Whether a count is within its comparison, or beside it, however many agents there are to count."""
    assert isinstance(formula.bounds, Length)
    most, number = len(formula.bounds.graph.agents) + 1, formula.number
    match formula.comparison:
        case ">=":
            return number <= 0, number > most
        case ">":
            return number < 0, number >= most
        case "<=":
            return number >= most, number < 0
        case "<":
            return number > most, number <= 0
        case _:
            return False, number > most or number < 0


# ------------------------------------------------- temporal and Boolean words


def _of_node(known: MustAnalysis, node: Node, operands: Mapping[Node, Sure]) -> Sure:
    if node in operands:
        return operands[node]
    match node:
        case Not(body):
            return _of_node(known, body, operands).opposite
        case All(parts):
            return _of_all(known, [_of_node(known, part, operands) for part in parts])
        case Any(parts):
            return _of_all(known, [_of_node(known, part, operands).opposite for part in parts]).opposite
        case Always(body, low, high):
            return _of_window(known, _of_node(known, body, operands), low, high)
        case Eventually(body, low, high):
            return _of_window(known, _of_node(known, body, operands).opposite, low, high).opposite
        case Until(hold, end, low, high):
            held, ended = _of_node(known, hold, operands), _of_node(known, end, operands)
            key = _number(known, ("until", held.number, ended.number, low, high))
            if low == 0:
                return _made(known, key, ended.true, ended.false)
            return _made(known, key, held.true & ended.true, held.false | ended.false)
        case Release():
            return _of_node(known, dual(node, (Not(node.hold), Not(node.end))), operands).opposite
        case _:
            return Sure(_number(known, ("other", node)), 0, 0)


def _of_window(known: MustAnalysis, body: Sure, low: int, high: int | None) -> Sure:
    if low == high == 0:
        return body
    return _made(known, _number(known, ("throughout", body.number, low, high)), body.true, body.false)


def _of_all(known: MustAnalysis, parts: list[Sure]) -> Sure:
    """The conjunction: flat, without what is simply true, false where it holds a part and its negation."""
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
    """Whether a part's negation is there too, whole or spelt out in its own parts."""
    return -number in numbers or (number < 0 and known.members.get(-number, frozenset((0,))) <= numbers)


# ------------------------------------------------------------------ predicates


def _of_predicate(known: MustAnalysis, predicate: Predicate) -> tuple[int, int]:
    if predicate not in known.predicates:
        known.predicates[predicate] = _bits(known, predicate)
    return known.predicates[predicate]


def _bits(known: MustAnalysis, predicate: Predicate) -> tuple[int, int]:
    match predicate:
        case Connected() | InFormation():
            return 0, 0
        case Inside(region) | Touches(region):
            if known.ground.lies(region.shape) is not Lies.OPEN:
                return 0, 0  # said of the region itself
        case Compare():
            pass
        case _:
            assert_never(predicate)
    true = false = 0
    for agent, bits in known.kinds:
        holds, fails = _of_kind(known, predicate, agent)
        true, false = true | (bits if holds else 0), false | (bits if fails else 0)
    return true, false


def _of_kind(known: MustAnalysis, predicate: Predicate, agent: Agent) -> tuple[bool, bool]:
    """Whether agents of this kind surely have the predicate, and surely not."""
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
    return nowhere(places.rule(literal.opposite), free), nowhere(places.rule(literal), free)
