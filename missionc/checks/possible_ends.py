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


@dataclass(frozen=True, slots=True)
class May:
    """The agents of whom a formula may be true, and false, at the first and at the last step."""

    true: tuple[Bits, Bits]
    false: tuple[Bits, Bits]

    @property
    def opposite(self) -> May:
        return May(self.false, self.true)


@dataclass(slots=True, eq=False)
class Ends:
    """The two ends of a mission with few agents, and what was found of them."""

    mission: Mission
    everyone: Bits
    tries: tuple[tuple[Joint, ...], tuple[Joint, ...]]
    """At the first, and at the last step."""
    middles: tuple[Joint, Joint]
    atoms: dict[Predicate, May] = field(default_factory=dict)
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
    return {root for root in roots if known[root].true[FIRST] & 1}


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
        case Atom(predicate):
            if predicate not in ends.atoms:
                ends.atoms[predicate] = _of_predicate(ends, predicate)
            return ends.atoms[predicate]
        case Is(agents):
            bits = bits_of(tuple(agents))
            return May((bits, bits), (everyone & ~bits, everyone & ~bits))
        case Not():
            return below[0].opposite
        case All():
            return _all(everyone, below)
        case Any():
            return _all(everyone, [each.opposite for each in below]).opposite
        case AtLeast(count, parts):
            return _each(
                lambda at: _enough(everyone, count, [each.true[at] for each in below]),
                lambda at: _enough(everyone, len(parts) - count + 1, [each.false[at] for each in below]),
            )
        case At(agent):
            return _each(
                lambda at: _of_all(ends, below[0].true[at], agent), lambda at: _of_all(ends, below[0].false[at], agent)
            )
        case Eventually(_, low, high):
            return _sometime(ends, below[0], low, high)
        case Always(_, low, high):
            return _sometime(ends, below[0].opposite, low, high).opposite
        case Until(_, _, low, high):
            return _until(ends, below[0], below[1], low, high)
        case Release(_, _, low, high):
            return _until(ends, below[0].opposite, below[1].opposite, low, high).opposite
        case Neighbour(graph):
            return _nearby(ends, graph, below[0])
        case EveryNeighbour(graph):
            return _nearby(ends, graph, below[0].opposite).opposite
        case Reach(graph, _, _, hops):
            return _reach(ends, graph, below[0], below[1], hops)
        case EveryReach(graph, _, _, hops):
            return _reach(ends, graph, below[0].opposite, below[1].opposite, hops).opposite
        case Route(graph) | EveryRoute(graph) | PathLength(graph):
            return _in_metres(ends, graph)
        case _:
            assert_never(node)


def _each(true: Callable[[int], Bits], false: Callable[[int], Bits]) -> May:
    return May((true(FIRST), true(LAST)), (false(FIRST), false(LAST)))


def _all(everyone: Bits, parts: list[May]) -> May:
    return _each(
        lambda at: reduce(and_, (part.true[at] for part in parts), everyone),
        lambda at: reduce(or_, (part.false[at] for part in parts), 0),
    )


def _enough(everyone: Bits, count: int, parts: list[Bits]) -> Bits:
    """The agents that are in so many of the parts."""
    if count > len(parts):
        return 0
    least = [everyone] + [0] * max(count, 0)
    for part in parts:
        for number in range(len(least) - 1, 0, -1):
            least[number] |= least[number - 1] & part
    return least[-1]


def _of_all(ends: Ends, bits: Bits, agent: int) -> Bits:
    return ends.everyone if bits >> agent & 1 else 0


def _sometime(ends: Ends, body: May, low: int, high: int | None) -> May:
    true, false = [], []
    for column in (FIRST, LAST):
        known, whole = columns(ends.mission.steps, low, high, column)
        true.append(reduce(or_, (body.true[at] for at in known), 0 if whole else ends.everyone))
        false.append(reduce(and_, (body.false[at] for at in known), ends.everyone))
    return May((true[FIRST], true[LAST]), (false[FIRST], false[LAST]))


def _until(ends: Ends, hold: May, end: May, low: int, high: int | None) -> May:
    """As ``Intervals`` has it: whatever comes later, the left side has to hold now."""
    at_some = _sometime(ends, end, low, high)
    if high == 0:
        return at_some
    later = _sometime(ends, end, max(low, 1), high)
    now = end if low == 0 else May((0, 0), (ends.everyone, ends.everyone))
    last = at_some if high is None else May((0, ends.everyone), (0, ends.everyone))
    return May(
        (now.true[FIRST] | hold.true[FIRST] & later.true[FIRST], last.true[LAST]), (now.false[FIRST], last.false[LAST])
    )


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


def _nearby(ends: Ends, graph: Graph, body: May) -> May:
    members = bits_of(graph.agents)
    return _each(
        lambda at: _one_link(ends, graph, body.true[at], at),
        lambda at: ends.everyone & ~members | _no_link(ends, graph, body.false[at], at),
    )


def _one_link(ends: Ends, graph: Graph, found: Bits, column: int) -> Bits:
    """The agents that may be linked to one that may be found."""
    linked, _ = _links(ends, graph, column)
    return bits_of(tuple(agent for agent, others in linked.items() if others & found))


def _no_link(ends: Ends, graph: Graph, lost: Bits, column: int) -> Bits:
    """The agents that may have no link but to what may be lost."""
    members = bits_of(graph.agents)
    _, apart = _links(ends, graph, column)
    return bits_of(tuple(agent for agent, others in apart.items() if members & ~(others | lost) == 0))


def _reach(ends: Ends, graph: Graph, through: May, end: May, hops: int) -> May:
    def true(at: int) -> Bits:
        return _steadily(hops, end.true[at], lambda found: found | through.true[at] & _one_link(ends, graph, found, at))

    def false(at: int) -> Bits:
        outside = ends.everyone & ~bits_of(graph.agents)

        def longer(lost: Bits) -> Bits:
            return lost & (outside | through.false[at] | _no_link(ends, graph, lost, at))

        return _steadily(hops, end.false[at], longer)

    return _each(true, false)


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
    bits = []
    for column in (FIRST, LAST):
        exact = all(isinstance(_end(ends.mission.agents[agent], column), Exactly) for agent in graph.agents)
        bits.append(0 if exact else ends.everyone)
    return May((bits[FIRST], bits[LAST]), (bits[FIRST], bits[LAST]))


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


def _of_predicate(ends: Ends, predicate: Predicate) -> May:
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
    return May((true[FIRST], true[LAST]), (false[FIRST], false[LAST]))


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
