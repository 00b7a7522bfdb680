"""May analysis: the agents for which a formula may hold by the step at which it is evaluated, and their positions.

    in   a goal's formula, the FreeSpace
    out  for each node the agents for which it cannot hold, and why

Each constructor passes down to its operands the step by which they must hold and the agents. A leaf is dead if its
agent cannot be there by then, and every other node follows from its operands. So a disjunction is dead if all of its
operands are, and a conjunction if one is. Formulas over links are left to planning. Agents are the bits of a number.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import field
from functools import reduce
from operator import and_, or_
from typing import TypeAlias, assert_never

from missionc.base.late_dataclass import Record, dataclass
from missionc.frontend.checks.causes import Cause, Causes
from missionc.frontend.checks.literals import Literal, Unbounded
from missionc.geometry.configuration_space import Area, disjoint, empty
from missionc.ir import Mission, Predicate
from missionc.ir.kernel import nodes as k
from missionc.ir.kernel.walk import children, postorder
from missionc.ir.language.walk_formulas import bits_of

MOST_ASKED = 20_000
"""Maximum number of pairs of a node and an agent; larger goals are not analysed."""

Bits: TypeAlias = int
Areas: TypeAlias = frozenset[Area]
"""Areas that all contain an agent's centre."""

NOWHERE_KNOWN: Areas = frozenset()


class May(Record):
    """Agents for which a formula is ``dead``: it holds at no step up to the one at which it is evaluated.

    If the formula holds at a step, the agent is in all of ``places`` then, and each agent in ``others`` in its own
    areas.
    """

    dead: Bits = 0
    places: Areas = NOWHERE_KNOWN
    others: Mapping[int, Areas] = field(default_factory=dict)


ANYTHING = May()

Asked: TypeAlias = dict[k.Node, dict[int, int]]
"""Last step, by node and agent, at which the node is evaluated or must hold."""


