"""Counterexamples in continuous time: the moment, the agent and the subformula that decide a failure.

The search goes from the formula down to a predicate or a route. Where it has a
choice it goes after what differs from the steps around it, for that is what the
steps do not show.
"""

from __future__ import annotations

from dataclasses import dataclass

from missionc.base.trace import Flags
from missionc.kernel.nodes import All, Any, At, AtLeast, Node, Not, says_opposite
from missionc.kernel.walk import children, window_of
from missionc.verify.between.interval_sets import Spans, common
from missionc.verify.between.motion_clock import STEP
from missionc.verify.between.truth_over_time import Signals, last_asked

MOST_PARTS = 3
"""So many of those that decide together are named."""


@dataclass(frozen=True, slots=True)
class Culprit:
    """A predicate or route that is (or may be) ``value`` at an agent, from ``low`` to ``high`` (ticks).

    ``label`` is the part of the mission's text that it came from, ``says`` what is so of it, and ``team`` whether it is
    about the team.
    """

    node: Node
    agent: int
    tick: int
    value: bool
    low: int
    high: int
    label: Node
    says: bool
    team: bool


@dataclass(frozen=True, slots=True)
class _Place:
    node: Node
    agent: int
    tick: int
    value: bool
    label: Node
    says: bool
    team: bool = False

    def to(self, node: Node, *, agent: int | None = None, tick: int | None = None, value: bool | None = None) -> _Place:
        """One further down; words that an operator was rewritten from stay those of the whole operator."""
        value = self.value if value is None else value
        same = node.span in (None, self.label.span)
        return _Place(
            node,
            self.agent if agent is None else agent,
            self.tick if tick is None else tick,
            value,
            self.label if same else node,
            self.says if same else value is not says_opposite(node),
            same and (self.team or agent is not None),
        )


class Search:
    """Follows a verdict down.

    Args:
        known: when each node holds, at whom.
        truths: what each node is at the steps, (agents or 1, steps + 1 or 1).
        certain: whether the verdict is that it surely fails; else, that it may.
        ahead: how many steps ahead each node looks.
        end: of the mission, in ticks.
    """

    def __init__(
        self,
        known: dict[Node, Signals],
        truths: dict[Node, Flags],
        certain: bool,
        ahead: dict[Node, int],
        end: int,
    ) -> None:
        self.known, self.truths, self.certain, self.ahead, self.end = known, truths, certain, ahead, end

    def culprits(self, root: Node) -> tuple[Culprit, ...]:
        """Why the formula fails, or may fail, at time 0."""
        found: list[Culprit] = []
        waiting = [_Place(root, 0, 0, False, root, says_opposite(root))]
        while waiting and len(found) < MOST_PARTS:
            place = waiting.pop()
            below = self._below(place)
            waiting.extend(reversed(below))
            if not below:
                found.append(self._culprit(place))
        return tuple(found)

    def when(self, node: Node, agent: int, value: bool) -> Spans:
        """When a formula surely is ``value``, or, where the verdict is not certain, may be."""
        signal = self.known[node][agent]
        surely, other = (signal.sure, signal.never) if value else (signal.never, signal.sure)
        if self.certain:
            return surely
        edges = [-1, *(edge for span in other for edge in span), self.end + 1]
        gaps = zip(edges[::2], edges[1::2], strict=True)
        return tuple((low + 1, high - 1) for low, high in gaps if low + 1 <= high - 1)

    def is_new(self, place: _Place) -> bool:
        """Whether neither of the steps around shows what is so here."""
        truths = self.truths[place.node]
        row = truths[place.agent if len(truths) > 1 else 0]
        steps = {place.tick // STEP, -(-place.tick // STEP)}
        return all(bool(row[step if row.size > 1 else 0]) is not place.value for step in steps)

    def _below(self, place: _Place) -> list[_Place]:
        """What decides it further down; nothing where it decides itself."""
        node, value = place.node, place.value
        match node:
            case Not(body):
                return [place.to(body, value=not value)]
            case At(agent, body):
                return [place.to(body, agent=agent)]
            case All(parts) | Any(parts):
                return self._parts(place, parts, one=value is not node.every)
            case AtLeast(_, parts):
                return self._parts(place, parts, one=False)
            case _ if window := window_of(node):
                return self._in_time(place, *window, one=value is not node.every)
            case _:
                return []

    def _parts(self, place: _Place, parts: tuple[Node, ...], one: bool) -> list[_Place]:
        each = [place.to(part) for part in parts]
        here = [part for part in each if _has(self.when(part.node, part.agent, part.value), place.tick)]
        new = [part for part in here if self.is_new(part)]
        return (new or here)[: 1 if one else MOST_PARTS]

    def _in_window(self, place: _Place, body: Node, low: int, high: int | None, one: bool) -> list[_Place]:
        """A moment of the window: the first that differs from the steps; else a step that says otherwise."""
        first, last = self._window(place.tick, low, high)
        if first > last:
            return []
        if one:
            spans = common(self.when(body, place.agent, place.value), ((first, last),))
            moments = [place.to(body, tick=begin) for begin, _ in spans]
        else:
            moments = [place.to(body, tick=step * STEP) for step in range(-(-first // STEP), last // STEP + 1)]
            moments.append(place.to(body, tick=first))
        return [moment for moment in moments if self.is_new(moment)][:1] or moments[:1]

    def _in_time(self, place: _Place, low: int, high: int | None, one: bool) -> list[_Place]:
        """A moment of the window, or an earlier one at which what has to hold up to it does not."""
        *holds, end = children(place.node)
        goals = self._in_window(place, end, low, high, one)
        for hold in () if one else holds:
            if low < 0:
                return self._after(place, hold, self._window(place.tick, low, high)[0]) or goals
            last = min(self._window(place.tick, low, high)[1], last_asked(self.ahead[hold], self.end))
            breaks = common(self.when(hold, place.agent, place.value), ((place.tick, last),))
            if breaks and not (goals and breaks[0][0] >= goals[0].tick and self._is_so(goals[0])):
                return [place.to(hold, tick=breaks[0][0])]
        return goals

    def _after(self, place: _Place, hold: Node, first: int) -> list[_Place]:
        """The last moment from ``first`` on at which what has to hold since then does not."""
        breaks = common(self.when(hold, place.agent, place.value), ((first, place.tick),))
        return [place.to(hold, tick=breaks[-1][1])] if breaks else []

    def _is_so(self, place: _Place) -> bool:
        return _has(self.when(place.node, place.agent, place.value), place.tick)

    def _window(self, tick: int, low: int, high: int | None) -> tuple[int, int]:
        return max(tick + low * STEP, 0), self.end if high is None else min(self.end, tick + high * STEP)

    def _culprit(self, place: _Place) -> Culprit:
        spans = self.when(place.node, place.agent, place.value)
        low, high = next((span for span in spans if _has((span,), place.tick)), (place.tick, place.tick))
        return Culprit(place.node, place.agent, place.tick, place.value, low, high, place.label, place.says, place.team)


def _has(spans: Spans, tick: int) -> bool:
    return any(low <= tick <= high for low, high in spans)
