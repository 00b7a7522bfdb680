"""Necessary conditions of a formula: the facts about agents and steps that hold in every plan that satisfies it.

Facts may be missing, but each fact holds in every plan that satisfies the formula.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from itertools import chain
from typing import assert_never

from missionc.base.late_dataclass import Record, dataclass
from missionc.base.source import Span
from missionc.frontend.checks.literals import Literal
from missionc.ir import AtLeastOf, Holds, Mission
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import children
from missionc.ir.language.walk_formulas import bits_of

EVER = 1 << 40
"""Step number that is later than any mission's last step."""

MOST_VISITS = 20_000
"""Maximum number of visits to formulas, each with agents and steps; further visits are omitted."""


class AtLeastAgents(Record):
    """Statement about at least ``number`` of some agents.

    ``bits`` is the bit set of the agents, and ``words`` the text.
    """

    number: int
    bits: int
    words: str
    agents: tuple[int, ...] = field(default=(), compare=False)


THE_TEAM = AtLeastAgents(0, 0, "the team")
ITSELF = AtLeastAgents(1, 0, "the agent")
"""The single agent for which a formula is evaluated, whichever agent it is."""


class StepWindow(Record):
    """Steps at which a fact holds: for every ``s`` from 0 to ``repeats``, at some step from ``low + s`` to ``high +
    s``.

    So ``low == high`` means "at every step from low to low + repeats", and ``repeats == 0`` means "at some step from
    low to high".
    """

    low: int
    high: int
    repeats: int

    def throughout(self, low: int, high: int | None, last: int | None) -> Iterator[StepWindow]:
        """Yield windows of an operand that holds at all steps from ``low`` to ``high`` ahead of each step of this
        window.
        """
        if high is None:
            high = low if last is None else max(last - self.high - self.repeats, low)
        yield StepWindow(self.low + low, self.high + low, self.repeats + high - low)
        if self.low < self.high and self.high - self.low <= high - low:
            yield StepWindow(self.high + low, self.high + low, self.repeats + self.low + high - self.high - low)

    def sometime(self, low: int, high: int | None, last: int | None) -> StepWindow:
        """Window of an operand that holds at some step from ``low`` to ``high`` ahead of a step of this window."""
        if high is not None:
            return StepWindow(self.low + low, self.high + high, self.repeats)
        return StepWindow(self.low + self.repeats + low, EVER if last is None else last, 0)

    def in_the_past(self, low: int, high: int, every: bool) -> Iterator[StepWindow]:
        """Yield windows of a past operator's operand; none if its window includes steps before 0."""
        if every and self.low == self.high:
            first, last = max(self.low + low, 0), self.low + self.repeats + high
            if first <= last:
                yield StepWindow(first, first, last - first)
        elif not every and (self.low + low >= 0 or self.repeats == 0) and self.high + high >= 0:
            yield StepWindow(max(self.low + low, 0), self.high + high, self.repeats)


AT_ONCE = StepWindow(0, 0, 0)


class Order(Record):
    """Order of the quantifiers over agents and steps in a fact.

    ``anew`` is True if the agents may differ from step to step, ``each`` if every agent has a step of its own.
    """

    anew: bool = False
    each: bool = False


class Fact(Record):
    """Literal that holds for the agents ``who`` at the steps ``when``; ``span`` is its source text."""

    literal: Literal
    who: AtLeastAgents
    when: StepWindow
    span: Span
    order: Order = Order()


class Instant(Record):
    """Formula that holds at some unknown step for some agent or for the team."""

    formula: k.Node
    who: AtLeastAgents


@dataclass(slots=True)
class Necessary:
    facts: list[Fact] = field(default_factory=list)
    instants: dict[Instant, None] = field(default_factory=dict)


class Visit(Record):
    formula: k.Node
    who: AtLeastAgents
    when: StepWindow
    order: Order = Order()