@dataclass(slots=True, eq=False)
class MayAnalysis:
    """May analysis of one goal's formula: which subformulas cannot hold, for which agents, and why.

    Args:
        telling: the nodes that may be dead (``telling``); all others may hold.
        latest: if true, steps are the last ones at which a node is evaluated, so that a dead node is never true;
            otherwise the first ones at which it must hold, so that more nodes are dead.
    """

    causes: Causes
    root: k.Node
    telling: Collection[k.Node]
    latest: bool = False
    asked: Asked = field(default_factory=dict)
    known: dict[k.Node, May] = field(default_factory=dict)
    why: dict[k.Node, Cause | tuple[k.Node, ...]] = field(default_factory=dict)
    """Cause of each dead formula, or the operands that make it dead."""

    def __post_init__(self) -> None:
        order = postorder((self.root,), self._parts)
        if self._ask(order):
            for node in order:
                if node in self.asked:
                    self.known[node] = self._of(node)

    @property
    def dead(self) -> bool:
        """True if no plan satisfies the formula."""
        return self.root in self.known and bool(self.known[self.root].dead & 1)

    def reasons(self, node: k.Node) -> list[Cause]:
        """Causes of a dead node; for a disjunction, those of each operand."""
        found: dict[Cause, None] = {}
        waiting, seen = [node], set[k.Node]()
        while waiting:
            dead = waiting.pop()
            why = self.why.get(dead, ())
            if isinstance(why, Cause):
                found[why] = None
            elif dead not in seen:
                waiting.extend(reversed(why))
            seen.add(dead)
        return list(found)

    @property
    def mission(self) -> Mission:
        return self.causes.ground.mission

    def _ask(self, order: list[k.Node]) -> bool:
        """Compute by which step and for which agents each node is evaluated.

        Return False if that exceeds ``MOST_ASKED``.
        """
        self.asked[self.root] = {0: 0}
        left, last = MOST_ASKED, self.mission.steps
        for node in reversed(order):
            here = self.asked.get(node, {})
            for child, ahead, agent in self._below(node) if here else ():
                if child not in self.telling:
                    continue
                there = self.asked.setdefault(child, {})
                for whose, step in here.items():
                    by = last if ahead is None else min(step + ahead, last)
                    asked = whose if agent is None else agent
                    if by >= 0 and there.get(asked, -1) < by:
                        there[asked] = by
                        left -= 1
                if not there:
                    del self.asked[child]
            if left < 0:
                return False
        return True

    def _parts(self, node: k.Node) -> tuple[k.Node, ...]:
        return tuple(child for child, *_ in self._below(node) if child in self.telling)

    def _below(self, node: k.Node) -> Iterator[tuple[k.Node, int | None, int | None]]:
        """Operands of a node, each with its steps ahead (None: to the last) and its agent (None: the same agents)."""
        match node:
            case k.LeafNode() | k.Not() | k.NeighbourNode() | k.ReachNode() | k.RouteNode():
                return
            case k.All(parts) | k.Any(parts) | k.AtLeast(_, parts):
                yield from ((part, 0, None) for part in parts)
            case k.At(agent, body):
                yield body, 0, agent
            case k.WindowNode(body, low, high):
                yield body, low if node.every and low >= 0 and not self.latest else high, None
            case k.UntilNode(hold, end, low, high) if node.every:
                yield hold, high, None
                yield end, low if low >= 0 and not self.latest else high, None
            case k.UntilNode(hold, end, low, high):
                held = None if high is None else max(high - 1, 0)
                yield hold, held if self.latest and low >= 0 else 0, None
                yield end, high, None
            case _:
                assert_never(node)

    # ------------------------------------------------------------------- values

    def _of(self, node: k.Node) -> May:
        match node:
            case k.Atom(predicate):
                return self._atom(node, predicate, True)
            case k.Not(k.Atom(predicate)):
                return self._atom(node, predicate, False)
            case k.Is(agents):
                return May(self._everyone & ~bits_of(tuple(sorted(agents))))
            case k.Not(k.Is(agents)):
                return May(bits_of(tuple(sorted(agents))))
            case k.LeafNode() | k.Not() | k.NeighbourNode() | k.ReachNode() | k.RouteNode():
                return ANYTHING
            case k.All(parts):
                return self._enough(node, len(parts), parts)
            case k.AtLeast(count, parts):
                return self._enough(node, count, parts)
            case k.Any(parts):
                return self._some(node, parts)
            case k.At(agent, body):
                return self._at(node, agent, body)
            case k.WindowNode():
                return self._window(node)
            case k.UntilNode() if node.every:
                return self._release(node)
            case k.UntilNode() if node.low < 0:
                return self._die(node, self._dead(node.end), (node.end,))
            case k.UntilNode():
                return self._until(node)
            case _:
                assert_never(node)

    @property
    def _everyone(self) -> Bits:
        return (1 << len(self.mission.agents)) - 1

    def _dead(self, node: k.Node) -> Bits:
        """Agents for which a node is dead; none if it is never evaluated."""
        return self.known.get(node, ANYTHING).dead

    def _die(self, node: k.Node, dead: Bits, why: Cause | tuple[k.Node, ...], alive: May = ANYTHING) -> May:
        """Value of a node that is dead for these agents, with the positions of ``alive``; record the reason."""
        if dead:
            self.why.setdefault(node, why)
        return May(dead, alive.places, alive.others)

    def _atom(self, node: k.Node, predicate: Predicate, holds: bool) -> May:
        if predicate.about_team:
            cause = self.causes.no_fit(node, predicate) if holds else None
            return self._die(node, self._everyone, cause) if cause else ANYTHING
        ground = self.causes.ground
        area = ground.places(self.mission.agents).rule(Literal(predicate, holds)).within
        if isinstance(area, Unbounded):
            return ANYTHING
        if not self.causes.suspecting and (empty(area) or disjoint(area, ground.atlas.whole())):
            return ANYTHING  # a statement about the region itself
        cause = self.causes.far(node, area, self.asked[node])
        here = May(0, frozenset((area,)))
        return self._die(node, cause.bits, cause, here) if cause else here

    def _enough(self, node: k.All | k.AtLeast, count: int, parts: tuple[k.Node, ...]) -> May:
        below = [self.known.get(part, ANYTHING) for part in parts]
        asked = bits_of(tuple(sorted(self.asked[node])))
        lost = tuple(part for part, value in zip(parts, below, strict=True) if value.dead & asked)
        dead = _fewer_than(self._everyone, count, [value.dead for value in below])
        if isinstance(node, k.All):
            others = _merged(below)
            places = frozenset[Area]().union(*(value.places for value in below))
        else:
            others, places = {}, NOWHERE_KNOWN
        if count > 1 and not dead & 1 and (cause := self.causes.crowded(node, count, [each.others for each in below])):
            return self._die(node, self._everyone, cause)
        return self._die(node, dead, lost[:1] if isinstance(node, k.All) else lost, May(0, places, others))

    def _some(self, node: k.Node, parts: tuple[k.Node, ...]) -> May:
        below = [self.known.get(part, ANYTHING) for part in parts]
        dead = reduce(and_, (value.dead for value in below), self._everyone)
        alive = below
        # A part that is too late for the first step may be the one that holds at a later step.
        if self.latest and not self.causes.suspecting:
            asked = bits_of(tuple(sorted(self.asked[node])))
            alive = [value for value in below if asked & ~value.dead]
        either = self.causes.either([value.places for value in alive])
        agents = set.intersection(*(set(value.others) for value in alive)) if alive else set()
        others = {agent: self.causes.either([value.others[agent] for value in alive]) for agent in sorted(agents)}
        return self._die(node, dead, parts, May(0, either, others))

    def _at(self, node: k.Node, agent: int, body: k.Node) -> May:
        there = self.known.get(body, ANYTHING)
        others = _merged((there, May(0, NOWHERE_KNOWN, {agent: there.places})))
        dead = self._everyone if there.dead >> agent & 1 else 0
        return self._die(node, dead, (body,), May(0, NOWHERE_KNOWN, others))

    def _window(self, node: k.WindowNode) -> May:
        body, low, high = self.known.get(node.body, ANYTHING), node.low, node.high
        now = node.every and low <= 0 and (high is None or high >= 0)
        here = body if now or low == high == 0 else ANYTHING
        empty_window = node.every and low < 0 and high != 0  # it may contain no step
        dead = 0 if empty_window else body.dead
        if node.every and low >= 0:
            steps = self.asked[node]
            moves = {each: (self.mission.steps - by if high is None else high) - low for each, by in steps.items()}
            if (cause := self.causes.restless(node, body.places, moves)) is not None:
                return self._die(node, dead | cause.bits, cause, here)
        return self._die(node, dead, (node.body,), here)

    def _release(self, node: k.UntilNode) -> May:
        """Value of a release: its ``end`` must hold now if now is in the window; everything else is a choice."""
        if node.low != 0:
            return ANYTHING
        end = self.known.get(node.end, ANYTHING)
        return self._die(node, end.dead, (node.end,), end)

    def _until(self, node: k.UntilNode) -> May:
        hold, end = self.known.get(node.hold, ANYTHING), self.known.get(node.end, ANYTHING)
        steps = self.asked[node]
        jump = self.causes.jump(node, hold.places, end.places, steps)
        stay = dict.fromkeys(steps, node.low - 1)
        restless = self.causes.restless(node, hold.places, stay) if node.low > 1 else None
        stuck = hold.dead | (jump.bits if jump else 0)
        if node.low == 0:  # the end may hold at once, and then nothing else is needed
            stuck = stuck and stuck & self.causes.away(end.places, steps)
            here = May(0, self.causes.either([hold.places, end.places]))
        else:
            here = hold
        dead = end.dead | stuck | (restless.bits if restless else 0)
        asked = bits_of(tuple(sorted(steps)))
        for cause in (jump, restless):
            if cause is not None and dead & cause.bits & asked:
                return self._die(node, dead, cause, here)
        parts = (node.end,) if end.dead else (node.hold,)
        return self._die(node, dead, parts, here)


