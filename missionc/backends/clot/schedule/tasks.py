"""Tasks: open choices of a mission's cost graph, as holds, events and options.

    in   Kernel, as a cost graph
    out  Outline

A condition at fixed steps is a ``Hold``. A condition at some step of a window is an ``Event``, and a recurrent
condition is a chain of events. If one of several conditions suffices, a ``Task`` has several ``Option``s. A choice that
is made at every step of a window stays one ``Hold`` and is left to the trajectory.

Source:
    The branching of [clot]'s disjunctions and windows, decided before the trajectory instead of by it.

Mutually exclusive literals of holds, and capacities: limits on the number of literals that are true at once.

A literal states that a predicate is true, or false, for an agent. A literal and its opposite are *mutex*, and so are
two predicates without a common position (``altitude <= 20 m`` and ``altitude >= 40 m``). ``always not (at least 3
truck: weigh)`` is a *capacity* of two, and ``always not (a and b)`` a capacity of one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import lru_cache
from itertools import combinations, cycle, islice, product
from math import comb, prod
from typing import TypeAlias

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.ir import Predicate
from missionc.ir.kernel.nodes import All, Any, At, AtLeast, Atom, Eventually, Kernel, Node, Not, WindowNode
from missionc.ir.kernel.walk import bottom_up, children, window_of

MOST_OPTIONS = 256
"""Maximum number of options of one task; if there are more, a fixed sample is used."""


class Hold(Record):
    """Condition ``node`` for ``agent`` at every step from ``low`` to ``high``, counted from the event or from step 0.

    ``timeless`` is true if the condition has no temporal operator, so that one configuration decides it.
    """

    agent: int
    node: Node
    low: int
    high: int
    timeless: bool


class Decision(Record):
    """Selected part, by index, of a node for an agent, at the steps ``low`` to ``high`` from the event (or step 0)."""

    node: Node
    agent: int
    part: int
    low: int
    high: int


class Event(Record):
    """Conditions that must be satisfied from some step in the window ``low`` to ``high`` on.

    Args:
        chooser: formula with this window, for ``agent``, evaluated at ``step``. Step and window count from the
            enclosing event, or from step 0.
        holds: conditions from the event's step on.
        before: conditions at each step up to the event.
        then: events that follow.
        not_before: earliest step, counted from step 0.
        again: True if the event belongs to a recurrence; the trajectory then decides which event each step awaits.
    """

    chooser: Node
    agent: int
    step: int
    low: int
    high: int
    holds: tuple[Hold, ...] = ()
    before: tuple[Hold, ...] = ()
    decisions: tuple[Decision, ...] = ()
    then: tuple[Event, ...] = ()
    not_before: int = 0
    again: bool = False


class Option(Record):
    holds: tuple[Hold, ...] = ()
    decisions: tuple[Decision, ...] = ()
    events: tuple[Event, ...] = ()

    @property
    def all_events(self) -> Iterator[Event]:
        """Yield the option's events and their successors."""
        left = list(self.events)
        while left:
            event = left.pop()
            yield event
            left.extend(event.then)


class Task(Record):
    """Task that is satisfied by any one of its options."""

    name: str
    options: tuple[Option, ...]


class Outline(Record):
    """Outline of a mission: unconditional holds, and tasks with options."""

    holds: tuple[Hold, ...]
    tasks: tuple[Task, ...]

    @property
    def options(self) -> Iterator[Option]:
        """Options of all tasks."""
        return (option for task in self.tasks for option in task.options)

    @property
    def fixed(self) -> list[Hold]:
        """Holds at fixed steps: unconditional holds, and the holds of all options."""
        return [*self.holds, *(hold for option in self.options for hold in option.holds)]

    @property
    def events(self) -> Iterator[Event]:
        """Events of all options, and their successors."""
        return (event for option in self.options for event in option.all_events)


def outline(graph: Kernel, steps: int) -> Outline:
    """Outline of a mission's requirements over steps 0 to ``steps``."""
    reader = _Reader(graph.formulas, steps)
    holds: list[Hold] = []
    tasks: list[Task] = []
    for wanted in graph.requirements:
        own: list[Task] = []
        for agent, part in conjuncts(0, wanted.formula):
            options = reader.options(part, agent, 0, 0, False)
            if len(options) == 1 and not options[0].events:
                holds.extend(options[0].holds)
            else:
                _add(own, Task(wanted.name, options))
        tasks.extend(own)
    return Outline(tuple(holds), tuple(tasks))


