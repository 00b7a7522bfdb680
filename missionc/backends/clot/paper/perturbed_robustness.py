"""Values of formulas under a perturbation of one waypoint, for every waypoint and many directions.

Only values that read the moved waypoint are worked out again (``sparsity_pattern``). Those of conjunctions
are given by rules of their own (``paper_rules``).

Source:
    [clot] IV-A.2, for what is asked.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import reduce
from math import inf
from typing import assert_never

import torch
from torch import Tensor

from missionc.backends.clot.cost_graph.leaf_margins import UNLIMITED
from missionc.backends.clot.cost_graph.motion_batch import States, Team, velocities
from missionc.backends.clot.cost_graph.robustness import Robustness
from missionc.backends.clot.cost_graph.route_metres import length_value
from missionc.backends.clot.paper.perturbed_leaves import moved_links, moved_margin
from missionc.backends.clot.paper.sparsity_pattern import Rows, SparsityPattern, TermPattern, window
from missionc.backends.clot.torch_device import places
from missionc.ir import Graph, Predicate
from missionc.kernel import nodes as kernel
from missionc.kernel.nodes import Node, RouteNode, UntilNode, WindowNode


class Perturbed(ABC):
    """Values of terms where a waypoint is moved.

    A value is (batch, rows, steps, offsets, directions), laid out as the term's
    ``TermPattern`` says: the value at a step where the waypoint that many steps
    ahead of it is moved.

    Args:
        position: (batch, agents, steps, dim), metres.
        probes: where each waypoint of the agent is moved to, (batch, steps, directions, dim), metres.
    """

    def __init__(self, patterns: SparsityPattern, team: Team, position: Tensor, probes: Tensor) -> None:
        self.patterns, self.team, self.position, self.probes = patterns, team, position, probes
        self.unmoved = Robustness(team, States(position, velocities(position, team.mission.step)))
        self.standard = self.unmoved.values(patterns.order)
        self.values: dict[Node, Tensor] = {}
        self.margins: dict[tuple[Predicate, int, int], Tensor] = {}

    def goals(self) -> Tensor:
        """The robustness of each goal: (goals, batch, waypoints, directions), metres."""
        for term in self.patterns.order:
            if term in self.patterns.of:
                self.values[term] = self.value(term, self.patterns.of[term])
        batch, steps, directions, _ = self.probes.shape
        found = []
        for goal in self.patterns.goals:
            whole = self.standard[goal][:, :1, :1].expand(batch, steps, directions).clone()
            pattern = self.patterns.of.get(goal)
            if pattern is not None and (pattern.rows is None or 0 in pattern.rows):
                low, high = max(pattern.low, 0), min(pattern.high, steps - 1)
                whole[:, low : high + 1] = self.values[goal][:, 0, 0, low - pattern.low : high - pattern.low + 1]
            found.append(whole)
        return torch.stack(found)

    @abstractmethod
    def conjunction(self, node: kernel.All | kernel.Always | UntilNode, pattern: TermPattern) -> Tensor:
        """The value of what asks for several things at once, from those of the formulas below it."""

    def value(self, node: Node, pattern: TermPattern) -> Tensor:
        """The value of a formula from those of the formulas below it."""
        match node:
            case kernel.Atom(predicate):
                return self._margin(predicate, pattern)
            case kernel.Not(kernel.Atom(predicate)):
                return -self._margin(predicate, pattern)
            case kernel.All() | kernel.Always() | kernel.Until() | kernel.Release():
                return self.conjunction(node, pattern)
            case kernel.Any(parts):
                return self._full(reduce(torch.maximum, [self.laid(part, pattern) for part in parts]), pattern)
            case kernel.AtLeast(count, parts):
                each = torch.stack([self._full(self.laid(part, pattern), pattern) for part in parts])
                return each.sort(dim=0, descending=True).values[count - 1]
            case kernel.Eventually(body):
                greatest = self.everywhere(-inf, pattern)
                for ahead in self.ahead(node, pattern):
                    later = self.laid(body, pattern, ahead=ahead)
                    here = greatest[:, :, : later.shape[2]]
                    here.copy_(torch.maximum(here, later))
                return greatest
            case kernel.At(agent, body):
                below = self.patterns.of[body]
                row = 0 if below.rows is None else below.rows.index(agent)
                first = pattern.first - below.first
                return self.values[body][:, row : row + 1, first : first + pattern.steps]
            case kernel.Neighbour(graph, body):
                return self._linked(graph, self.laid(body, pattern, graph.agents), pattern, body)
            case kernel.EveryNeighbour(graph, body):
                return -self._linked(graph, -self.laid(body, pattern, graph.agents), pattern, body)
            case kernel.Route() | kernel.EveryRoute():
                return self._route(node, pattern)
            case kernel.Is() | kernel.Not() | kernel.Reach() | kernel.EveryReach() | kernel.PathLength():
                raise AssertionError("no motion changes it, or not in a cost graph")
            case _:
                assert_never(node)

    def ahead(self, node: WindowNode | UntilNode, pattern: TermPattern) -> range:
        """The steps ahead that a window looks at, from the first step at which it is needed."""
        shape = window(node)
        width = shape.width((pattern.first, pattern.first + pattern.steps - 1), self.position.shape[2])
        return range(shape.first, shape.first + width)

    def laid(self, part: Node, pattern: TermPattern, rows: Rows = None, ahead: int = 0) -> Tensor:
        """A part's values as they lie in a term: 1 in place of what they do not depend on.

        Args:
            pattern: of the term.
            rows: the agents asked for; the pattern's, where None.
            ahead: for a part read that many steps ahead; at fewer steps, where it would run past the last one.
        """
        rows = pattern.rows if rows is None else rows
        first = pattern.first + ahead
        count = min(pattern.steps, self.position.shape[2] - first)
        value = self._rows(self.standard[part], rows)
        value = self.unmoved.spread(value)[:, :, first : first + count, None, None]
        below = self.patterns.of.get(part)
        if below is None:
            return value
        new = self.values[part][:, :, first - below.first : first - below.first + count]
        start = below.low + ahead - pattern.low
        size = new.shape[3]
        offsets = pattern.high - pattern.low + 1
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

    def everywhere(self, value: float, pattern: TermPattern) -> Tensor:
        return self.position.new_full((self.probes.shape[0], *pattern.nonzero.shape, self.probes.shape[2]), value)

    def _margin(self, predicate: Predicate, pattern: TermPattern) -> Tensor:
        key = (predicate, pattern.first, pattern.steps)
        if key not in self.margins:
            self.margins[key] = moved_margin(
                predicate, pattern, self.team, self.position, self.patterns.agent, self.probes
            )
        return self.margins[key]

    def _linked(self, graph: Graph, body: Tensor, pattern: TermPattern, term: Node) -> Tensor:
        """``Neighbour`` for each of the graph's agents: only changed agents and links are looked at again."""
        members, agent = list(graph.agents), self.patterns.agent
        here = slice(pattern.first, pattern.first + pattern.steps)
        links = self.unmoved.links(graph)[:, here]
        now = -pattern.low
        below = self.patterns.of.get(term)
        rows = () if below is None else members if below.rows is None else below.rows
        changed = [place for place, member in enumerate(members) if member in rows or member == agent]
        unchanged = [place for place in range(len(members)) if place not in changed]
        batch, directions = self.probes.shape[0], self.probes.shape[2]
        shape = (batch, len(members), pattern.steps, pattern.high - pattern.low + 1, directions)
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

    def _route(self, term: RouteNode, pattern: TermPattern) -> Tensor:
        """Judged again where it changes, as ``route_metres`` says."""
        batch, agents, _, dim = self.position.shape
        directions, everyone = self.probes.shape[2], tuple(range(agents))
        here = slice(pattern.first, pattern.first + pattern.steps)
        parts = [self.laid(part, pattern, everyone) for part in (term.through, term.end)]
        unmoved = self.position[:, :, here, None].expand(-1, -1, -1, directions, -1)
        found = []
        for index, offset in enumerate(range(pattern.low, pattern.high + 1)):
            places = unmoved
            if offset == 0:
                places = unmoved.clone()
                places[:, self.patterns.agent] = self.probes[:, here]
            position = places.reshape(batch, agents, -1, dim)
            whole = (batch, agents, pattern.steps, pattern.high - pattern.low + 1, directions)
            given = [part.expand(whole)[:, :, :, index].reshape(batch, agents, -1) for part in parts]
            value = length_value(term, self.team, States(position, torch.zeros_like(position)), *given)
            found.append(value.reshape(batch, agents, pattern.steps, directions))
        return torch.stack(found, dim=3)

    def _rows(self, value: Tensor, rows: Rows) -> Tensor:
        return value if rows is None or value.shape[1] == 1 else value[:, places(rows, value.device)]

    def _full(self, value: Tensor, pattern: TermPattern) -> Tensor:
        rows = 1 if pattern.rows is None else len(pattern.rows)
        offsets = pattern.high - pattern.low + 1
        return value.expand(self.probes.shape[0], rows, pattern.steps, offsets, self.probes.shape[2])
