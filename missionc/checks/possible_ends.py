"""Witnesses that a formula may be true, or false, at the first and the last step: places that agents may be at.

Each agent is put at some of the places where it may start or finish, and
predicates and links are looked at there, in plain numbers; one whose place is
not given may be anywhere. Everything else is monotone. What is found possible is so by the
intervals of ``monitoring.interval_robustness`` too, for they hold every such
place; what is not found may be possible all the same. Agents are the bits of a number.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import field
from functools import partial, reduce
from itertools import islice
from operator import and_, or_
from typing import TypeAlias, assert_never

from missionc.base.late_dataclass import dataclass
from missionc.checks.free_space import FreeSpace
from missionc.checks.place_margins import Joint, margin_at
from missionc.ir import Agent, Connected, Exactly, Graph, Mission, Predicate
from missionc.ir import Place as Given
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
from missionc.kernel.walk import children, more_than, postorder
from missionc.language.margins import link
from missionc.language.walk_formulas import bits_of
from missionc.monitoring.end_columns import FIRST, LAST, MOST_NODES, columns
from missionc.world import plain_floats
from missionc.world.area import SURE
from missionc.world.plain_floats import Place

FEW = 32
"""Agents that are looked at one by one; of more, arrays are quicker."""

TRIES = ((0, 0), (1, 0), (2, 1))
"""The place of its own that an agent is put at: the number of the agent so many times, and so many more."""

PLACES = 7
"""Places that are tried in a region in which an agent may be."""

Bits: TypeAlias = int
"""Agents, each a bit of it."""


May: TypeAlias = tuple[Bits, Bits]
"""The agents of whom a formula may be true, at the first and at the last step."""


@dataclass(slots=True, eq=False)
class Ends:
    """The two ends of a mission with few agents, and what was found of them."""

    mission: Mission
    everyone: Bits
    tries: tuple[tuple[Joint, ...], tuple[Joint, ...]]
    """At the first, and at the last step."""
    middles: tuple[Joint, Joint]
    atoms: dict[Predicate, tuple[May, May]] = field(default_factory=dict)
    """By predicate: of whom it may be true, and of whom it may be false."""
    links: dict[tuple[Graph, int], tuple[dict[int, Bits], dict[int, Bits]]] = field(default_factory=dict)


def possible(mission: Mission, roots: Iterable[Node], ground: FreeSpace) -> set[Node]:
    """Those of the formulas about the team that may surely be true at the first step, as far as both ends decide it."""
    roots = tuple(roots)
    if len(mission.agents) > FEW or more_than(MOST_NODES, roots):
        return set()
    starts, finishes = ([_end(agent, column) for agent in mission.agents] for column in (FIRST, LAST))
    ends = Ends(
        mission,
        (1 << len(mission.agents)) - 1,
        (_tries(starts, ground), _tries(finishes, ground)),
        (_middles(starts, ground), _middles(finishes, ground)),
    )
    known: dict[Node, May] = {}
    for node in postorder(roots):
        known[node] = _may(ends, node, [known[child] for child in children(node)])
    return {root for root in roots if known[root][FIRST] & 1}


def _end(agent: Agent, column: int) -> Given | None:
    return agent.start if column == FIRST else agent.finish


def _tries(places: list[Given | None], ground: FreeSpace) -> tuple[Joint, ...]:
    """Some ways to put every agent at one of its places; none where no place is known of some region."""
    choices = [_choices(place, ground) for place in places]
    if not all(choices):
        return ()
    return tuple(
        tuple(each[(number * times + more) % len(each)] for number, each in enumerate(choices)) for times, more in TRIES
    )


def _choices(place: Given | None, ground: FreeSpace) -> list[Place | None]:
    if place is None:
        return [None]
    if isinstance(place, Exactly):
        return [Place(place.point)]
    area = ground.atlas.outer(place.region.shape)
    return [Place(seed) for seed in islice((seed for seed in area.seeds() if area.depth(seed) > SURE), PLACES)]


def _middles(places: list[Given | None], ground: FreeSpace) -> Joint:
    """The middle of the box around each agent's place."""
    return tuple(_middle(place, ground) for place in places)


def _middle(place: Given | None, ground: FreeSpace) -> Place | None:
    if place is None:
        return None
    if isinstance(place, Exactly):
        return Place(place.point)
    low, high = ground.atlas.bounds(ground.atlas.outer(place.region.shape))
    return Place((a + b) / 2 for a, b in zip(low, high, strict=True))


# --------------------------------------------------------------------- formulas


