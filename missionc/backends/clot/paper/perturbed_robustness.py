"""Exact robustness of goals under a perturbation of one waypoint, for every waypoint and many directions.

Only values that read the moved waypoint are worked out again (``sparsity_pattern``). A
temporal term is a chain of steps, each of which turns the value from the next
step on into the one from here on by ``max(end, min(hold, value))``; chains of
such steps join into one of the same form, so what lies before and after the
touched steps is summed up once, for all directions.

Source:
    [clot] IV-A.2, for what is asked; the values here are those of II-B.
"""

from __future__ import annotations

from functools import reduce
from math import inf
from typing import assert_never

import torch
from torch import Tensor
from torch.nn.functional import pad

from missionc.backends.clot.cost_graph.cost_graph import (
    EveryLinked,
    Greatest,
    GreatestOver,
    Least,
    LeastOver,
    Length,
    Margin,
    Member,
    Of,
    Ranked,
    Release,
    SomeLinked,
    Term,
    Until,
)
from missionc.backends.clot.cost_graph.leaf_margins import UNLIMITED
from missionc.backends.clot.cost_graph.motion_batch import States, Team, velocities
from missionc.backends.clot.cost_graph.robustness import Robustness
from missionc.backends.clot.cost_graph.route_metres import length_value
from missionc.backends.clot.paper.perturbed_leaves import moved_links, moved_margin
from missionc.backends.clot.paper.sparsity_pattern import Rows, SparsityPattern, TermPattern, Window, window
from missionc.backends.clot.torch_device import places
from missionc.ir import Graph, Predicate


