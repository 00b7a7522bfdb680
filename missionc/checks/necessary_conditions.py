"""Necessary conditions of a formula: the facts about agents and steps that hold in every plan that satisfies it.

Only what follows for certain is kept. So a fact may be missing, but each holds
in every plan that satisfies the formula.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import assert_never

from missionc.base.late_dataclass import dataclass
from missionc.base.source import Span
from missionc.checks.literals import Literal
from missionc.checks.route_conditions import needed_here
from missionc.ir import Apply, AtLeastOf, Belongs, Formula, Holds, Mission, OfAgent, Truth
from missionc.kernel.nodes import (
    All,
    Always,
    Any,
    At,
    AtLeast,
    Atom,
    Eventually,
    EveryNeighbour,
    EveryReach,
    EveryRoute,
    Is,
    Neighbour,
    Node,
    Not,
    PathLength,
    Reach,
    Release,
    Route,
    Until,
)
from missionc.language.walk_formulas import bits_of, meaning

EVER = 1 << 40
"""A step later than any mission's last."""

MOST_VISITS = 20_000
"""Formulas looked at, each with whom and when; a mission with more has its later facts left out."""


@dataclass(frozen=True, slots=True)
class Those:
    """At least ``number`` of the agents, who are ``bits`` too; ``words`` says so."""

    number: int
    bits: int
    words: str
    agents: tuple[int, ...] = field(default=(), compare=False)


THE_TEAM = Those(0, 0, "the team")
ITSELF = Those(1, 0, "the agent")
"""The one agent, whichever it is, that a formula is asked of."""


@dataclass(frozen=True, slots=True)
class When:
    """For every ``s`` from 0 to ``repeats``, at some step from ``low + s`` to ``high + s``.

    So ``low == high`` says "at every step from low to low + repeats", and no
    repeats "at some step from low to high".
    """

    low: int
    high: int
    repeats: int

    def throughout(self, low: int, high: int | None, last: int | None) -> Iterator[When]:
        """When something holds that holds at all of the steps from ``low`` to ``high`` ahead of each of these."""
        if high is None:
            high = low if last is None else max(last - self.high - self.repeats, low)
        yield When(self.low + low, self.high + low, self.repeats + high - low)
        if self.low < self.high and self.high - self.low <= high - low:
            yield When(self.high + low, self.high + low, self.repeats + self.low + high - self.high - low)

    def sometime(self, low: int, high: int | None, last: int | None) -> When:
        """When something holds that holds at some step from ``low`` to ``high`` ahead of one of these."""
        if high is not None:
            return When(self.low + low, self.high + high, self.repeats)
        return When(self.low + self.repeats + low, EVER if last is None else last, 0)


AT_ONCE = When(0, 0, 0)


@dataclass(frozen=True, slots=True)
class Fact:
    """The literal holds of those agents then; ``span`` is its words."""

    literal: Literal
    who: Those
    when: When
    span: Span


@dataclass(frozen=True, slots=True)
class Instant:
    """A formula that holds somewhere at some step, of an agent or of the team, though it is not known when or whose."""

    formula: Formula
    positive: bool
    who: Those