def _may(ends: Ends, node: Node, below: list[May]) -> May:
    everyone = ends.everyone
    match node:
        case Not(body):
            return _leaf(ends, body, holds=False)
        case All():
            return _each(lambda at: reduce(and_, (part[at] for part in below), everyone))
        case Any():
            return _each(lambda at: reduce(or_, (part[at] for part in below), 0))
        case AtLeast(count):
            return _each(lambda at: _enough(everyone, count, [part[at] for part in below]))
        case At(agent):
            return _each(lambda at: everyone if below[0][at] >> agent & 1 else 0)
        case Eventually(_, low, high):
            return _each(lambda at: _eventually(ends, below[0], low, high, at))
        case Always(_, low, high):
            return _each(lambda at: _always(ends, below[0], low, high, at))
        case Until(_, _, low, high):
            return _until(ends, below[0], below[1], low, high)
        case Release(_, _, low, high):
            return _release(ends, below[1], low, high)
        case Neighbour(graph):
            return _each(lambda at: _one_link(ends, graph, below[0][at], at))
        case EveryNeighbour(graph):
            outside = everyone & ~bits_of(graph.agents)
            return _each(lambda at: outside | _no_other_link(ends, graph, below[0][at], at))
        case Reach(graph, _, _, hops):
            return _reach(ends, graph, below[0], below[1], hops)
        case EveryReach(graph, _, _, hops):
            return _every_reach(ends, graph, below[0], below[1], hops)
        case Route(graph) | EveryRoute(graph):
            return _in_metres(ends, graph)
        case Atom() | Is() | PathLength():
            return _leaf(ends, node, holds=True)
        case _:
            assert_never(node)


def _leaf(ends: Ends, node: Node, *, holds: bool) -> May:
    """The agents of whom a leaf, or its negation, may be true."""
    match node:
        case Atom(predicate):
            if predicate not in ends.atoms:
                ends.atoms[predicate] = _of_predicate(ends, predicate)
            true, false = ends.atoms[predicate]
            return true if holds else false
        case Is(agents):
            bits = bits_of(tuple(agents))
            return _each(lambda _: bits if holds else ends.everyone & ~bits)
        case PathLength(graph):
            return _in_metres(ends, graph)
        case _:
            raise AssertionError("a kernel in negation normal form negates its leaves alone")


def _each(true: Callable[[int], Bits]) -> May:
    return true(FIRST), true(LAST)


def _enough(everyone: Bits, count: int, parts: list[Bits]) -> Bits:
    """The agents that are in so many of the parts."""
    if count > len(parts):
        return 0
    least = [everyone] + [0] * max(count, 0)
    for part in parts:
        for number in range(len(least) - 1, 0, -1):
            least[number] |= least[number - 1] & part
    return least[-1]


def _eventually(ends: Ends, body: May, low: int, high: int | None, column: int) -> Bits:
    known, whole = columns(ends.mission.steps, low, high, column)
    return reduce(or_, (body[at] for at in known), 0 if whole else ends.everyone)


def _always(ends: Ends, body: May, low: int, high: int | None, column: int) -> Bits:
    known, _ = columns(ends.mission.steps, low, high, column)
    return reduce(and_, (body[at] for at in known), ends.everyone)


def _until(ends: Ends, hold: May, end: May, low: int, high: int | None) -> May:
    """As ``Intervals`` has it: whatever comes later, the left side has to hold now."""
    if high == 0:
        return _each(lambda at: _eventually(ends, end, low, high, at))
    now = end[FIRST] if low == 0 else 0
    later = _eventually(ends, end, max(low, 1), high, FIRST)
    return now | hold[FIRST] & later, _eventually(ends, end, low, high, LAST) if high is None else ends.everyone


def _release(ends: Ends, end: May, low: int, high: int | None) -> May:
    """The dual: what comes later may free the right side, but not now."""
    if high == 0:
        return _each(lambda at: _always(ends, end, low, high, at))
    now = end[FIRST] if low == 0 else ends.everyone
    return now, _always(ends, end, low, high, LAST) if high is None else ends.everyone


# ----------------------------------------------------------------------- graphs


def _links(ends: Ends, graph: Graph, column: int) -> tuple[dict[int, Bits], dict[int, Bits]]:
    """For each of the graph's agents those it may be linked to, and those it may not be."""
    if (graph, column) not in ends.links:
        linked, apart = dict.fromkeys(graph.agents, 0), dict.fromkeys(graph.agents, 0)
        for one in graph.agents:
            for other in graph.agents:
                if one < other:
                    true, false = _tried(ends, column, partial(_link, graph, one, other))
                    for here, there in ((one, other), (other, one)):
                        linked[here] |= true << there
                        apart[here] |= false << there
            apart[one] |= 1 << one
        ends.links[graph, column] = linked, apart
    return ends.links[graph, column]


