"""Active set of trajectory optimisation: margins and links that imply a goal, with one choice per disjunction.

A conjunction needs all of its parts; of a disjunction, the part nearest to being satisfied is selected, or the part of
a witness. The result is a conjunction of margins at agents and steps, each with its own gradient. A trajectory for
which all of them are positive satisfies the goal. The minimum of a hundred margins has no gradient for ninety-nine of
them; the active set has a gradient for each margin.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias, assert_never

import numpy as np
from numpy.typing import NDArray

from missionc.backends.clot.cost_graph.cost_graph import SignedPredicate, Unrolled, signed_predicate
from missionc.backends.clot.optimise.route_pieces import RoutePoint, that_break, that_make
from missionc.base.trace import Array, Flags
from missionc.ir import Graph
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
from missionc.ir.kernel.walk import children
from missionc.ir.pair_ranges import directed

Choices: TypeAlias = Mapping[tuple[Node, int, int], int]
"""Choices of a witness for a formula at an agent and a step: the index of the part, the step of the mission (for a
``Release``, the last step if nothing releases it), or the linked agent."""

Links: TypeAlias = NDArray[np.int64]
"""Links as rows (links, 3): sending agent, receiving agent, step."""


@dataclass(frozen=True, slots=True, order=True)
class Stretch:
    """Route of agents at a step whose length must be above (``longer``) or below a bound."""

    agents: tuple[int, ...]
    step: int
    longer: bool

    def bound(self, node: RouteNode) -> float:
        """Bound of the node that applies, metres: a required route is between the bounds, a forbidden route is beyond
        one of the bounds."""
        return node.low if self.longer != node.every else node.high


@dataclass(slots=True)
class Active:
    """Conditions that a trajectory must satisfy.

    Args:
        margins: agents and steps, (agents, steps), at which each predicate or its negation must be true.
        joined: required links of each graph.
        parted: forbidden links of each graph.
        lengths: routes with bounded lengths, by formula.
        formulas: agents and steps, (agents, steps), at which each unexpanded formula must be true.
    """

    margins: dict[SignedPredicate, Flags] = field(default_factory=dict)
    joined: dict[Graph, list[Links]] = field(default_factory=lambda: defaultdict(list))
    parted: dict[Graph, list[Links]] = field(default_factory=lambda: defaultdict(list))
    lengths: dict[RouteNode, list[Stretch]] = field(default_factory=dict)
    formulas: dict[Node, Flags] = field(default_factory=dict)


def activate(
    order: Sequence[Node],
    roots: Iterable[Node],
    values: Mapping[Node, Array],
    links: Mapping[Graph, Array],
    position: Array,
    choices: Choices,
    decided: bool = False,
    witness: dict[tuple[Node, int, int], int] | None = None,
    closest: Array | None = None,
    whole: Collection[Node] = frozenset(),
) -> Active:
    """Conditions on one candidate that imply all root formulas at step 0.

    Args:
        order: every formula, children first.
        values: value of every node, (agents, steps), or 1 for either axis, metres.
        links: links of every graph that formulas read, (steps, members, members), metres.
        position: (agents, steps, dim), metres.
        choices: choices that override the values.
        decided: True for only the conditions that do not depend on the values.
        witness: receives the choices that the values imply.
        closest: least distance of bodies, (agents, agents), metres: conditions that require a smaller distance are
            dropped.
        whole: formulas that are not expanded.
    """
    if closest is None:
        closest = np.zeros((len(position), len(position)))
    run = _Run(values, links, position, choices, decided, witness, closest)
    for root in roots:
        run.mask(root)[0, 0] = True
    for node in reversed(order):
        if node not in run.masks:
            continue
        mask = run.masks.pop(node)
        if node in whole:
            run.active.formulas[node] = mask
        else:
            run.pass_on(node, mask)
    return run.active


class _Run:
    def __init__(
        self,
        values: Mapping[Node, Array],
        links: Mapping[Graph, Array],
        position: Array,
        choices: Choices,
        decided: bool,
        witness: dict[tuple[Node, int, int], int] | None,
        closest: Array,
    ) -> None:
        self.closest = closest
        self.decided, self.witness = decided, witness
        self.given, self.links, self.position, self.choices = values, links, position, choices
        self.shape: tuple[int, int] = (position.shape[0], position.shape[1])
        self.choosers = {node for node, _, _ in choices}
        self.active = Active()
        self.masks: dict[Node, Flags] = {}

    def mask(self, node: Node) -> Flags:
        if node not in self.masks:
            self.masks[node] = np.zeros(self.shape, dtype=np.bool_)
        return self.masks[node]

    def value(self, node: Node) -> Array:
        return np.broadcast_to(self.given[node], self.shape)

    def pass_on(self, node: Node, mask: Flags) -> None:
        assert not isinstance(node, Unrolled), "not in a cost graph"
        if isinstance(node, WindowNode | UntilNode):
            return self._over_window(node, mask)
        if isinstance(node, NeighbourNode):
            return self._every_linked(node, mask) if node.every else self._some_linked(node, mask)
        if isinstance(node, RouteNode):
            return self._length(node, mask)
        match node:
            case Atom() | Not(Atom()):
                asked = signed_predicate(node)
                known = self.active.margins.get(asked)
                self.active.margins[asked] = mask if known is None else known | mask
            case Is() | Not():
                pass
            case All(parts):
                for part in parts:
                    self.mask(part)[mask] = True
            case Any(parts):
                self._choose(node, parts, 1, mask)
            case AtLeast(count, parts):
                self._choose(node, parts, count, mask)
            case At(agent, body):
                self.mask(body)[agent] |= mask.any(axis=0)
            case _:
                assert_never(node)

    def _note(self, node: Node, agent: int, step: int, chosen: int) -> None:
        if self.witness is not None:
            self.witness[node, agent, step] = chosen

    def _chosen(self, node: Node, agent: int, step: int) -> int | None:
        return self.choices.get((node, agent, step)) if node in self.choosers else None

    def _choose(self, node: Node, parts: tuple[Node, ...], count: int, mask: Flags) -> None:
        """Activate the best ``count`` parts at each agent and step of the mask."""
        if not parts:
            return
        if self.decided:
            for place in np.argwhere(mask).tolist() if node in self.choosers else ():
                chosen = self._chosen(node, *place)
                if chosen is not None:
                    self.mask(parts[chosen])[tuple(place)] = True
            return
        agent, step = np.nonzero(mask)
        stacked = np.stack([self.value(part)[agent, step] for part in parts])
        best = np.argsort(-stacked, axis=0, kind="stable")[:count]
        if node in self.choosers:
            for column, (one, moment) in enumerate(zip(agent.tolist(), step.tolist(), strict=True)):
                chosen = self._chosen(node, one, moment)
                if chosen is not None:
                    best[:, column] = [chosen, *(each for each in best[:, column] if each != chosen)][:count]
        if self.witness is not None and count == 1:
            for one, moment, number in zip(agent.tolist(), step.tolist(), best[0].tolist(), strict=True):
                self._note(node, one, moment, number)
        for row in best:
            for number in np.unique(row):
                here = row == number
                self.mask(parts[number])[agent[here], step[here]] = True

    def _over_window(self, node: WindowNode | UntilNode, mask: Flags) -> None:
        """Activate the conditions of a window. For ``Eventually`` and ``Until``: ``end`` at one step, and ``hold``
        before it.

        For ``Always`` and ``Release``: ``end`` at each step of the window up to a step with ``hold``, or up to the last
        step.
        """
        *hold, end = children(node)
        for agent, step in np.argwhere(mask).tolist():
            last = self.shape[1] - 1 if node.high is None else min(step + node.high, self.shape[1] - 1)
            chosen = self._chosen(node, agent, step) if hold or not node.every else last
            if chosen is None:
                if self.decided:
                    continue
                chosen = self._best_step(node, agent, step, last)
                self._note(node, agent, step, chosen)
            self.mask(end)[agent, step + node.low if node.every else chosen : chosen + 1] = True
            if hold and (chosen < last or not node.every):
                self.mask(hold[0])[agent, chosen if node.every else slice(step, chosen)] = True

    def _best_step(self, node: WindowNode | UntilNode, agent: int, step: int, last: int) -> int:
        """Step of the mission that has the best value for a temporal operator."""
        ends, *holds = (self.value(part)[agent, step : last + 1] for part in reversed(children(node)))
        if node.every:
            least = np.minimum.accumulate(np.where(np.arange(len(ends)) < node.low, np.inf, ends))
            freed = np.minimum(holds[0], least)[:-1]  # least[k]: `end` from `low` up to and including k steps ahead
            return last if least[-1] >= freed.max(initial=-np.inf) else step + int(freed.argmax())
        for hold in holds:
            ends = np.minimum(np.minimum.accumulate(np.r_[np.inf, hold[:-1]]), ends)
        return step + node.low + int(ends[node.low :].argmax())

    def _places(self, graph: Graph, mask: Flags) -> tuple[Links, Links, Array]:
        """Members and steps flagged in the mask, (places,) each, and the link margins of these members at these steps,
        metres."""
        member, step = np.nonzero(mask[list(graph.agents)])
        return member, step, self.links[graph][step, member]

    def _some_linked(self, node: NeighbourNode, mask: Flags) -> None:
        graph = node.graph
        if len(graph.agents) < 2:
            return
        if self.decided:
            known = [(agent, self._chosen(node, agent, step), step) for agent, step in np.argwhere(mask).tolist()]
            edges = [(agent, other, step) for agent, other, step in known if other is not None]
        else:
            agents = np.array(graph.agents)
            member, steps, links = self._places(graph, mask)
            best = agents[np.minimum(links, self.value(node.body)[agents[None, :], steps[:, None]]).argmax(axis=1)]
            edges = []
            for agent, step, other in zip(agents[member].tolist(), steps.tolist(), best.tolist(), strict=True):
                chosen = self._chosen(node, agent, step)
                if chosen is None:
                    self._note(node, agent, step, other)
                edges.append((agent, other if chosen is None else chosen, step))
        if edges:
            joined = np.array(edges)
            self.mask(node.body)[joined[:, 1], joined[:, 2]] = True
            self.active.joined[graph].append(joined)

    def _every_linked(self, node: NeighbourNode, mask: Flags) -> None:
        graph = node.graph
        if len(graph.agents) < 2 or self.decided:
            return
        agents = np.array(graph.agents)
        member, step, links = self._places(graph, mask)
        there = self.value(node.body)[agents[None, :], step[:, None]]
        elsewhere = np.arange(len(agents))[None, :] != member[:, None]
        place, other = np.nonzero(elsewhere & (there >= -links))
        self.mask(node.body)[agents[other], step[place]] = True
        place, other = np.nonzero(elsewhere & (there < -links))
        self.active.parted[graph].append(np.stack([agents[member[place]], agents[other], step[place]], axis=1))

    def _length(self, node: RouteNode, mask: Flags) -> None:
        """Activate the conditions of the best route, or for a forbidden route, one violation of each route."""
        if self.decided:
            return
        agents = np.array(node.graph.agents, dtype=np.int64)
        if node.low <= 0:
            outside = np.setdiff1d(np.arange(len(mask)), agents)
            self.mask(node.end)[outside] |= mask[outside]
        holds = not node.every
        links: set[tuple[int, ...]] = set()
        stretches: set[Stretch] = set()
        member, steps = np.nonzero(mask[agents])
        places = {step: self._place(node, step) for step in set(steps.tolist())}
        for start, step in zip(member.tolist(), steps.tolist(), strict=True):
            place = places[step]
            worth = float(self.value(node)[agents[start], step])
            if holds and worth == -np.inf:
                continue  # no such route exists, for any positions
            for kind, members in (that_make if holds else that_break)(place, start, worth):
                named = tuple(agents[list(members)].tolist())
                match kind:
                    case "through" | "end":
                        self.mask(node.through if kind == "through" else node.end)[named[0], step] = True
                    case "link":
                        links.add((*named, step))
                    case "shorter" | "longer":
                        stretches.add(Stretch(named, step, kind == "longer"))
                    case _:
                        assert_never(kind)
        if links:
            lists = self.active.joined if holds else self.active.parted
            lists[node.graph].append(np.array(sorted(links)))
        if stretches:
            self.active.lengths[node] = sorted(stretches)

    def _place(self, node: RouteNode, step: int) -> RoutePoint:
        agents = np.array(node.graph.agents, dtype=np.int64)
        here = self.position[agents, step]
        lengths = np.linalg.norm(here[:, None] - here[None], axis=-1)
        through, end = (self.value(part)[agents, step] for part in (node.through, node.end))
        closest = self.closest[np.ix_(agents, agents)]
        links = self.links[node.graph][step]
        return RoutePoint(links, lengths, closest, through, end, node.low, node.high, directed(node.graph))
