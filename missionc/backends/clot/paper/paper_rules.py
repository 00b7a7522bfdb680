"""Paper's estimate of robustness under a moved waypoint, by its four rules.

A minimum hides all but the worst of its parts, so the paper replaces it above a moved waypoint. (I) A leaf has its
value with the waypoint moved. (II) A conjunction directly above a leaf that reads the waypoint has that leaf's value
(the least of several). (III) A conjunction further up has the mean of its parts. (IV) A disjunction has the maximum.
Formulas that do not read the waypoint have their usual value.

A leaf is a formula of one time, like the paper's predicates: "all robots are in the region" is its μ_A, and a
disjunction of two leaves reads the waypoint at that time only. Therefore ``always (row or parked)`` has the value at
the waypoint's time; with a mean, each waypoint would count for one step among all. Formulas over links are leaves too.
``a until b`` is read as ``b or (a and the same one step later)``, ``release`` as ``b and (a or ...)``. Infinite parts
are excluded from means.

Source:
    [clot] IV-A.2.

Robustness of formulas under a perturbation of one waypoint, for every waypoint and many directions.

Only values that read the moved waypoint are recomputed (``sparsity_pattern``). Conjunctions have separate rules
(``paper_rules``). A leaf reads one step, so the moved positions of a step are treated like separate steps, with the
formulas of ``leaf_margins``.

Source:
    [clot] IV-A.2.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import reduce
from math import inf
from typing import TypeAlias, assert_never

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.cost_graph.cost_graph import Unrolled, signed_predicate
from missionc.backends.clot.paper.leaf_margins import UNLIMITED, margin
from missionc.backends.clot.paper.motion_batch import States, Team, velocities
from missionc.backends.clot.paper.robustness import Robustness, length_value
from missionc.backends.clot.paper.sparsity_pattern import NodePattern, Rows, SparsityPattern, mark
from missionc.backends.clot.paper.torch_device import places
from missionc.base.trace import Flags
from missionc.ir import Graph, Predicate
from missionc.ir.kernel.nodes import (
    All,
    Any,
    At,
    AtLeast,
    Atom,
    Is,
    NeighbourNode,
    Node,
    Not,
    RouteNode,
    UntilNode,
    WindowNode,
)
from missionc.ir.kernel.walk import asks, children
from missionc.ir.language.margins.predicate_margins import link_margin


def moved_margin(
    predicate: Predicate, reading: NodePattern, team: Team, position: Tensor, agent: int, probes: Tensor
) -> Tensor:
    """Margin of a predicate with one waypoint moved: (batch, rows, steps, offsets, directions), metres.

    Args:
        reading: rows, steps and offsets to compute.
        position: (batch, agents, steps, dim), metres.
        probes: positions of each moved waypoint of ``agent``, (batch, steps, directions, dim), metres.
    """
    read = sorted({agent, *(reading.rows or ()), *predicate.others})
    own = read.index(agent)
    reads = places(read, position.device)
    sub = Team(team.mission, team.radius[reads], team.altitude[reads])
    here = slice(reading.first, reading.first + reading.steps)
    batch, _, directions, dim = probes.shape
    others = position[:, reads, here, None].expand(-1, -1, -1, directions, -1)
    speeds = _moved_velocities(position[:, agent], probes, team.mission.step) if predicate.reads_speed else ()
    values = []
    for offset in range(reading.low, reading.high + 1):
        moved = others
        if offset == 0:
            moved = others.clone()
            moved[:, own] = probes[:, here]
        speed = torch.zeros_like(moved)
        if speeds:
            speed[:] = velocities(position, team.mission.step)[:, reads, here, None]
            speed[:, own] = speeds[offset + 1][:, here]
        states = States(*(each.reshape(batch, len(read), -1, dim) for each in (moved, speed)))
        value = margin(predicate, sub, states, read)
        rows = [0] if reading.rows is None else [read.index(row) for row in reading.rows]
        values.append(value[:, places(rows, value.device)].reshape(batch, len(rows), reading.steps, directions))
    return torch.stack(values, dim=3)


def moved_links(graph: Graph, position: Tensor, agent: int, probes: Tensor, here: slice, back: bool) -> Tensor:
    """Margins of links from the moved agent to the graph's members, or with ``back`` in the reverse direction.

    Shape: (batch, members, steps, directions), metres.

    Args:
        position: (batch, agents, steps, dim), metres.
        probes: positions of each moved waypoint of ``agent``, (batch, steps, directions, dim), metres.
        here: steps to compute.
    """
    members = np.array(graph.agents, dtype=np.int64)
    others, moved = position[:, places(graph.agents, position.device), here, None, :], probes[:, None, here]
    named = members[:, None, None]
    links = (
        link_margin(graph, named, agent, others, moved, xp=torch)
        if back
        else link_margin(graph, agent, named, moved, others, xp=torch)
    )
    assert isinstance(links, Tensor)
    links[:, graph.agents.index(agent)] = -UNLIMITED
    return links


def _moved_velocities(own: Tensor, probes: Tensor, step: float) -> tuple[Tensor, Tensor, Tensor]:
    """Velocities of the moved agent, (batch, steps, directions, dim), m/s, with the previous, the own, or the next
    waypoint moved.

    The previous waypoint matters only at the last step.
    """
    own = own[:, :, None].expand_as(probes)
    still = velocities(own.transpose(1, 2), step).transpose(1, 2)
    if own.shape[1] < 2:
        return still, still, still
    before = torch.cat([still[:, :-1], (own[:, -1:] - probes[:, -2:-1]) / step], dim=1)
    at = torch.cat([(own[:, 1:] - probes[:, :-1]) / step, (probes[:, -1:] - own[:, -2:-1]) / step], dim=1)
    after = torch.cat([(probes[:, 1:] - own[:, :-1]) / step, still[:, -1:]], dim=1)
    return before, at, after


class Perturbed(ABC):
    """Robustness of formulas with one waypoint moved.

    A value is (batch, rows, steps, offsets, directions), metres, laid out by the formula's ``NodePattern``: the value
    at a step with the waypoint moved that is ``offset`` steps later.

    Args:
        position: (batch, agents, steps, dim), metres.
        probes: positions of each moved waypoint of the agent, (batch, steps, directions, dim), metres.
    """

    def __init__(self, patterns: SparsityPattern, team: Team, position: Tensor, probes: Tensor) -> None:
        self.patterns, self.team, self.position, self.probes = patterns, team, position, probes
        self.unmoved = Robustness(team, States(position, velocities(position, team.mission.step)))
        self.standard = self.unmoved.values(patterns.order)
        self.values: dict[Node, Tensor] = {}
        self.margins: dict[tuple[Predicate, int, int], Tensor] = {}

    def goals(self) -> Tensor:
        """Robustness of each goal after moving one waypoint in one direction: (goals, batch, waypoints, directions),
        metres."""
        for node in self.patterns.order:
            if node in self.patterns.of:
                self.values[node] = self.value(node, self.patterns.of[node])
        batch, steps, directions, _ = self.probes.shape
        robustness = []
        for goal in self.patterns.goals:
            whole = self.standard[goal][:, :1, :1].expand(batch, steps, directions).clone()
            pattern = self.patterns.of.get(goal)
            if pattern is not None and (pattern.rows is None or 0 in pattern.rows):
                low, high = max(pattern.low, 0), min(pattern.high, steps - 1)
                whole[:, low : high + 1] = self.values[goal][:, 0, 0, low - pattern.low : high - pattern.low + 1]
            robustness.append(whole)
        return torch.stack(robustness)

    @abstractmethod
    def conjunction(self, node: All | WindowNode | UntilNode, pattern: NodePattern) -> Tensor:
        """Value of a conjunctive node from its children: (batch, rows, steps, offsets, directions), metres."""

    def value(self, node: Node, pattern: NodePattern) -> Tensor:
        """Value of a node from its children: (batch, rows, steps, offsets, directions), metres."""
        assert not isinstance(node, Is | Unrolled), "a cost graph cannot express the node"
        if isinstance(node, WindowNode) and not node.every:
            return self._eventually(node, pattern)
        if isinstance(node, All | WindowNode | UntilNode):
            return self.conjunction(node, pattern)
        if isinstance(node, NeighbourNode):
            sign = -1 if node.every else 1
            return sign * self._linked(
                node.graph, sign * self.laid(node.body, pattern, node.graph.agents), pattern, node.body
            )
        if isinstance(node, RouteNode):
            return self._route(node, pattern)
        match node:
            case Atom() | Not():
                predicate, holds = signed_predicate(node)
                return self._margin(predicate, pattern) if holds else -self._margin(predicate, pattern)
            case Any(parts):
                return self._full(reduce(torch.maximum, [self.laid(part, pattern) for part in parts]), pattern)
            case AtLeast(count, parts):
                each = torch.stack([self._full(self.laid(part, pattern), pattern) for part in parts])
                return each.sort(dim=0, descending=True).values[count - 1]
            case At(agent, body):
                below = self.patterns.of[body]
                row = 0 if below.rows is None else below.rows.index(agent)
                first = pattern.first - below.first
                return self.values[body][:, row : row + 1, first : first + pattern.steps]
            case _:
                assert_never(node)

    def ahead(self, node: WindowNode | UntilNode, pattern: NodePattern) -> range:
        """Steps ahead in a window, from the first step ahead at which a child is needed."""
        last = self.position.shape[2] - 1 - pattern.first if node.high is None else node.high
        return range(min(ask.low for ask in asks(node)), last + 1)

    def laid(self, part: Node, pattern: NodePattern, rows: Rows = None, ahead: int = 0) -> Tensor:
        """Values of a part in the layout of its parent, metres, with size 1 for axes that do not matter.

        Args:
            pattern: pattern of the parent, (rows, steps, offsets).
            rows: agents to compute; None for the rows of the pattern.
            ahead: number of steps by which the part is read ahead; fewer steps result at the mission's end.
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

    def is_leaf(self, node: Node) -> bool:
        return node in self.patterns.leaves

    def at_moment(self, part: Node) -> bool:
        """Return true if a part is a leaf whose values read only the waypoint of their own time."""
        below = self.patterns.of.get(part)
        return self.is_leaf(part) and below is not None and below.low == below.high == 0 and bool(below.nonzero.all())

    def _eventually(self, node: WindowNode, pattern: NodePattern) -> Tensor:
        if pattern.steps == 1 and self.at_moment(node.body):
            return self._greatest_of_moments(node.body, pattern)
        greatest = self.everywhere(-inf, pattern)
        for ahead in self.ahead(node, pattern):
            later = self.laid(node.body, pattern, ahead=ahead)
            here = greatest[:, :, : later.shape[2]]
            here.copy_(torch.maximum(here, later))
        return greatest

    def _greatest_of_moments(self, part: Node, pattern: NodePattern) -> Tensor:
        """Value of ``eventually`` over a single-time leaf: the larger of the moved time's value and the best of the
        other times.

        Shape: (batch, rows, 1, offsets, directions), metres.
        """
        moments = slice(pattern.first + pattern.low, pattern.first + pattern.high + 1)
        still = self.unmoved.spread(self._rows(self.standard[part], pattern.rows))[:, :, moments]
        best = still.topk(min(2, still.shape[2]), dim=2)
        number = torch.arange(still.shape[2], device=still.device)
        rest = torch.where(number == best.indices[:, :, :1], best.values[:, :, -1:], best.values[:, :, :1])
        first = moments.start - self.patterns.of[part].first
        moved = self.values[part][:, :, first : first + len(number), 0]
        return (torch.maximum(rest[..., None], moved) if len(number) > 1 else moved)[:, :, None]

    def everywhere(self, value: float, pattern: NodePattern) -> Tensor:
        """Constant values in the layout of a pattern: (batch, rows, steps, offsets, directions), metres."""
        return self.position.new_full((self.probes.shape[0], *pattern.nonzero.shape, self.probes.shape[2]), value)

    def _margin(self, predicate: Predicate, pattern: NodePattern) -> Tensor:
        key = (predicate, pattern.first, pattern.steps)
        if key not in self.margins:
            self.margins[key] = moved_margin(
                predicate, pattern, self.team, self.position, self.patterns.agent, self.probes
            )
        return self.margins[key]

    def _linked(self, graph: Graph, body: Tensor, pattern: NodePattern, part: Node) -> Tensor:
        """Value of ``Neighbour`` for each member of the graph; only changed agents and links are recomputed.

        Shape: (batch, members, steps, offsets, directions), metres.
        """
        members, agent = list(graph.agents), self.patterns.agent
        here = slice(pattern.first, pattern.first + pattern.steps)
        links = self.unmoved.links(graph)[:, here]
        now = -pattern.low
        below = self.patterns.of.get(part)
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
        moved, back = (
            moved_links(graph, self.position, agent, self.probes, here, way) if agent in members else None
            for way in (False, True)
        )
        for place in changed:
            link = links[..., place].transpose(1, 2)[..., None, None].expand(shape)
            if back is not None and members[place] == agent:
                link = link.clone()
                link[:, :, :, now] = back
            value = torch.maximum(value, torch.minimum(link, body[:, place : place + 1]))
        if moved is not None:
            value[:, members.index(agent), :, now] = torch.minimum(moved, body[:, :, :, now]).amax(dim=1)
        return value

    def _route(self, node: RouteNode, pattern: NodePattern) -> Tensor:
        """Value of ``Route``, recomputed as in ``length_value``.

        Shape: (batch, rows, steps, offsets, directions), metres.
        """
        batch, agents, _, dim = self.position.shape
        directions, everyone = self.probes.shape[2], tuple(range(agents))
        here = slice(pattern.first, pattern.first + pattern.steps)
        parts = [self.laid(part, pattern, everyone) for part in (node.through, node.end)]
        unmoved = self.position[:, :, here, None].expand(-1, -1, -1, directions, -1)
        values = []
        for index, offset in enumerate(range(pattern.low, pattern.high + 1)):
            places = unmoved
            if offset == 0:
                places = unmoved.clone()
                places[:, self.patterns.agent] = self.probes[:, here]
            position = places.reshape(batch, agents, -1, dim)
            whole = (batch, agents, pattern.steps, pattern.high - pattern.low + 1, directions)
            given = [part.expand(whole)[:, :, :, index].reshape(batch, agents, -1) for part in parts]
            value = length_value(node, self.team, States(position, torch.zeros_like(position)), *given)
            values.append(value.reshape(batch, agents, pattern.steps, directions))
        return torch.stack(values, dim=3)

    def _rows(self, value: Tensor, rows: Rows) -> Tensor:
        return value if rows is None or value.shape[1] == 1 else value[:, places(rows, value.device)]

    def _full(self, value: Tensor, pattern: NodePattern) -> Tensor:
        rows = 1 if pattern.rows is None else len(pattern.rows)
        offsets = pattern.high - pattern.low + 1
        return value.expand(self.probes.shape[0], rows, pattern.steps, offsets, self.probes.shape[2])