def _link(graph: Graph, one: int, other: int, joint: Joint) -> float | None:
    here, there = joint[one], joint[other]
    return None if here is None or there is None else float(link.margin(plain_floats, graph, here, there))


def _one_link(ends: Ends, graph: Graph, found: Bits, column: int) -> Bits:
    """The agents that may be linked to one that may be found."""
    linked, _ = _links(ends, graph, column)
    return bits_of(tuple(agent for agent, others in linked.items() if others & found))


def _no_other_link(ends: Ends, graph: Graph, these: Bits, column: int) -> Bits:
    """The agents of the graph that may have no link but to these."""
    members = bits_of(graph.agents)
    _, apart = _links(ends, graph, column)
    return bits_of(tuple(agent for agent, others in apart.items() if members & ~(others | these) == 0))


def _reach(ends: Ends, graph: Graph, through: May, end: May, hops: int) -> May:
    def longer(found: Bits, at: int) -> Bits:
        return found | through[at] & _one_link(ends, graph, found, at)

    return _each(lambda at: _steadily(hops, end[at], partial(longer, at=at)))


def _every_reach(ends: Ends, graph: Graph, through: May, end: May, hops: int) -> May:
    outside = ends.everyone & ~bits_of(graph.agents)

    def longer(left: Bits, at: int) -> Bits:
        return left & (outside | through[at] | _no_other_link(ends, graph, left, at))

    return _each(lambda at: _steadily(hops, end[at], partial(longer, at=at)))


def _steadily(times: int, bits: Bits, change: Callable[[Bits], Bits]) -> Bits:
    """The bits changed so many times, or until they stay."""
    for _ in range(times):
        after = change(bits)
        if after == bits:
            break
        bits = after
    return bits


def _in_metres(ends: Ends, graph: Graph) -> May:
    """Lengths are known of given points alone, and not looked at here."""

    def bits(column: int) -> Bits:
        exact = all(isinstance(_end(ends.mission.agents[agent], column), Exactly) for agent in graph.agents)
        return 0 if exact else ends.everyone

    return _each(bits)


# ------------------------------------------------------------------- predicates


def _tried(ends: Ends, column: int, margin: Callable[[Joint], float | None]) -> tuple[bool, bool]:
    """Whether something may be true, and may be false; a margin is None where it hangs on a place that is not given."""
    true = false = False
    for joint in ends.tries[column]:
        found = margin(joint)
        true, false = true or found is None or found > SURE, false or found is None or found < -SURE
        if true and false:
            break
    return true, false


def _of_predicate(ends: Ends, predicate: Predicate) -> tuple[May, May]:
    """The agents of whom it may be true, and of whom it may be false."""
    true, false = [0, 0], [0, 0]
    team = predicate.about_team
    for column in (FIRST, LAST):
        if isinstance(predicate, Connected):
            true[column], false[column] = _connected(ends, predicate, column)
            continue
        for agent in ends.mission.agents:
            may, may_not = _tried(ends, column, partial(margin_at, ends.mission, predicate, agent))
            alike = ends.everyone if team else 1 << agent.index
            true[column] |= alike * may
            false[column] |= alike * may_not
            if team:
                break
    return (true[FIRST], true[LAST]), (false[FIRST], false[LAST])


def _connected(ends: Ends, predicate: Connected, column: int) -> tuple[Bits, Bits]:
    """As ``Intervals`` has it: in the middle of the places, but for an agent that may be anywhere."""
    middles = ends.middles[column]
    anywhere = bits_of(tuple(number for number, place in enumerate(middles) if place is None))
    if any(anywhere >> agent & 1 for agent in predicate.agents):
        return anywhere, anywhere
    together = _together(predicate, middles, SURE)
    torn = not _together(predicate, middles, -SURE)
    return ends.everyone if together else anywhere, ends.everyone if torn else anywhere


def _together(predicate: Connected, middles: Joint, least: float) -> bool:
    """Whether links of more than ``least`` metres of margin connect the agents."""
    left = set(predicate.agents)
    waiting = [left.pop()] if left else []
    while waiting:
        here = waiting.pop()
        near = {there for there in left if (_link(predicate.graph, here, there, middles) or 0.0) > least}
        left -= near
        waiting.extend(near)
    return not left