class Perturbed:
    """Values of terms where a waypoint is moved.

    A value is (batch, rows, steps, offsets, directions), laid out as the term's
    ``TermPattern`` says: the value at a step where the waypoint that many steps
    ahead of it is moved.

    Args:
        position: (batch, agents, steps, dim), metres.
        probes: where each waypoint of the agent is moved to, (batch, steps, directions, dim), metres.
    """

    def __init__(self, readings: SparsityPattern, team: Team, position: Tensor, probes: Tensor) -> None:
        self.readings, self.team, self.position, self.probes = readings, team, position, probes
        self.unmoved = Robustness(team, States(position, velocities(position, team.mission.step)))
        self.standard = self.unmoved.values(readings.order)
        self.values: dict[Term, Tensor] = {}
        self.margins: dict[tuple[Predicate, int, int], Tensor] = {}

    def goals(self) -> Tensor:
        """The robustness of each goal: (goals, batch, waypoints, directions), metres."""
        for term in self.readings.order:
            if term in self.readings.of:
                self.values[term] = self.value(term, self.readings.of[term])
        batch, steps, directions, _ = self.probes.shape
        found = []
        for goal in self.readings.goals:
            whole = self.standard[goal][:, :1, :1].expand(batch, steps, directions).clone()
            reading = self.readings.of.get(goal)
            if reading is not None and (reading.rows is None or 0 in reading.rows):
                low, high = max(reading.low, 0), min(reading.high, steps - 1)
                whole[:, low : high + 1] = self.values[goal][:, 0, 0, low - reading.low : high - reading.low + 1]
            found.append(whole)
        return torch.stack(found)

    def value(self, term: Term, reading: TermPattern) -> Tensor:
        """The value of a term from those of the terms below it."""
        match term:
            case Margin(predicate, holds):
                value = self._margin(predicate, reading)
                return value if holds else -value
            case Least(parts):
                return self._full(reduce(torch.minimum, [self.laid(part, reading) for part in parts]), reading)
            case Greatest(parts):
                return self._full(reduce(torch.maximum, [self.laid(part, reading) for part in parts]), reading)
            case Ranked(count, parts):
                each = torch.stack([self._full(self.laid(part, reading), reading) for part in parts])
                return each.sort(dim=0, descending=True).values[count - 1]
            case LeastOver() | GreatestOver() | Until() | Release():
                return self.over(window(term), reading)
            case Of(agent, body):
                below = self.readings.of[body]
                row = 0 if below.rows is None else below.rows.index(agent)
                first = reading.first - below.first
                return self.values[body][:, row : row + 1, first : first + reading.steps]
            case SomeLinked(graph, body):
                return self._linked(graph, self.laid(body, reading, graph.agents), reading, body)
            case EveryLinked(graph, body):
                return -self._linked(graph, -self.laid(body, reading, graph.agents), reading, body)
            case Length():
                return self._length(term, reading)
            case Member():
                raise AssertionError("no motion changes who an agent is")
            case _:
                assert_never(term)

    def laid(self, part: Term, reading: TermPattern, rows: Rows = None, ahead: int = 0) -> Tensor:
        """A part's values as they lie in a term: 1 in place of what they do not depend on.

        Args:
            reading: of the term.
            rows: the agents asked for; the reading's, where None.
            ahead: for a part read that many steps ahead; at fewer steps, where it would run past the last one.
        """
        rows = reading.rows if rows is None else rows
        first = reading.first + ahead
        count = min(reading.steps, self.position.shape[2] - first)
        value = self._rows(self.standard[part], rows)
        value = self.unmoved.spread(value)[:, :, first : first + count, None, None]
        below = self.readings.of.get(part)
        if below is None:
            return value
        new = self.values[part][:, :, first - below.first : first - below.first + count]
        start = below.low + ahead - reading.low
        size = new.shape[3]
        offsets = reading.high - reading.low + 1
        if start == 0 and size == offsets and (below.rows is None or below.rows == rows):
            return new
        batch, height = new.shape[0], 1 if below.rows is None and rows is None else len(rows or (0,))
        whole = value.expand(batch, height, count, offsets, new.shape[-1]).clone()
        if rows is None or below.rows is None:
            whole[:, :, :, start : start + size] = new
        else:
            for index, row in enumerate(below.rows):
                if row in rows:
                    whole[:, rows.index(row), :, start : start + size] = new[:, index]
        return whole

    def over(self, shape: Window, reading: TermPattern) -> Tensor:
        """A temporal term's values: the touched steps between what is before and what is after them."""
        needed = (reading.first, reading.first + reading.steps - 1)
        width = shape.width(needed, self.position.shape[2])
        sign = -1.0 if shape.negative else 1.0
        low = reading.low - shape.first
        spare = reading.high - reading.low + 1 - width
        opened = torch.arange(width, device=self.position.device) + shape.first >= shape.low

        def end_at(value: Tensor) -> Tensor:
            """Only from the window's first step on."""
            return (
                value
                if shape.first >= shape.low
                else value.masked_fill(~opened.view(-1, *[1] * (value.dim() - 4)), -inf)
            )

        end = end_at(self._unrolled(shape.end, reading, shape.first, width, sign, -inf))
        hold = None if shape.hold is None else self._unrolled(shape.hold, reading, shape.first, width, sign, inf)
        after = end.flip(-1).cummax(dim=-1).values.flip(-1) if hold is None else _from_each_step(hold, end)
        held = None if hold is None else pad(hold.cummin(dim=-1).values[..., :-1], (1, 0), value=inf)
        before = (end if held is None else torch.minimum(held, end)).cummax(dim=-1).values[..., :-1]
        batch, directions = self.probes.shape[0], self.probes.shape[2]
        value = pad(after[..., 1:], (0, spare + 1), value=-inf)[..., None]
        rows = 1 if reading.rows is None else len(reading.rows)
        value = value.expand(batch, rows, reading.steps, spare + width, directions).clone()
        for offset in range(low, low + spare + 1):
            piece = value[:, :, :, offset - low : offset - low + width]
            if shape.hold is not None and hold is not None:
                moved = self._touched(shape.hold, reading, shape.first, width, sign, inf, offset)
                piece.copy_(torch.minimum(piece, hold[..., None] if moved is None else moved))
            moved = self._touched(shape.end, reading, shape.first, width, sign, -inf, offset)
            piece.copy_(torch.maximum(piece, end[..., None] if moved is None else end_at(moved)))
        if held is not None:
            value = torch.minimum(value, pad(held, (spare, 0), value=inf)[..., None])
        return sign * torch.maximum(value, pad(before, (spare + 1, 0), value=-inf)[..., None])

    def _unrolled(self, part: Term, reading: TermPattern, first: int, width: int, sign: float, beyond: float) -> Tensor:
        """Where nothing is moved, the values of the steps ahead of each: (batch, rows, steps, width)."""
        value = self.unmoved.spread(self._rows(self.standard[part], reading.rows))
        start = reading.first + first
        value = sign * value[:, :, start : start + reading.steps + width - 1]
        missing = reading.steps + width - 1 - value.shape[2]
        return pad(value, (0, missing), value=beyond).unfold(2, width, 1)

    def _touched(
        self, part: Term, reading: TermPattern, first: int, width: int, sign: float, beyond: float, offset: int
    ) -> Tensor | None:
        """The same where a waypoint is moved, ``offset`` after the step ahead: with directions as a last axis.

        None where that moves nothing.
        """
        below = self.readings.of.get(part)
        if below is None or not below.low <= offset <= below.high:
            return None
        start = reading.first + first - below.first
        value = sign * self.values[part][:, :, start : start + reading.steps + width - 1, offset - below.low]
        missing = reading.steps + width - 1 - value.shape[2]
        value = pad(value, (0, 0, 0, missing), value=beyond).unfold(2, width, 1).movedim(-1, 3)
        if below.rows is None or below.rows == reading.rows:
            return value
        rows = reading.rows
        assert rows is not None
        unmoved = self._unrolled(part, reading, first, width, sign, beyond)[..., None]
        whole = unmoved.expand(len(value), len(rows), *value.shape[2:]).clone()
        for index, row in enumerate(below.rows):
            whole[:, rows.index(row)] = value[:, index]
        return whole

    def _margin(self, predicate: Predicate, reading: TermPattern) -> Tensor:
        key = (predicate, reading.first, reading.steps)
        if key not in self.margins:
            self.margins[key] = moved_margin(
                predicate, reading, self.team, self.position, self.readings.agent, self.probes
            )
        return self.margins[key]

    def _linked(self, graph: Graph, body: Tensor, reading: TermPattern, term: Term) -> Tensor:
        """``SomeLinked`` for each of the graph's agents: only changed agents and links are looked at again."""
        members, agent = list(graph.agents), self.readings.agent
        here = slice(reading.first, reading.first + reading.steps)
        links = self.unmoved.links(graph)[:, here]
        now = -reading.low
        below = self.readings.of.get(term)
        rows = () if below is None else members if below.rows is None else below.rows
        changed = [place for place, member in enumerate(members) if member in rows or member == agent]
        unchanged = [place for place in range(len(members)) if place not in changed]
        batch, directions = self.probes.shape[0], self.probes.shape[2]
        shape = (batch, len(members), reading.steps, reading.high - reading.low + 1, directions)
        body = body.expand(shape)
        value = links.new_full((), -UNLIMITED).expand(shape)
        if unchanged:
            still = places(unchanged, links.device)
            there = body[:, still, :, 0, 0].transpose(1, 2)[:, :, None]
            best = torch.minimum(links[..., still], there).amax(dim=-1)
            value = best.transpose(1, 2)[..., None, None].expand(shape)
        moved = moved_links(graph, self.position, agent, self.probes, here) if agent in members else None
        for place in changed:
            link = links[..., place].transpose(1, 2)[..., None, None].expand(shape)
            if moved is not None and members[place] == agent:
                link = link.clone()
                link[:, :, :, now] = moved
            value = torch.maximum(value, torch.minimum(link, body[:, place : place + 1]))
        if moved is not None:
            value[:, members.index(agent), :, now] = torch.minimum(moved, body[:, :, :, now]).amax(dim=1)
        return value

    def _length(self, term: Length, reading: TermPattern) -> Tensor:
        """Judged again where it changes, as ``route_metres`` says."""
        batch, agents, _, dim = self.position.shape
        directions, everyone = self.probes.shape[2], tuple(range(agents))
        here = slice(reading.first, reading.first + reading.steps)
        parts = [self.laid(part, reading, everyone) for part in (term.through, term.end)]
        unmoved = self.position[:, :, here, None].expand(-1, -1, -1, directions, -1)
        found = []
        for index, offset in enumerate(range(reading.low, reading.high + 1)):
            places = unmoved
            if offset == 0:
                places = unmoved.clone()
                places[:, self.readings.agent] = self.probes[:, here]
            position = places.reshape(batch, agents, -1, dim)
            whole = (batch, agents, reading.steps, reading.high - reading.low + 1, directions)
            given = tuple(part.expand(whole)[:, :, :, index].reshape(batch, agents, -1) for part in parts)
            value = length_value(term, self.team, States(position, torch.zeros_like(position)), given)
            found.append(value.reshape(batch, agents, reading.steps, directions))
        return torch.stack(found, dim=3)

    def _rows(self, value: Tensor, rows: Rows) -> Tensor:
        return value if rows is None or value.shape[1] == 1 else value[:, places(rows, value.device)]

    def _full(self, value: Tensor, reading: TermPattern) -> Tensor:
        rows = 1 if reading.rows is None else len(reading.rows)
        offsets = reading.high - reading.low + 1
        return value.expand(self.probes.shape[0], rows, reading.steps, offsets, self.probes.shape[2])


def _from_each_step(hold: Tensor, end: Tensor) -> Tensor:
    """``end`` at some step from each on, ``hold`` at every one before it: along the last axis, by doubling."""
    done, width = 1, hold.shape[-1]
    while done < width:
        later_hold, later_end = (
            pad(each[..., done:], (0, done), value=beyond) for each, beyond in ((hold, inf), (end, -inf))
        )
        end, hold = torch.maximum(end, torch.minimum(hold, later_end)), torch.minimum(hold, later_hold)
        done *= 2
    return end