Reading: TypeAlias = tuple[Tensor, Flags]
"""Values, (batch, rows, steps, offsets, directions), metres, with flags (rows, steps, offsets): reads the waypoint."""


class PaperRules(Perturbed):
    """Robustness under a moved waypoint by the paper's four rules.

    Args:
        enough: greatest value of a part in a mean, metres, so that no large margin compensates a failure.
    """

    def __init__(
        self, patterns: SparsityPattern, team: Team, position: Tensor, probes: Tensor, enough: float = inf
    ) -> None:
        super().__init__(patterns, team, position, probes)
        self.enough = enough

    def conjunction(self, node: All | WindowNode | UntilNode, pattern: NodePattern) -> Tensor:
        """Value of a conjunctive node: (batch, rows, steps, offsets, directions), metres."""
        if isinstance(node, UntilNode):
            return self._until(node, pattern)
        if isinstance(node, All) and self.is_leaf(node):
            return self._full(reduce(torch.minimum, [self.laid(part, pattern) for part in node.parts]), pattern)
        if isinstance(node, WindowNode) and self.at_moment(node.body):
            return self._passed(node, pattern)
        whole = self._conjunction(pattern)
        for part in children(node):
            for ahead in (0,) if isinstance(node, All) else self.ahead(node, pattern):
                whole.add(self.laid(part, pattern, ahead=ahead), self._reads(part, pattern, ahead), self.is_leaf(part))
        return whole.value()

    def _passed(self, node: WindowNode, pattern: NodePattern) -> Tensor:
        """Value of ``always`` over a single-time formula by rule II only, at the waypoint's time.

        Shape: (batch, rows, steps, offsets, directions), metres.
        """
        here = slice(pattern.first, pattern.first + pattern.steps)
        still = self.unmoved.spread(self._rows(self.standard[node], pattern.rows))[:, :, here, None, None]
        value, part, below = self._full(still, pattern).clone(), self.values[node.body], self.patterns.of[node.body]
        for offset in self.ahead(node, pattern):
            count, first = self._steps(pattern, offset), pattern.first + offset - below.first
            value[:, :, :count, offset - pattern.low] = part[:, :, first : first + count, 0]
        return value

    def _until(self, node: UntilNode, pattern: NodePattern) -> Tensor:
        """Value of ``until`` or its dual, computed from the last step of the window to the first.

        Shape: (batch, rows, steps, offsets, directions), metres.
        """
        held, ends = (self._or, self._and) if node.every else (self._and, self._or)
        nothing = inf if node.every else -inf
        later, nonzero = self.everywhere(nothing, pattern), np.zeros_like(pattern.nonzero)
        for ahead in reversed(self.ahead(node, pattern)):
            if ahead + 1 in self.ahead(node, pattern):
                goes_on = self._steps(pattern, ahead + 1)
                later, nonzero = held(node.hold, ahead, pattern, later, nonzero)
                later[:, :, goes_on:] = nothing
                nonzero[:, goes_on:] = False
            if ahead >= node.low:
                later, nonzero = ends(node.end, ahead, pattern, later, nonzero)
        return later

    def _and(self, part: Node, ahead: int, pattern: NodePattern, later: Tensor, nonzero: Flags) -> Reading:
        both = self._conjunction(pattern)
        both.add(self.laid(part, pattern, ahead=ahead), self._reads(part, pattern, ahead), self.is_leaf(part))
        both.add(later, nonzero, False)
        return both.value(), both.nonzero

    def _or(self, part: Node, ahead: int, pattern: NodePattern, later: Tensor, nonzero: Flags) -> Reading:
        here = self._steps(pattern, ahead)
        later[:, :, :here] = torch.maximum(later[:, :, :here], self.laid(part, pattern, ahead=ahead))
        nonzero[:, :here] |= self._reads(part, pattern, ahead)
        return later, nonzero

    def _steps(self, pattern: NodePattern, ahead: int) -> int:
        """Number of steps of the pattern for which the step ``ahead`` steps later exists."""
        return min(pattern.steps, self.position.shape[2] - pattern.first - ahead)

    def _reads(self, part: Node, pattern: NodePattern, ahead: int = 0) -> Flags:
        """Flags of the part's values that read the waypoint, in the layout of its parent: (rows, steps, offsets)."""
        rows, _, offsets = pattern.nonzero.shape
        nonzero = np.zeros((rows, self._steps(pattern, ahead), offsets), dtype=bool)
        below = self.patterns.of.get(part)
        if below is not None:
            start = below.low + ahead - pattern.low
            inner = slice(max(start, 0), start + below.nonzero.shape[2])
            mark(nonzero[:, :, inner], pattern.rows, below, pattern.first + ahead)
        return nonzero

    def _conjunction(self, pattern: NodePattern) -> Conjunction:
        return Conjunction(self.everywhere(inf, pattern), np.zeros_like(pattern.nonzero), self.enough)


