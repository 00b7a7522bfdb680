"""Witnesses that a formula may be true or false at the first and the last step: possible positions of agents.

Each agent is put at some of the points where it may start or finish, and predicates and links are evaluated there
without arrays. An agent without a given start or finish may be anywhere. Everything else is monotone. What is possible
at such points is also possible by the intervals of ``monitoring.interval_robustness``, which contain every such point.
Further formulas may be possible. Agents are the bits of a number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import field
from functools import partial, reduce
from itertools import islice
from operator import and_, or_
from typing import TypeAlias

from missionc.base.late_dataclass import dataclass
from missionc.frontend.checks.free_space import FreeSpace
from missionc.frontend.checks.place_margins import Joint, margin_at
from missionc.geometry import plain_floats
from missionc.geometry.configuration_space import SURE
from missionc.geometry.plain_floats import Place
from missionc.ir import Agent, Graph, InitialSet, Mission, Predicate
from missionc.ir.couplings import directed, range_of
from missionc.ir.kernel.evaluate import Domain, evaluate
from missionc.ir.kernel.nodes import NeighbourNode, Node, PathLength, ReachNode, RouteNode, UntilNode, WindowNode
from missionc.ir.kernel.walk import more_than
from missionc.ir.language.margins import link
from missionc.ir.language.walk_formulas import bits_of
from missionc.verification.monitoring.end_columns import FIRST, LAST, MOST_NODES, columns

FEW = 32
"""Maximum number of agents; for more, arrays are faster."""

TRIES = ((0, 0), (1, 0), (2, 1))
"""Factors that select the sample point of an agent: its number times the first, plus the second."""

PLACES = 7
"""Number of sample points in a region."""

Bits: TypeAlias = int
"""Set of agents as the bits of an integer."""


May: TypeAlias = tuple[Bits, Bits]
"""Agents for which a formula may be true, at the first and at the last step."""


@dataclass(slots=True, eq=False)
class Ends(Domain[May]):
    """Evaluation of formulas to the agents for which they may hold at both ends of a mission with few agents."""

    mission: Mission
    everyone: Bits
    tries: tuple[tuple[Joint, ...], tuple[Joint, ...]]
    """Sample positions of all agents, at the first and at the last step."""
    atoms: dict[Predicate, tuple[May, May]] = field(default_factory=dict)
    """Agents for which each predicate may be true, and may be false."""
    known_links: dict[tuple[Graph, int], tuple[dict[int, Bits], dict[int, Bits]]] = field(default_factory=dict)

    def atom(self, predicate: Predicate, holds: bool) -> May:
        if predicate not in self.atoms:
            self.atoms[predicate] = _of_predicate(self, predicate)
        true, false = self.atoms[predicate]
        return true if holds else false

    def member(self, agents: frozenset[int], holds: bool) -> May:
        bits = bits_of(tuple(agents))
        return (bits if holds else self.everyone & ~bits,) * 2

    def meet(self, parts: Sequence[May]) -> May:
        return _each(lambda at: reduce(and_, (part[at] for part in parts), self.everyone))

    def join(self, parts: Sequence[May]) -> May:
        return _each(lambda at: reduce(or_, (part[at] for part in parts), 0))

    def at_least(self, count: int, parts: Sequence[May]) -> May:
        return _each(lambda at: _enough(self.everyone, count, [part[at] for part in parts]))

    def at(self, agent: int, body: May) -> May:
        return _each(lambda column: self.everyone if body[column] >> agent & 1 else 0)

    def window(self, node: WindowNode, body: May) -> May:
        return _each(lambda at: self._window(node.every, body, node.low, node.high, at))

    def until(self, node: UntilNode, hold: May, end: May) -> May:
        """Agents for which *until* may hold, as in ``Intervals``: its left side must hold now, whatever comes later."""
        low, high = node.low, node.high
        if low < 0:
            now_is_enough = node.every and high != 0
            return _each(
                lambda at: (
                    self.everyone
                    if now_is_enough
                    else end[at]
                    if node.every
                    else self._window(False, end, low, high, at)
                )
            )
        if high == 0:
            return _each(lambda at: self._window(node.every, end, low, high, at))
        now = end[FIRST] if low == 0 else self.everyone if node.every else 0
        if not node.every:
            now |= hold[FIRST] & self._window(False, end, max(low, 1), high, FIRST)
        return now, self._window(node.every, end, low, high, LAST) if high is None else self.everyone

    def neighbour(self, node: NeighbourNode, body: May) -> May:
        if not node.every:
            return _each(lambda at: self._one_link(node.graph, body[at], at))
        return _each(lambda at: self._outside(node.graph) | self._no_other_link(node.graph, body[at], at))

    def reach(self, node: ReachNode, through: May, end: May) -> May:
        graph, outside = node.graph, self._outside(node.graph)

        def longer(reached: Bits, at: int) -> Bits:
            if not node.every:
                return reached | through[at] & self._one_link(graph, reached, at)
            return reached & (outside | through[at] | self._no_other_link(graph, reached, at))

        return _each(lambda at: _steadily(node.hops, end[at], partial(longer, at=at)))

    def route(self, node: RouteNode, through: May, end: May) -> May:
        return self._in_metres(node.graph)

    def path_length(self, node: PathLength, holds: bool) -> May:
        return self._in_metres(node.graph)

    def _window(self, every: bool, body: May, low: int, high: int | None, column: int) -> Bits:
        known, whole = columns(self.mission.steps, low, high, column)
        if every:
            return reduce(and_, (body[at] for at in known), self.everyone)
        return reduce(or_, (body[at] for at in known), 0 if whole else self.everyone)

    def _outside(self, graph: Graph) -> Bits:
        return self.everyone & ~bits_of(graph.agents)

    def _links(self, graph: Graph, column: int) -> tuple[dict[int, Bits], dict[int, Bits]]:
        """For each agent of the graph, the agents that it may be linked to and those that it may not be linked to."""
        if (graph, column) not in self.known_links:
            linked, apart = dict.fromkeys(graph.agents, 0), dict.fromkeys(graph.agents, 0)
            one_way = directed(graph)
            for one in graph.agents:
                for other in graph.agents:
                    if one < other or (one_way and one > other):
                        true, false = _tried(self, column, partial(_link, graph, one, other))
                        for here, there in ((one, other),) if one_way else ((one, other), (other, one)):
                            linked[here] |= true << there
                            apart[here] |= false << there
                apart[one] |= 1 << one
            self.known_links[graph, column] = linked, apart
        return self.known_links[graph, column]

    def _one_link(self, graph: Graph, reached: Bits, column: int) -> Bits:
        """Agents that may be linked to an agent of the set ``reached``."""
        linked, _ = self._links(graph, column)
        return bits_of(tuple(agent for agent, others in linked.items() if others & reached))

    def _no_other_link(self, graph: Graph, these: Bits, column: int) -> Bits:
        """Agents of the graph that may have no link except to the agents ``these``."""
        members = bits_of(graph.agents)
        _, apart = self._links(graph, column)
        return bits_of(tuple(agent for agent, others in apart.items() if members & ~(others | these) == 0))

    def _in_metres(self, graph: Graph) -> May:
        """Agents for which an operator on route lengths may hold: all of them, since lengths are not evaluated.

        If every agent of the graph has an exact position, the result is empty.
        """

        def bits(column: int) -> Bits:
            ends = (end_of(self.mission.agents[agent], column) for agent in graph.agents)
            exact = all(place is not None and place.point is not None for place in ends)
            return 0 if exact else self.everyone

        return _each(bits)


def possible(mission: Mission, roots: Iterable[Node], ground: FreeSpace) -> set[Node]:
    """Team formulas that may be true at the first step, as far as both ends decide them."""
    roots = tuple(roots)
    if len(mission.agents) > FEW or more_than(MOST_NODES, roots):
        return set()
    starts, finishes = ([end_of(agent, column) for agent in mission.agents] for column in (FIRST, LAST))
    ends = Ends(mission, (1 << len(mission.agents)) - 1, (_tries(starts, ground), _tries(finishes, ground)))
    known = evaluate(roots, ends)
    return {root for root in roots if known[root][FIRST] & 1}


def end_of(agent: Agent, column: int) -> InitialSet | None:
    """Start or finish of an agent, for the column ``FIRST`` or ``LAST``; None without a finish."""
    return agent.start if column == FIRST else agent.finish


def _tries(places: list[InitialSet | None], ground: FreeSpace) -> tuple[Joint, ...]:
    """Sample positions of all agents; empty if no point is known in some region."""
    choices = [_choices(place, ground) for place in places]
    if not all(choices):
        return ()
    return tuple(
        tuple(each[(number * times + more) % len(each)] for number, each in enumerate(choices)) for times, more in TRIES
    )


def _choices(place: InitialSet | None, ground: FreeSpace) -> list[Place | None]:
    if place is None:
        return [None]
    if place.point is not None:
        return [Place(place.point)]
    area = ground.atlas.outer(place.shape)
    return [Place(seed) for seed in islice((seed for seed in area.seeds() if area.depth(seed) > SURE), PLACES)]


def _each(true: Callable[[int], Bits]) -> May:
    return true(FIRST), true(LAST)


def _enough(everyone: Bits, count: int, parts: list[Bits]) -> Bits:
    """Agents that are in at least ``count`` of the parts."""
    if count > len(parts):
        return 0
    least = [everyone] + [0] * max(count, 0)
    for part in parts:
        for number in range(len(least) - 1, 0, -1):
            least[number] |= least[number - 1] & part
    return least[-1]


def _link(graph: Graph, one: int, other: int, joint: Joint) -> float | None:
    here, there = joint[one], joint[other]
    return (
        None
        if here is None or there is None
        else float(link.link_margin_of(plain_floats, graph, range_of(graph, one, other), here, there))
    )


def _steadily(times: int, bits: Bits, change: Callable[[Bits], Bits]) -> Bits:
    """Apply a change to a set of agents ``times`` times, or until it is stable."""
    for _ in range(times):
        after = change(bits)
        if after == bits:
            break
        bits = after
    return bits


# ------------------------------------------------------------------- predicates


def _tried(ends: Ends, column: int, margin: Callable[[Joint], float | None]) -> tuple[bool, bool]:
    """Return whether a margin may be positive, and whether it may be negative, at the sample positions.

    A margin that depends on an unknown position may be both.
    """
    true = false = False
    for joint in ends.tries[column]:
        value = margin(joint)
        true, false = true or value is None or value > SURE, false or value is None or value < -SURE
        if true and false:
            break
    return true, false


def _of_predicate(ends: Ends, predicate: Predicate) -> tuple[May, May]:
    """Agents for which a predicate may be true, and those for which it may be false."""
    true, false = [0, 0], [0, 0]
    team = predicate.about_team
    for column in (FIRST, LAST):
        for agent in ends.mission.agents:
            may, may_not = _tried(ends, column, partial(margin_at, ends.mission, predicate, agent))
            alike = ends.everyone if team else 1 << agent.index
            true[column] |= alike * may
            false[column] |= alike * may_not
            if team:
                break
    return (true[FIRST], true[LAST]), (false[FIRST], false[LAST])