def telling(roots: Iterable[k.Node]) -> frozenset[k.Node]:
    """Nodes that the analysis can find dead, or that contain one: those about an agent's position or identity."""
    found = set[k.Node]()
    for node in postorder(roots):
        match node:
            case k.NeighbourNode() | k.ReachNode() | k.RouteNode():
                pass
            case k.Atom() | k.Is() | k.Not(k.Atom() | k.Is()):
                found.add(node)
            case _:
                parts = children(node)
                if any(part in found for part in parts) or (isinstance(node, k.Any | k.AtLeast) and not parts):
                    found.add(node)
    return frozenset(found)


def _merged(values: list[May] | tuple[May, ...]) -> dict[int, Areas]:
    """Areas of each named agent if all of the given formulas hold."""
    merged: dict[int, Areas] = {}
    for value in values:
        for agent, areas in value.others.items():
            merged[agent] = merged.get(agent, NOWHERE_KNOWN) | areas
    return merged


def _fewer_than(everyone: Bits, count: int, dead: list[Bits]) -> Bits:
    """Bit set of the agents for which fewer than ``count`` parts may hold."""
    spare = len(dead) - count
    if spare <= 0:
        return everyone if spare < 0 else reduce(or_, dead, 0)
    lost = [everyone] + [0] * (spare + 1)
    for bits in dead:
        for number in range(spare + 1, 0, -1):
            lost[number] |= lost[number - 1] & bits
    return lost[spare + 1]