def _add(tasks: list[Task], task: Task) -> None:
    """Add a task, unless the events of another one, which then loses its options without events, imply it."""
    for number, each in enumerate(tasks):
        events = tuple(option for option in each.options if option.events)
        if events and all(any(_implies(one, other) for other in task.options) for one in events):
            tasks[number] = replace(each, options=events)
            return
    tasks.append(task)


def _implies(one: Option, other: Option) -> bool:
    """Return whether the single event of an option is that of another one, in a window within the other's."""
    if one.holds or other.holds or len(one.events) != 1 or len(other.events) != 1:
        return False
    (event,), (weaker,) = one.events, other.events
    same = (event.agent, event.holds, event.before, event.then) == (
        weaker.agent,
        weaker.holds,
        weaker.before,
        weaker.then,
    )
    within = weaker.low <= event.low and event.high <= weaker.high and weaker.not_before <= event.not_before
    return same and within and not (event.again or weaker.again)


def conjuncts(agent: int, node: Node) -> Iterator[tuple[int, Node]]:
    """Yield the formulas, with their agents, whose conjunction is a formula for an agent."""
    stack = [(agent, node)]
    while stack:
        agent, node = stack.pop()
        match node:
            case All(parts):
                stack.extend((agent, part) for part in reversed(parts))
            case At(other, body):
                stack.append((other, body))
            case _:
                yield agent, node