class Conjunction:
    """Accumulator of a conjunction whose parts are added one after the other.

    Args:
        least: minimum of the parts so far, (batch, rows, steps, offsets, directions), metres.
        nonzero: (rows, steps, offsets), True if a part so far reads the waypoint.
        enough: greatest value of a part in the mean, metres.
    """

    def __init__(self, least: Tensor, nonzero: Flags, enough: float = inf) -> None:
        self.least, self.nonzero, self.enough = least, nonzero, enough
        self.passed, self.leaves = least.clone(), nonzero.copy()
        self.total, self.count = torch.zeros_like(least), torch.zeros_like(least)

    def add(self, value: Tensor, nonzero: Flags, leaf: bool) -> None:
        """Add the value of a part, (batch, rows, steps, offsets, directions), metres; it may be missing at the last
        steps."""
        steps = nonzero.shape[1]
        least, passed, total, count = (each[:, :, :steps] for each in (self.least, self.passed, self.total, self.count))
        least.copy_(torch.minimum(least, value))
        limited = value.abs() < UNLIMITED
        total += torch.where(limited, value.clamp(max=self.enough), 0.0)
        count += limited
        self.nonzero[:, :steps] |= nonzero
        if leaf and nonzero.any():
            self.leaves[:, :steps] |= nonzero
            passed.copy_(torch.minimum(passed, torch.where(_tensor(nonzero, value.device), value, inf)))

    def value(self) -> Tensor:
        """Value of the conjunction: by rule II if a leaf reads the waypoint, by rule III if another part does,
        otherwise the minimum of the parts.

        Shape: (batch, rows, steps, offsets, directions), metres.
        """
        unlimited = (self.count == 0) | (self.least <= -UNLIMITED)
        mean = torch.where(unlimited, self.least, self.total / self.count.clamp(min=1.0))
        above = torch.where(_tensor(self.nonzero, mean.device), mean, self.least)
        return torch.where(_tensor(self.leaves, mean.device), self.passed, above)


def _tensor(nonzero: Flags, device: torch.device) -> Tensor:
    """Boolean tensor of flags: (rows, steps, offsets) -> (1, rows, steps, offsets, 1)."""
    return torch.from_numpy(np.array(nonzero)).to(device, non_blocking=True)[None, ..., None]
