"""Three-valued truth of kernel formulas in continuous time, with links and routes over time.

A formula is surely true, surely false or undecided at each time. Time is cut at every possible change of a link or
operand, into single times and the intervals between them. Links and operands are constant in each of these cells, so
the monitor's graph routines evaluate all cells at once. A result that follows from the sure links is sure; a result
that the possible links exclude is surely false. Route lengths also change within an interval, which is halved until
their bounds suffice.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.ir import Graph, Predicate
from missionc.ir.couplings import directed
from missionc.ir.distances.signed_distance import distance_between
from missionc.ir.kernel.analysis import agents_asked, steps_ahead
from missionc.ir.kernel.evaluate import Domain, evaluate
from missionc.ir.kernel.nodes import Atom, NeighbourNode, Node, PathLength, ReachNode, RouteNode, UntilNode, WindowNode
from missionc.ir.kernel.walk import looks_back, postorder
from missionc.ir.language.margins.links import link_pieces
from missionc.verification.between.atoms import RESOLUTION, atom_signals, link_signals
from missionc.verification.between.interval_sets import (
    STEP,
    Motion,
    Signal,
    Spans,
    asked_until,
    looking_back_over,
    of_parts,
    sometime,
    throughout,
    until_over_time,
)
from missionc.verification.monitoring import graph_routes
from missionc.verification.monitoring.logic import TRUTH

MOST_CELLS = 20_000
"""Maximum number of time intervals for bounds on route lengths; later intervals stay undecided."""


class Links(Record, eq=False):
    """Communication links of a graph over time.

    Args:
        first, second: (pairs,): indices into ``members``, the first smaller unless links are ``one_way``, from the
            first to the second.
        signals: (pairs,): times at which each link exists.
    """

    members: Indices
    first: Indices
    second: Indices
    one_way: bool
    signals: tuple[Signal, ...]


def links_of(graph: Graph, motion: Motion) -> Links:
    members = np.array(graph.agents, dtype=np.int64)
    whole = np.ones((members.size, members.size), dtype=np.bool_)
    one_way = directed(graph)
    first, second = np.nonzero(whole & ~np.eye(members.size, dtype=np.bool_) if one_way else np.triu(whole, k=1))
    signals = link_signals(graph, members[first], members[second], motion) if first.size else []
    return Links(members, first.astype(np.int64), second.astype(np.int64), one_way, tuple(signals))


def linked_pairs(links: Links, body: Sequence[Signal], motion: Motion) -> list[Signal]:
    """Signal for each member of the graph that ``body`` holds at some agent linked to it."""
    return _judged(links, (body,), motion, lambda view: graph_routes.nearby(view.linked, view.operands[0]))


def reach_over_time(
    hops: int, links: Links, through: Sequence[Signal], end: Sequence[Signal], motion: Motion
) -> list[Signal]:
    """Signal for each member that it has a route of at most ``hops`` links over ``through`` agents to an
    ``end`` agent.
    """
    return _judged(
        links,
        (through, end),
        motion,
        lambda view: graph_routes.reach(view.linked, view.operands[0], view.operands[1], hops),
    )


def route(
    low: float, high: float, links: Links, through: Sequence[Signal], end: Sequence[Signal], motion: Motion
) -> list[Signal]:
    """Signal for each member that it has a route to an ``end`` agent, with a length from ``low`` to ``high`` metres."""

    def shorter(view: View) -> Flags:
        onward = view.linked & view.operands[0][:, :, None]
        lengths = np.maximum(view.lengths + view.spare, 0.0)
        return graph_routes.shortest(np.where(onward, lengths, np.inf), view.operands[1]) <= high

    def longer(view: View) -> Flags:
        """Flags of members whose shortest route may exceed the bound.

        Such a route has fewer links than there are members, and each link has an inexact length.
        """
        through, end = view.operands
        # No agent is at a distance from itself, so one of the two is 0.
        farthest = (view.spare.max(axis=(1, 2)) + view.spare.min(axis=(1, 2))) * (links.members.size - 1)
        rows = (
            graph_routes.bounded_below(
                TRUTH, linked[None], lengths[None], free[None], goal[None], low + more, high - more
            )
            for linked, lengths, free, goal, more in zip(view.linked, view.lengths, through, end, farthest, strict=True)
        )
        return np.concatenate([np.zeros((0, links.members.size), dtype=np.bool_), *rows])

    if low > 0:
        return _judged(links, (through, end), motion, longer, metres=True)
    if math.isinf(high):
        return reach_over_time(links.members.size, links, through, end, motion)
    return _judged(links, (through, end), motion, shorter, metres=True)


class View(Record, eq=False):
    """Truth of links and operands in some time cells, oriented so that more links and shorter paths only make more
    true.

    Args:
        linked: (cells, members, members), boolean.
        operands: (cells, members), each.
        lengths: link lengths in the middle of the cells, (cells, members, members), metres.
        spare: addition to the lengths, of the same shape and unit; a negative value shortens them.
    """

    linked: Flags
    operands: tuple[Flags, ...]
    lengths: Array
    spare: Array


def _judged(
    links: Links,
    operands: Sequence[Sequence[Signal]],
    motion: Motion,
    judge: Callable[[View], Flags],
    metres: bool = False,
) -> list[Signal]:
    """Signals of each member of a graph, from a function that evaluates single time cells.

    Args:
        operands: signals of the members, for each operand.
        judge: returns the truth (cells, members); monotone in links, operands and shorter lengths.
        metres: True if ``judge`` reads lengths.
    """
    columns = (links.signals, *operands)
    ticks = _ticks([signal for column in columns for signal in column], motion, metres)
    tables = [_tables(column, ticks) for column in columns]
    cell = np.arange(2 * ticks.size - 1)
    low, high = ticks[cell // 2], ticks[(cell + 1) // 2]
    shortest, left = int(RESOLUTION / motion.mission.step * STEP), MOST_CELLS
    sure, never = _Found(), _Found()
    while cell.size:
        left -= cell.size
        halve = np.zeros(cell.size, dtype=np.bool_)
        for part in link_pieces(cell.size, links.members.size):
            lengths, spare = _lengths(links, low[part], high[part], motion) if metres else _none(links, cell[part])
            seen, hoped = (_view(links, tables, way, cell[part], lengths) for way in (0, 1))
            yes, no = judge(replace(seen, spare=spare)), ~judge(replace(hoped, spare=-spare))
            if metres and left > 0:
                # If the lengths at the middle suffice, those of a shorter interval may.
                worth = (judge(seen) == judge(hoped)) & ~yes & ~no
                halve[part] = worth.any(axis=1) & (high[part] - low[part] > shortest)
            sure.add(yes & ~halve[part, None], low[part], high[part])
            never.add(no & ~halve[part, None], low[part], high[part])
        cell, low, high = cell[halve], low[halve], high[halve]
        middle = (low + high) // 2
        cell, low, high = map(np.concatenate, ((cell, cell), (low, middle), (middle, high)))
    members = range(links.members.size)
    return [Signal(yes, no) for yes, no in zip(sure.spans(members), never.spans(members), strict=True)]


class _Found:
    """Collected time intervals for each member of a graph, in any order."""

    def __init__(self) -> None:
        self.rows: list[tuple[Indices, Indices, Indices]] = []

    def add(self, flags: Flags, low: Indices, high: Indices) -> None:
        """Add the intervals whose flags are set.

        Args:
            flags: (stretches, members).
            low, high: first and last tick of each interval, (stretches,).
        """
        stretch, member = np.nonzero(flags)
        self.rows.append((member.astype(np.int64), low[stretch], high[stretch]))

    def spans(self, members: range) -> list[Spans]:
        """Disjoint intervals of each member, after joining adjacent ones."""
        member, low, high = (np.concatenate(column) for column in zip(*self.rows, strict=True))
        order = np.lexsort((high, low, member))
        member, low, high = member[order], low[order], high[order]
        apart = np.r_[True, (np.diff(member) != 0) | (low[1:] > high[:-1])][: member.size]
        first = np.flatnonzero(apart)
        last = np.r_[first[1:] - 1, member.size - 1][: first.size]
        result: list[list[tuple[int, int]]] = [[] for _ in members]
        for who, begin, stop in zip(member[first].tolist(), low[first].tolist(), high[last].tolist(), strict=True):
            result[who].append((begin, stop))
        return [tuple(each) for each in result]


def _ticks(signals: Sequence[Signal], motion: Motion, metres: bool) -> Indices:
    """Times in ticks at which a signal may change, in order; with ``metres`` also the joints of the trajectories."""
    ends = {tick for signal in signals for spans in (signal.sure, signal.never) for span in spans for tick in span}
    joints = motion.joints.tolist() if metres else (0, motion.end)
    return np.array(sorted({*ends, *joints}), dtype=np.int64)


def _tables(signals: Sequence[Signal], ticks: Indices) -> tuple[Flags, Flags]:
    """Flags of sure and of possible truth in each time cell: (cells, signals), twice.

    Cells alternate between single times and the intervals between them.
    """
    cells = 2 * ticks.size - 1

    def table(sets: list[Spans]) -> Flags:
        change = np.zeros((cells + 1, len(sets)), dtype=np.int8)
        ends = np.array([(number, *span) for number, spans in enumerate(sets) for span in spans], dtype=np.int64)
        number, first, last = ends.reshape(-1, 3).T
        change[2 * np.searchsorted(ticks, first), number] += 1
        change[2 * np.searchsorted(ticks, last) + 1, number] -= 1
        return np.asarray(np.cumsum(change, axis=0, dtype=np.int8)[:-1] > 0)

    return table([signal.sure for signal in signals]), ~table([signal.never for signal in signals])


def _view(links: Links, tables: Sequence[tuple[Flags, Flags]], way: int, cell: Indices, lengths: Array) -> View:
    """Truth of links and operands in given time cells, with the link lengths in their middle.

    Args:
        way: 0 for sure truth, 1 for possible truth.
        cell: indices of the cells, (cells,).
        lengths: metres.
    """
    pairs, *operands = (table[way][cell] for table in tables)
    linked = np.zeros((cell.size, links.members.size, links.members.size), dtype=np.bool_)
    linked[:, links.first, links.second] = pairs
    if not links.one_way:
        linked[:, links.second, links.first] = pairs
    return View(linked, tuple(operands), lengths, np.zeros_like(lengths))


def _none(links: Links, cell: Indices) -> tuple[Array, Array]:
    """Placeholder for link lengths, (cells, 1, 1) twice, metres, used if no length is evaluated."""
    return np.zeros((cell.size, 1, 1)), np.zeros((cell.size, 1, 1))


def _lengths(links: Links, low: Indices, high: Indices, motion: Motion) -> tuple[Array, Array]:
    """Distances of all pairs of members in the middle of intervals, and a bound on their change within the interval.

    Shape: (cells, members, members) twice, metres.
    """
    middle = (low + high) // 2
    piece = motion.piece_at(middle)
    size = links.members.size
    agent = np.broadcast_to(links.members[:, None], (size, middle.size))
    there = motion.position(
        agent, np.broadcast_to(piece, agent.shape), np.broadcast_to(motion.local(piece, middle), agent.shape)
    )
    here = there.swapaxes(0, 1)
    lengths = np.asarray(distance_between(np, here[:, :, None], here[:, None]))
    spare = np.zeros_like(lengths)
    first, second = links.members[links.first], links.members[links.second]
    change = motion.relative_speed(first, second).T[piece] * motion.reach(low, high)[:, None]
    spare[:, links.first, links.second] = spare[:, links.second, links.first] = change + motion.slack
    return lengths, spare


OTHERS = -1
"""Key of the signal shared by all agents without an entry of their own."""

Signals: TypeAlias = dict[int, Signal]
"""Signals of a formula, by the index of the agent for which it is evaluated."""


class TruthOverTime(Domain[Signals]):
    """Evaluation of kernel formulas in continuous time along one joint trajectory; predicates and links are cached."""

    def __init__(self, motion: Motion) -> None:
        self.motion, self.end = motion, motion.end
        self.atoms: dict[tuple[Predicate, int], Signal] = {}
        self.graphs: dict[Graph, Links] = {}
        self.ahead: dict[Node, int] = {}
        self.asked: dict[Predicate, set[int]] = {}
        self.always, self.nowhere = Signal(((0, self.end),), ()), Signal((), ((0, self.end),))

    def of(self, root: Node) -> dict[Node, Signals]:
        """Signals of a team formula and of all its subformulas, for the agents that each is evaluated for."""
        order = postorder((root,))
        asked = agents_asked(root)
        self.ahead, self.asked = steps_ahead((root,)), defaultdict(set)
        for node in order:
            if isinstance(node, Atom):
                self.asked[node.predicate] |= asked[node]
        known = evaluate(order, self)
        return {node: {agent: at(known[node], agent) for agent in sorted(asked[node])} for node in order}

    def links(self, graph: Graph) -> Links:
        """Communication links of a graph over time, computed once."""
        if graph not in self.graphs:
            self.graphs[graph] = links_of(graph, self.motion)
        return self.graphs[graph]

    def atom(self, predicate: Predicate, holds: bool) -> Signals:
        whom = {OTHERS} if predicate.about_team else self.asked[predicate]
        new = sorted(agent for agent in whom if (predicate, agent) not in self.atoms)
        if new:
            anyone = np.maximum(np.array(new, dtype=np.int64), 0)
            signals = atom_signals(predicate, anyone, self.motion)
            self.atoms.update({(predicate, agent): signal for agent, signal in zip(new, signals, strict=True)})
        return _signed({agent: self.atoms[predicate, agent] for agent in whom}, holds)

    def member(self, agents: frozenset[int], holds: bool) -> Signals:
        return _signed({OTHERS: self.nowhere} | dict.fromkeys(agents, self.always), holds)

    def meet(self, parts: Sequence[Signals]) -> Signals:
        return self.at_least(len(parts), parts)

    def join(self, parts: Sequence[Signals]) -> Signals:
        return self.at_least(1, parts)

    def at_least(self, count: int, parts: Sequence[Signals]) -> Signals:
        return self._each(lambda *below: of_parts(count, below, self.end), *parts)

    def window(self, node: WindowNode, body: Signals) -> Signals:
        if looks_back(node):
            back = partial(looking_back_over, sometime, **_window_back(node), end=self.end)
            return self._dual(node.every, partial(self._each, back), body)
        measure = throughout if node.every else sometime
        return self._each(lambda body: measure(body, *_window(node), self.end), body)

    def until(self, node: UntilNode, hold: Signals, end: Signals) -> Signals:
        if looks_back(node):
            back = partial(looking_back_over, until_over_time, **_window_back(node), end=self.end)
            return self._dual(node.every, partial(self._each, back), hold, end)
        last = last_asked(self.ahead[node.hold], self.end)

        def some(hold: Signal, end: Signal) -> Signal:
            return until_over_time(asked_until(last, hold, self.end), end, *_window(node), self.end)

        return self._dual(node.every, partial(self._each, some), hold, end)

    def at(self, agent: int, body: Signals) -> Signals:
        return {OTHERS: at(body, agent)}

    def neighbour(self, node: NeighbourNode, body: Signals) -> Signals:
        def some(body: Signals) -> Signals:
            return {OTHERS: self.nowhere} | self._of_members(node.graph, linked_pairs, body)

        return self._dual(node.every, some, body)

    def reach(self, node: ReachNode, through: Signals, end: Signals) -> Signals:
        def some(through: Signals, end: Signals) -> Signals:
            return end | self._of_members(node.graph, partial(reach_over_time, node.hops), through, end)

        return self._dual(node.every, some, through, end)

    def route(self, node: RouteNode, through: Signals, end: Signals) -> Signals:
        def some(through: Signals, end: Signals) -> Signals:
            outside = end if node.low <= 0 else {OTHERS: self.nowhere}
            return outside | self._of_members(node.graph, partial(route, node.low, node.high), through, end)

        return self._dual(node.every, some, through, end)

    def path_length(self, node: PathLength, holds: bool) -> Signals:
        anyone, target = {OTHERS: self.always}, self.member(frozenset((node.agent,)), True)

        def way(most: float) -> Signals:
            return self._of_members(node.graph, partial(route, 0.0, most), anyone, target)

        near = way(node.high)
        if node.low <= 0:
            return _signed(target | near, holds)
        nearer = way(math.nextafter(node.low, 0.0))
        within = {agent: of_parts(2, [near[agent], nearer[agent].denied], self.end) for agent in near}
        return _signed({OTHERS: self.nowhere} | within, holds)

    def _each(self, measure: Callable[..., Signal], *parts: Signals) -> Signals:
        """Signals from applying ``measure`` to the parts, for each agent that all parts have."""
        named = set[int]().union(*parts) | ({OTHERS} if not parts else set())
        whom = [agent for agent in sorted(named) if all(agent in part or OTHERS in part for part in parts)]
        return {agent: measure(*(at(part, agent) for part in parts)) for agent in whom}

    def _dual(self, every: bool, some: Callable[..., Signals], *below: Signals) -> Signals:
        """Signals of a universal operator, as the negation of the existential operator over negated children."""
        return _signed(some(*(_signed(part, not every) for part in below)), not every)

    def _of_members(self, graph: Graph, judge: Callable[..., list[Signal]], *below: Signals) -> Signals:
        """Signals of the graph's members, computed by ``judge`` from the children's signals at each member."""
        operands = [[at(part, agent) for agent in graph.agents] for part in below]
        if not graph.agents:
            return {}
        return dict(zip(graph.agents, judge(self.links(graph), *operands, self.motion), strict=True))


def at(signals: Signals, agent: int) -> Signal:
    """The signal for an agent, or the shared one if the agent has no entry."""
    return signals[agent if agent in signals else OTHERS]


def last_asked(ahead: int, end: int) -> int:
    """Last time, in ticks, at which a formula with a look-ahead of ``ahead`` steps is still within the mission."""
    return end - ahead * STEP


def _signed(signals: Signals, holds: bool) -> Signals:
    return signals if holds else {agent: signal.denied for agent, signal in signals.items()}


def _window(node: WindowNode | UntilNode) -> tuple[int, int | None]:
    return node.low * STEP, None if node.high is None else node.high * STEP


def _window_back(node: WindowNode | UntilNode) -> dict[str, int]:
    """Window of a past operator in ticks back, the nearer bound first."""
    assert node.high is not None
    return {"low": -node.high * STEP, "high": -node.low * STEP}