class _Reader:
    def __init__(self, roots: Iterable[Node], steps: int) -> None:
        self.steps = steps
        self.timeless = bottom_up(roots, lambda node, below: window_of(node) is None and all(below))

    def options(self, node: Node, agent: int, low: int, high: int, branch: bool) -> tuple[Option, ...]:
        """Options that satisfy a formula for an agent at all steps from ``low`` to ``high``."""
        match node:
            case All(parts):
                return self._together([self.options(part, agent, low, high, branch) for part in parts])
            case At(other, body):
                return self.options(body, other, low, high, branch)
            case Any(parts) if parts and (branch or (low == high and not self.timeless[node])):
                options = [
                    replace(option, decisions=(*option.decisions, Decision(node, agent, number, low, high)))
                    for number, part in enumerate(parts)
                    for option in self.options(part, agent, low, high, branch)
                ]
                return _some_of(options)
            case AtLeast(count, parts) if low == high and not self.timeless[node]:
                return self._some(parts, count, agent, low)
            case Any(parts) if (absorbing := _absorbing(parts)) is not None:
                return self.options(absorbing, agent, low, high, branch)
            case _ if (node.every or low == high) and (window := window_of(node)):
                return self._over_window(node, window, agent, low, high, branch)
            case WindowNode() if not branch:
                return self._again(node, agent, low, high)
            case _:
                return (Option((self._hold(node, agent, low, high),)),)

    def _over_window(
        self, node: Node, window: tuple[int, int | None], agent: int, low: int, high: int, branch: bool
    ) -> tuple[Option, ...]:
        *hold, end = children(node)
        first, last = window
        if not node.every:
            before = tuple(self._hold(part, who, low, low) for each in hold for who, part in conjuncts(agent, each))
            bodies = self.options(end, agent, 0, 0, True)
            return tuple(self._event(node, agent, low, first, last, option, before) for option in bodies)
        until = self.steps if last is None else min(high + last, self.steps)
        options = self.options(end, agent, low + first, until, branch)
        return (*options, *self._freed(node, window, agent, low)) if hold and low == high else options

    def _again(self, node: WindowNode, agent: int, low: int, high: int) -> tuple[Option, ...]:
        """Options with a chain of events for a condition that is awaited at every step from ``low`` to ``high``.

        The first event is in the first window, the last in the last window, and consecutive events are at most a
        window's width plus one step apart. All events are equal; the choice of agents may be open.
        """
        most_again = 40  # maximum number of events of a recurrence; others are left to the polish
        hold = self._hold(node, agent, low, high)
        most = self.steps if node.high is None else node.high
        first, last, apart = min(low + most, self.steps), high + node.low, most - node.low + 1
        count = 1 + max(0, -((first - last) // apart))
        if 2 * ((count - 1) * apart - (last - first)) < apart:
            count += 1  # the minimum number would leave no freedom for the times
        if count > most_again:
            return (Option((hold,)),)
        bodies = self.options(node.body, agent, 0, 0, True)
        chains = [(body,) * count for body in bodies]
        if len(bodies) > 1 and self.timeless[node.body]:  # another of several each time
            chains.append((Option((self._hold(node.body, agent, 0, 0),)),) * count)
        elif len(bodies) > 1:  # one after the other
            chains.extend(tuple(islice(cycle(bodies), turn, turn + count)) for turn in range(len(bodies)))
        options: list[Option] = []
        for chain in chains:
            then: tuple[Event, ...] = ()
            for number in range(count - 1, 0, -1):
                soonest, body = last - (count - 1 - number) * apart, chain[number]
                then = (*body.events, *then)
                then = (Event(node, agent, low, 1, apart, body.holds, then=then, not_before=soonest, again=True),)
            begin = max(low + node.low, last - (count - 1) * apart)
            then = (*chain[0].events, *then)
            event = Event(node, agent, low, begin, first, chain[0].holds, then=then, again=True)
            options.append(Option((hold,), (), (event,)))
        return _some_of(options)

    def _hold(self, node: Node, agent: int, low: int, high: int) -> Hold:
        return Hold(agent, node, low, high, self.timeless[node])

    def _freed(self, node: Node, window: tuple[int, int | None], agent: int, step: int) -> tuple[Option, ...]:
        """Options of ``release``: ``hold`` at some step before the window's last, and ``end`` from the window's first
        step up to that step."""
        (hold, end), (first, last) = children(node), window
        before = self._hold(end, agent, step + first, step + first)
        here = self._hold(end, agent, 0, 0)
        final = (self.steps - step if last is None else last) - 1
        options: list[Option] = []
        for option in self.options(hold, agent, 0, 0, True):
            if first > 0 and final >= 0:
                options.append(self._event(node, agent, step, 0, min(first - 1, final), option))
            if first <= final:
                also = replace(option, holds=(*option.holds, here))
                options.append(self._event(node, agent, step, first, final, also, (before,)))
        return tuple(options)

    def _event(
        self,
        node: Node,
        agent: int,
        step: int,
        first: int,
        last: int | None,
        body: Option,
        before: tuple[Hold, ...] = (),
    ) -> Option:
        high = self.steps if last is None else step + last
        event = Event(node, agent, step, step + first, high, body.holds, before, body.decisions, body.events)
        return Option(events=(event,))

    def _together(self, each: list[tuple[Option, ...]]) -> tuple[Option, ...]:
        """Combinations of one option from each list, up to a limit."""
        return tuple(
            Option(
                tuple(hold for option in chosen for hold in option.holds),
                tuple(decision for option in chosen for decision in option.decisions),
                tuple(event for option in chosen for event in option.events),
            )
            for chosen in _ways(each)
        )

    def _some(self, parts: tuple[Node, ...], count: int, agent: int, step: int) -> tuple[Option, ...]:
        """Options that satisfy ``count`` of the parts, up to a limit; the trajectory shows which parts, so no choice is
        recorded."""
        each = [self.options(part, agent, step, step, False) for part in parts]
        by_choice = [self._together([each[number] for number in chosen]) for chosen in _choices(len(parts), count)]
        return _some_of([option for options in by_choice for option in options])


def _absorbing(parts: tuple[Node, ...]) -> Node | None:
    """Part of ``p or eventually[0, d] p`` that the other implies; None for other disjunctions."""
    windows = (part for part in parts if isinstance(part, Eventually) and part.low == 0)
    return next((part for part in windows if all(each is part or _same(each, part.body) for each in parts)), None)


def _same(one: Node, other: Node) -> bool:
    """Return whether two formulas without temporal operators are written alike."""
    match one, other:
        case Atom(predicate), Atom(same):
            return predicate == same
        case Not(), Not():
            return _same(one.body, other.body)
        case (All(parts), All(others)) | (Any(parts), Any(others)):
            return len(parts) == len(others) and all(map(_same, parts, others))
        case _:
            return one is other


def _ways(each: list[tuple[Option, ...]]) -> Iterable[tuple[Option, ...]]:
    """Combinations of one element from each list, up to a limit: the first combination, and others drawn uniformly."""
    if prod(len(options) for options in each) <= MOST_OPTIONS:
        return product(*each)
    generator = np.random.default_rng(0)
    drawn = generator.integers(0, [len(options) for options in each], (MOST_OPTIONS - 1, len(each)))
    rows = dict.fromkeys([(0,) * len(each), *map(tuple, drawn.tolist())])
    return [tuple(options[number] for options, number in zip(each, row, strict=True)) for row in rows]


def _choices(parts: int, count: int) -> Iterable[tuple[int, ...]]:
    """Subsets of ``count`` parts, up to a limit: the first subset, and others drawn uniformly."""
    if comb(parts, count) <= MOST_OPTIONS:
        return combinations(range(parts), count)
    generator = np.random.default_rng(0)
    drawn = generator.permuted(np.tile(np.arange(parts), (MOST_OPTIONS - 1, 1)), axis=1)[:, :count]
    return dict.fromkeys([tuple(range(count)), *map(tuple, np.sort(drawn, axis=1).tolist())])


def _some_of(options: list[Option]) -> tuple[Option, ...]:
    """All options, or if there are too many, a limited number spread evenly from the first to the last."""
    if len(options) <= MOST_OPTIONS:
        return tuple(options)
    return tuple(options[number] for number in np.linspace(0, len(options) - 1, MOST_OPTIONS).astype(np.int64))


Literal: TypeAlias = tuple[int, Predicate, bool]
"""Literal: an agent (-1 for the team), a predicate and its truth."""

TEAM = -1

KNOWN = 4096
"""Maximum number of cached sets of literals."""

ROUNDING = 1e-6
"""Seconds below which differences do not count."""


class TimedLiterals(Record):
    """Literals that a hold requires at all times from ``low`` to ``high`` seconds, both included.

    ``gap``: time before and after, seconds, in which the literals are also true.
    """

    literals: frozenset[Literal]
    low: float
    high: float
    gap: float = 0.0

    def shifted(self, by: float) -> TimedLiterals:
        return TimedLiterals(self.literals, self.low + by, self.high + by, self.gap)

    def mutex_time(self, other: TimedLiterals) -> float | None:
        """Duration, seconds, for which these literals are mutex with the others; None if never, 0 for a single time."""
        both = min(self.high + self.gap, other.high + other.gap) - max(self.low - self.gap, other.low - other.gap)
        if both < 0 or _opposites(self.literals).isdisjoint(other.literals):
            return None
        return both


@lru_cache(KNOWN)
def _opposites(literals: frozenset[Literal]) -> frozenset[Literal]:
    return frozenset((agent, what, not holds) for agent, what, holds in literals)


class Capacity(Record):
    """At most ``most`` of some literals may be true at once from ``low`` to ``high`` seconds.

    ``passing``: time before and after, seconds, in which a literal may also be true.
    """

    literals: frozenset[Literal]
    most: int
    low: float
    high: float
    passing: float

    def until(self, one: TimedLiterals, others: Iterable[TimedLiterals]) -> float | None:
        """Earliest time, seconds, at which ``one`` fits into the capacity beside others; None if it already fits."""
        mine = self.literals & one.literals
        if not mine or one.low > self.high or one.high < self.low:
            return None
        spans = [
            (each.low - self.passing, each.high + self.passing, self.literals & each.literals)
            for each in others
            if abs(each.low + each.high - one.low - one.high)
            <= one.high - one.low + each.high - each.low + 4 * self.passing
            and not self.literals.isdisjoint(each.literals)
        ]
        begin, end = one.low - self.passing, one.high + self.passing
        for moment in sorted({begin, *(low for low, _, _ in spans if begin < low <= end)}):
            there = [(high, said) for low, high, said in spans if low <= moment < high - ROUNDING]
            if len(mine.union(*(said for _, said in there))) > self.most:
                return min(high for high, said in there if not said <= mine) + self.passing
        return None


def capacities(holds: Iterable[Hold], step: float, passing: float) -> tuple[Capacity, ...]:
    """Capacities that holds imply.

    Args:
        step: duration of a step, seconds.
        passing: time before and after a literal, seconds, in which it may also be true.
    """
    found: list[Capacity] = []
    for hold in holds:
        if isinstance(hold.node, Any | AtLeast):
            denied = [_literal(hold.agent, part) for part in hold.node.parts]
            opposite = frozenset((agent, what, not holds) for agent, what, holds in filter(None, denied))
            if len(opposite) == len(denied) > 1:
                most = len(denied) - (hold.node.count if isinstance(hold.node, AtLeast) else 1)
                found.append(Capacity(opposite, most, hold.low * step, hold.high * step, passing))
    return tuple(found)


Denials: TypeAlias = dict[Literal, dict[Literal, float]]
"""For each literal that others may exclude, the literals that it implies (itself, or opposites of excluded literals),
with the seconds before and after in which they are also true."""


def denials(outline: Outline, apart: Callable[[int, Predicate, Predicate], float]) -> Denials:
    """Literals of an outline that other literals in it may exclude.

    Args:
        apart: function to the least travel time of an agent between the sets of two predicates, seconds. The function
            is used if one of the predicates must be true for a while.
    """
    visits = [hold for event in outline.events for hold in event.holds]
    lasting = [*outline.fixed, *(hold for event in outline.events for hold in event.before)]
    long = {literal for hold in lasting for literal in literals(hold.agent, hold.node)}
    everything = long.union(literal for hold in visits for literal in literals(hold.agent, hold.node))
    found: Denials = {}
    true_of: dict[int, list[Predicate]] = {}
    for agent, what, holds in everything:
        if (agent, what, not holds) in everything:
            found.setdefault((agent, what, holds), {})[agent, what, holds] = 0.0
        if holds and agent != TEAM:
            true_of.setdefault(agent, []).append(what)
    for agent, what, holds in long:
        for other in true_of.get(agent, ()) if holds else ():
            seconds = 0.0 if other is what else apart(agent, what, other)
            if seconds > 0:
                found.setdefault((agent, what, True), {})[agent, other, False] = seconds
                found.setdefault((agent, other, True), {})[agent, other, True] = 0.0
    return found


def timed_literals(holds: Iterable[Hold], denied: Denials, step: float) -> tuple[TimedLiterals, ...]:
    """Literals that holds imply and others may exclude, with their times in seconds.

    Args:
        step: duration of a step, seconds.
    """
    timed: list[TimedLiterals] = []
    for hold in holds if denied else ():
        said: dict[float, set[Literal]] = {}
        for literal in literals(hold.agent, hold.node):
            for implied, gap in denied.get(literal, {}).items():
                said.setdefault(gap, set()).add(implied)
        timed.extend(
            TimedLiterals(frozenset(each), hold.low * step, hold.high * step, gap) for gap, each in said.items()
        )
    return tuple(timed)


def earliest_time(
    says: Iterable[TimedLiterals],
    begin: float,
    sure: Iterable[TimedLiterals],
    capacities: Iterable[Capacity],
    step: float,
) -> float:
    """Earliest time from ``begin`` on, seconds, at which certain literals exclude none of the literals ``says``."""
    while True:
        later: list[float] = []
        for each in says:
            here = each.shifted(begin)
            low, high = here.low - here.gap, here.high + here.gap
            meanwhile = [other for other in sure if other.low - other.gap <= high and other.high + other.gap >= low]
            later += [
                other.high + other.gap + each.gap - each.low + step
                for other in meanwhile
                if here.mutex_time(other) is not None
            ]
            untils = [capacity.until(here, sure) for capacity in capacities]
            later += [until - each.low for until in untils if until is not None]
        if not later:
            return begin
        begin = max(later)


def mutex_seconds(one: TimedLiterals, others: Iterable[TimedLiterals], step: float) -> float:
    """Duration, seconds, for which literals are mutex with others."""
    denied = [one.mutex_time(other) for other in others]
    return sum(each + step for each in denied if each is not None)


def _literal(agent: int, node: Node) -> Literal | None:
    """Literal that is equivalent to a formula for an agent; None for other formulas."""
    while isinstance(node, At):
        agent, node = node.agent, node.body
    if isinstance(node, Atom | Not) and len(said := list(literals(agent, node))) == 1:
        return said[0]
    return None


def literals(agent: int, node: Node) -> Iterator[Literal]:
    """Yield the literals that a formula for an agent implies."""
    for who, part in conjuncts(agent, node):
        if isinstance(part, Atom | Not) and isinstance(leaf := part.body if isinstance(part, Not) else part, Atom):
            yield TEAM if leaf.predicate.about_team else who, leaf.predicate, isinstance(part, Atom)
