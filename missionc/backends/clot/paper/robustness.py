"""The exact space robustness of a cost graph's formulas, for a batch of joint motions at once.

Source:
    [clot] II-B; [strel] for those over links.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import reduce

import numpy as np
import torch
from torch import Tensor

from missionc.backends.clot.paper.leaf_margins import UNLIMITED, all_links, margin
from missionc.backends.clot.paper.motion_batch import States, Team
from missionc.backends.clot.paper.torch_device import places
from missionc.base.trace import Array, Trace
from missionc.ir import Graph, Predicate
from missionc.ir.kernel.evaluate import Domain, evaluate
from missionc.ir.kernel.nodes import NeighbourNode, Node, PathLength, ReachNode, RouteNode, UntilNode, WindowNode
from missionc.verification.monitoring.evaluate import Evaluation
from missionc.verification.monitoring.logic import ROBUSTNESS


def length_value(node: RouteNode, team: Team, states: States, through: Tensor, end: Tensor) -> Tensor:
    """Robustness of routes with a length, (batch, agents, steps), metres; without gradient.

    Args:
        through: value of the agents on the route, (batch, agents, steps), metres; ``end``: of the last.
    """
    batch, agents, steps, dim = states.position.shape
    position = _numbers(states.position).reshape(agents, -1, dim)
    given = (_numbers(part.expand(batch, agents, steps)).reshape(agents, -1) for part in (through, end))
    trace = Trace(team.mission.step, position, np.zeros_like(position), np.zeros(position.shape[:2]))
    value = Evaluation(ROBUSTNESS, team.mission, trace).route(node, *given)
    value = np.clip(value, -UNLIMITED, UNLIMITED).reshape(agents, batch, steps).swapaxes(0, 1)
    return states.position.new_tensor(value)


def _numbers(value: Tensor) -> Array:
    """Array of a tensor, in its unit such as metres: (batch, agents, ...) -> (agents, batch, ...)."""
    return value.detach().cpu().double().numpy().swapaxes(0, 1)


class Robustness(Domain[Tensor]):
    """Domain of values on given states.

    A value is (batch, agents, steps), with 1 for an axis that does not matter; metres. If a window runs past the last
    step, it is ``-UNLIMITED``; the horizon check ensures that no goal reads that. For partial motions the past is
    unknown: predicates about it, and their negations, are ``UNLIMITED``.
    """

    def __init__(self, team: Team, states: States) -> None:
        self.team, self.states = team, states
        self.margins: dict[Predicate, Tensor] = {}
        self.graphs: dict[Graph, Tensor] = {}

    def values(self, order: Iterable[Node]) -> dict[Node, Tensor]:
        """Value of each of these formulas: (batch, agents, steps), metres."""
        return evaluate(order, self)

    def atom(self, predicate: Predicate, holds: bool) -> Tensor:
        """Margin of a predicate or its negation: (batch, agents, steps), metres."""
        if predicate.reads_past and self.states.position.shape[2] != self.team.mission.steps + 1:
            return self._constant(UNLIMITED)
        if predicate not in self.margins:
            self.margins[predicate] = margin(predicate, self.team, self.states)
        return self.margins[predicate] if holds else -self.margins[predicate]

    def member(self, agents: frozenset[int], holds: bool) -> Tensor:
        """Value of membership: (1, agents, 1), ``UNLIMITED`` metres or its negative."""
        limit = UNLIMITED if holds else -UNLIMITED
        each = [limit if index in agents else -limit for index in range(self.states.position.shape[1])]
        return self.states.position.new_tensor(each)[None, :, None]

    def meet(self, parts: Sequence[Tensor]) -> Tensor:
        """Minimum of the parts: (batch, agents, steps), metres."""
        return reduce(torch.minimum, parts) if parts else self._constant(UNLIMITED)

    def join(self, parts: Sequence[Tensor]) -> Tensor:
        """Maximum of the parts: (batch, agents, steps), metres."""
        return reduce(torch.maximum, parts) if parts else self._constant(-UNLIMITED)

    def at_least(self, count: int, parts: Sequence[Tensor]) -> Tensor:
        """The ``count``-th largest of the parts: (batch, agents, steps), metres."""
        return torch.stack(torch.broadcast_tensors(*parts)).sort(dim=0, descending=True).values[count - 1]

    def window(self, node: WindowNode, body: Tensor) -> Tensor:
        """Value over a window: (batch, agents, steps), metres."""
        if node.every:
            return -over(-self.spread(body), node.low, node.high, UNLIMITED)
        return over(self.spread(body), node.low, node.high, -UNLIMITED)

    def until(self, node: UntilNode, hold: Tensor, end: Tensor) -> Tensor:
        """Value of until or its dual: (batch, agents, steps), metres."""
        if node.every:
            return -until(-self.spread(hold), -self.spread(end), node.low, node.high, UNLIMITED)
        return until(self.spread(hold), self.spread(end), node.low, node.high)

    def at(self, agent: int, body: Tensor) -> Tensor:
        """Value of the body at an agent: (batch, 1, steps), metres."""
        return body if body.shape[1] == 1 else body[:, agent : agent + 1]

    def neighbour(self, node: NeighbourNode, body: Tensor) -> Tensor:
        """Value over neighbours: (batch, agents, steps), metres."""
        graph, some = node.graph, not node.every
        batch, agents, steps, _ = self.states.position.shape
        result = self.states.position.new_full((batch, agents, steps), -UNLIMITED if some else UNLIMITED)
        if len(graph.agents) < 2:
            return result
        members = places(graph.agents, result.device)
        links = self.links(graph)
        there = body.expand(batch, agents, steps)[:, members].transpose(1, 2)[:, :, None, :]
        best = torch.minimum(links, there).amax(dim=-1) if some else torch.maximum(-links, there).amin(dim=-1)
        result[:, members] = best.transpose(1, 2)
        return result

    def route(self, node: RouteNode, through: Tensor, end: Tensor) -> Tensor:
        """Value of routes bounded in metres: (batch, agents, steps), metres."""
        return length_value(node, self.team, self.states, through, end)

    def reach(self, node: ReachNode, through: Tensor, end: Tensor) -> Tensor:
        """Not reached: a cost graph has no such node, so there is no value (batch, agents, steps), metres."""
        raise AssertionError("not in a cost graph")

    def path_length(self, node: PathLength, holds: bool) -> Tensor:
        """Not reached: a cost graph has no such node, so there is no value (batch, agents, steps), metres."""
        raise AssertionError("not in a cost graph")

    def spread(self, value: Tensor) -> Tensor:
        """Expand the value to every step: (batch, agents, steps), metres."""
        return value.expand(*value.shape[:2], self.states.position.shape[2])

    def links(self, graph: Graph) -> Tensor:
        """Link margins, (batch, steps, members, members), metres; computed once."""
        if graph not in self.graphs:
            self.graphs[graph] = all_links(graph, self.states.position)
        return self.graphs[graph]

    def _constant(self, value: float) -> Tensor:
        return self.states.position.new_full((1, 1, 1), value)


def over(values: Tensor, low: int, high: int | None, undefined: float) -> Tensor:
    """Maximum over the window of every step, metres: (..., steps) -> (..., steps), in O(steps log window)."""
    steps = values.shape[-1]
    result = torch.full_like(values, undefined)
    if high is None:
        if low < steps:
            result[..., : steps - low] = values.flip(-1).cummax(dim=-1).values.flip(-1)[..., low:]
    elif high < steps:
        result[..., : steps - high] = _neighbours(values[..., low:], high - low + 1)
    return result


def until(hold: Tensor, end: Tensor, low: int, high: int | None, undefined: float = -UNLIMITED) -> Tensor:
    """``end`` at some step of the window, ``hold`` from now until then, metres.

    Shape: (..., steps) -> (..., steps).
    """
    hold, end = torch.broadcast_tensors(hold, end)
    steps = hold.shape[-1]
    result = torch.full_like(end, undefined)
    last = steps - 1 if high is None else high
    if last >= steps or low >= steps:
        return result
    # freed[k] for windows that start `low` ahead of k: the best of end, and of hold here and freed one later.
    count = steps - low if high is None else steps - high
    best = torch.full_like(end[..., :count], -2 * UNLIMITED)
    for ahead in range(last, -1, -1):
        reach = end[..., ahead : ahead + count]
        held = hold[..., ahead : ahead + count]
        short = count - reach.shape[-1]
        if short > 0:  # `high` None: the window is shorter for later steps
            pad = torch.full_like(end[..., :short], -2 * UNLIMITED)
            reach, held = torch.cat([reach, pad], dim=-1), torch.cat([held, pad], dim=-1)
        best = torch.minimum(held, best)
        if ahead >= low:
            best = torch.maximum(best, reach)
    result[..., :count] = best
    return result


def _neighbours(values: Tensor, width: int) -> Tensor:
    """Maximum of every ``width`` neighbours by doubling, metres.

    Shape: (..., steps) -> ``width - 1`` fewer steps.
    """
    done = 1
    while 2 * done <= width:
        values = torch.maximum(values[..., :-done], values[..., done:])
        done *= 2
    rest = width - done
    return torch.maximum(values[..., : values.shape[-1] - rest], values[..., rest:]) if rest else values