@dataclass(slots=True, eq=False)
class NecessaryConditions:
    """Computes the necessary conditions of the formulas of a mission.

    ``quantified`` and ``held`` are the nodes and negations that came from a quantifier and from a predicate.
    """

    mission: Mission
    quantified: Mapping[k.Node, AtLeastOf]
    held: Mapping[k.Node, tuple[Literal, Span]]
    visits: int = 0

    @staticmethod
    def of(mission: Mission, kernel: k.Kernel) -> NecessaryConditions:
        quantified: dict[k.Node, AtLeastOf] = {}
        held: dict[k.Node, tuple[Literal, Span]] = {}
        for formula, node in kernel.meanings.items():
            for each, positive in ((node, True), (kernel.opposites.get(node), False)):
                match formula:
                    case AtLeastOf() if each is not None:
                        quantified[each] = formula
                    case Holds(predicate) if each is not None:
                        held[each] = Literal(predicate, positive), formula.span
        return NecessaryConditions(mission, quantified, held)

    def of_requirement(self, formula: k.Node) -> Necessary:
        """Necessary conditions of a requirement's formula, at step 0."""
        return self._gathered(Visit(formula, THE_TEAM, AT_ONCE), self.mission.steps)

    def of_instant(self, instant: Instant) -> Necessary:
        """Necessary conditions of a formula that holds at an unknown step, in steps relative to it."""
        return self._gathered(Visit(instant.formula, instant.who, AT_ONCE), None)

    def _gathered(self, root: Visit, last: int | None) -> Necessary:
        gathered = Necessary()
        seen: set[Visit] = set()
        stack = [root]
        while stack and self.visits < MOST_VISITS:
            visit = stack.pop()
            if visit in seen:
                continue
            seen.add(visit)
            self.visits += 1
            stack.extend(reversed(list(self._below(visit, last, gathered))))
        return gathered

    def _below(self, visit: Visit, last: int | None, gathered: Necessary) -> Iterator[Visit]:
        """Yield visits of the operands that must hold if the visited formula holds; a literal is recorded as a fact."""
        node, who, when, order = visit.formula, visit.who, visit.when, visit.order
        if node in self.held:
            literal, span = self.held[node]
            whom = THE_TEAM if literal.predicate.about_team else who
            gathered.facts.append(Fact(literal, whom, when, span, order))
        elif node in self.quantified:
            yield from self._of_agents(node, self.quantified[node], when, gathered)
        elif isinstance(node, k.At):
            name = self.mission.agents[node.agent].name
            yield Visit(node.body, AtLeastAgents(1, 1 << node.agent, f"`{name}`", (node.agent,)), when)
        else:
            for body, then in _needs(node, when, last):
                if then.low < then.high and when.low == when.high:
                    gathered.instants[Instant(body, THE_TEAM if who == THE_TEAM else ITSELF)] = None
                own = order.each or then.high - then.low > when.high - when.low
                yield Visit(body, who, then, Order(order.anew, own))

    def _of_agents(self, node: k.Node, formula: AtLeastOf, when: StepWindow, gathered: Necessary) -> Iterator[Visit]:
        assert isinstance(node, k.All | k.Any | k.AtLeast)
        agents, size = formula.agents.agents, len(node.parts)
        enough = size if isinstance(node, k.All) else 1 if isinstance(node, k.Any) else node.count
        if not 0 < enough <= size:
            return
        part = node.parts[0]
        assert isinstance(part, k.At)
        if enough < size:
            gathered.instants[Instant(part.body, ITSELF)] = None
        those = AtLeastAgents(enough, bits_of(agents), _words(enough, size, formula.agents.name), agents)
        yield Visit(part.body, those, when, Order(anew=enough < size and when.repeats > 0))