@dataclass(slots=True)
class NecessaryConditions:
    facts: list[Fact] = field(default_factory=list)
    instants: dict[Instant, None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Visit:
    formula: Formula
    positive: bool
    who: Those
    when: When


def necessary_conditions(mission: Mission, formula: Formula) -> NecessaryConditions:
    """The necessary facts of a requirement's formula, at step 0."""
    return _gather(mission, Visit(formula, True, THE_TEAM, AT_ONCE), mission.steps)


def gather_instant(mission: Mission, instant: Instant) -> NecessaryConditions:
    """The necessary facts of a formula that holds at an unknown step, in steps from there."""
    return _gather(mission, Visit(instant.formula, instant.positive, instant.who, AT_ONCE), None)


def _gather(mission: Mission, root: Visit, last: int | None) -> NecessaryConditions:
    gathered = NecessaryConditions()
    seen: set[Visit] = set()
    stack = [root]
    while stack and len(seen) < MOST_VISITS:
        visit = stack.pop()
        if visit in seen:
            continue
        seen.add(visit)
        stack.extend(reversed(list(_below(mission, visit, last, gathered))))
    return gathered


def _below(mission: Mission, visit: Visit, last: int | None, gathered: NecessaryConditions) -> Iterator[Visit]:
    """What must hold of the formulas below, for the visited one to hold."""
    formula, positive, who, when = visit.formula, visit.positive, visit.who, visit.when
    match formula:
        case Truth() | Belongs():
            return
        case Holds(predicate, span):
            whom = THE_TEAM if predicate.about_team else who
            gathered.facts.append(Fact(Literal(predicate, positive), whom, when, span))
        case Apply() if formula.operator.spatial:
            for operand, sign in needed_here(formula, positive):
                yield Visit(operand, sign, who, when)
        case Apply():
            node, places = meaning(formula)
            operands: dict[Node, Formula] = dict(zip(places, formula.operands, strict=True))
            for below in _of_node(node, operands, visit, last):
                if below.when.low < below.when.high and when.low == when.high:
                    gathered.instants[Instant(below.formula, below.positive, _anyone(who))] = None
                yield below
        case AtLeastOf(_, number, agents, body, _):
            size = len(agents.agents)
            enough = number if positive else size - number + 1
            if 0 < enough <= size:
                if enough < size:
                    gathered.instants[Instant(body, positive, ITSELF)] = None
                words = _words(enough, size, agents.name)
                yield Visit(body, positive, Those(enough, bits_of(agents.agents), words, agents.agents), when)
        case OfAgent(agent, body, _):
            yield Visit(body, positive, Those(1, 1 << agent, f"`{mission.agents[agent].name}`", (agent,)), when)
        case _:
            assert_never(formula)


def _of_node(node: Node, operands: Mapping[Node, Formula], visit: Visit, last: int | None) -> Iterator[Visit]:
    """What an operator's kernel form says of its operands."""
    positive, when = visit.positive, visit.when

    def under(body: Node, sign: bool, then: When) -> Iterator[Visit]:
        return _of_node(body, operands, Visit(visit.formula, sign, visit.who, then), last)

    if node in operands:
        yield Visit(operands[node], positive, visit.who, when)
        return
    match node:
        case Not(body):
            yield from under(body, not positive, when)
        case All(parts) | Any(parts):
            if isinstance(node, All) is positive or len(parts) == 1:
                for part in parts:
                    yield from under(part, positive, when)
        case Always(body, low, high) | Eventually(body, low, high):
            if isinstance(node, Always) is positive:
                for then in when.throughout(low, high, last):
                    yield from under(body, positive, then)
            else:
                yield from under(body, positive, when.sometime(low, high, last))
        case Until(hold, end, low, high) | Release(hold, end, low, high):
            if isinstance(node, Until) is positive:
                yield from under(end, positive, when.sometime(low, high, last))
                if low > 0:
                    for then in when.throughout(0, low - 1, last):
                        yield from under(hold, positive, then)
            elif low == 0:
                yield from under(end, positive, when)
        case Atom() | Is() | AtLeast() | At() | PathLength():
            return
        case Neighbour() | EveryNeighbour() | Reach() | EveryReach() | Route() | EveryRoute():
            return
        case _:
            assert_never(node)


def _anyone(who: Those) -> Those:
    return THE_TEAM if who == THE_TEAM else ITSELF


def _words(number: int, size: int, name: str) -> str:
    if number == size:
        return f"`{name}`" if size == 1 else f"every `{name}`"
    return f"some `{name}`" if number == 1 else f"{number} of `{name}`"


def same_agent(one: Those, other: Those) -> bool:
    """Whether some agent is certainly among both, at every step."""
    if THE_TEAM in (one, other) or ITSELF in (one, other):
        return one == other
    return one.number + other.number > (one.bits | other.bits).bit_count()


def same_step(one: When, other: When) -> tuple[int, int] | None:
    """The steps among which there is certainly one at which both hold."""
    for steady, any_of in ((one, other), (other, one)):
        if steady.low == steady.high:
            first, last = steady.low, steady.low + steady.repeats
            shift = max(0, first - any_of.low)
            if shift <= min(any_of.repeats, last - any_of.high):
                return any_of.low + shift, any_of.high + shift
    return None