def _needs(node: k.Node, when: StepWindow, last: int | None) -> Iterator[tuple[k.Node, StepWindow]]:
    """Yield nodes that must hold for the same agent if the node holds in a window, each with its window."""
    match node:
        case k.All(parts):
            yield from ((part, when) for part in parts)
        case k.Any(parts) if parts:
            yield from ((part, when) for part in _in_each(_conjuncts(part) for part in parts))
        case k.WindowNode(_, low, high) | k.UntilNode(_, _, low, high) if high is not None and low < 0:
            end = children(node)[-1]
            if isinstance(node, k.UntilNode) and node.every:
                yield from ((end, when) for _ in range(high == 0))
            elif last is not None:  # if steps are relative to an unknown one, those before it are unknown
                yield from ((end, then) for then in when.in_the_past(low, high, node.every))
        case k.WindowNode(body, low, high) if node.every:
            yield from ((body, then) for then in when.throughout(low, high, last))
        case k.WindowNode(body, low, high):
            yield body, when.sometime(low, high, last)
        case k.UntilNode(hold, end, low, high) if not node.every:
            yield end, when.sometime(low, high, last)
            if low > 0:
                yield from ((hold, then) for then in when.throughout(0, low - 1, last))
        case k.ReachNode() | k.RouteNode() if not node.every:
            yield from ((part, when) for part in _of_route(node))
        case k.UntilNode(_, end) | k.ReachNode(_, _, end) | k.RouteNode(_, _, end) if node.low <= 0:
            yield end, when
        case (
            k.Any()
            | k.LeafNode()
            | k.Not()
            | k.AtLeast()
            | k.At()
            | k.UntilNode()
            | k.NeighbourNode()
            | k.ReachNode()
            | k.RouteNode()
        ):
            return
        case _:
            assert_never(node)


def _of_route(node: k.ReachNode | k.RouteNode) -> Iterable[k.Node]:
    """Nodes that must hold for the first agent of a route.

    A route that may have no links requires the common conjuncts of ``through`` and ``end``, any other route
    ``through``.
    """
    if node.low > 0:
        return (node.through,)
    return _in_each((_parts(node.through), _parts(node.end)))


def _in_each(alternatives: Iterable[Mapping[k.Node, None]]) -> Iterable[k.Node]:
    """Nodes that occur in all of the alternatives, in the order of the first."""
    first, *others = alternatives
    return [node for node in first if all(node in other for other in others)]


def _parts(node: k.Node) -> dict[k.Node, None]:
    """The formula and all of its conjuncts."""
    found: dict[k.Node, None] = {}
    stack = [node]
    while stack:
        part = stack.pop()
        if part not in found:
            found[part] = None
            stack.extend(reversed(part.parts) if isinstance(part, k.All) else ())
    return found


def _conjuncts(node: k.Node) -> dict[k.Node, None]:
    """The formula and all of its conjuncts, including conditions that routes imply."""
    found = _parts(node)
    routes = [part for part in found if isinstance(part, k.ReachNode | k.RouteNode) and not part.every]
    return found | dict.fromkeys(chain.from_iterable(map(_of_route, routes)))


def _words(number: int, size: int, name: str) -> str:
    if number == size:
        return f"`{name}`" if size == 1 else f"every `{name}`"
    return f"some `{name}`" if number == 1 else f"{number} of `{name}`"


def meeting(one: Fact, other: Fact) -> tuple[int, int] | None:
    """Range of steps that certainly contains a step at which both facts hold for one agent.

    None without such a range.
    """
    if not _same_agent(one.who, other.who) or _may_miss(one, other) or _may_miss(other, one):
        return None
    return same_step(one.when, other.when)


def _same_agent(one: AtLeastAgents, other: AtLeastAgents) -> bool:
    """Return whether some agent is certainly in both sets, if both are chosen once or for the same step."""
    if THE_TEAM in (one, other) or ITSELF in (one, other):
        return one == other
    return one.number + other.number > (one.bits | other.bits).bit_count()


def _may_miss(one: Fact, other: Fact) -> bool:
    """Return whether the first fact may hold for other agents at the steps of the second, which differ by agent."""
    return one.order.anew and other.order.each and other.when.low < other.when.high


def same_step(one: StepWindow, other: StepWindow) -> tuple[int, int] | None:
    """Range of steps that certainly contains a step at which both facts hold; None without such a range."""
    for steady, any_of in ((one, other), (other, one)):
        if steady.low == steady.high:
            first, last = steady.low, steady.low + steady.repeats
            shift = max(0, first - any_of.low)
            if shift <= min(any_of.repeats, last - any_of.high):
                return any_of.low + shift, any_of.high + shift
    return None
