"""The active set: margins and links that have to hold for a goal to hold, one choice made wherever there is one.

A conjunction needs all of its parts, a disjunction the one that is nearest to
holding, or the one that a witness names. What remains is a conjunction of
margins at agents and steps, each of which can be pushed on its own: a motion
in which all of them are positive satisfies the goal. The least of a hundred
margins says nothing about the other ninety-nine; this does.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias, assert_never

import numpy as np
from numpy.typing import NDArray

from missionc.backends.clot.cost_graph.leaf_margins import UNLIMITED
from missionc.backends.clot.optimise.route_pieces import Place, that_break, that_make
from missionc.base.trace import Array, Flags
from missionc.ir import Graph
from missionc.kernel import nodes as kernel
from missionc.kernel.nodes import Node, RouteNode

Choices: TypeAlias = Mapping[tuple[Node, int, int], int]
"""What a witness decided: of a term at an agent and a step, the number of the part, of the step of the mission (of a
``Release`` the last one where nothing frees it), or of the agent it is linked to."""

Links: TypeAlias = NDArray[np.int64]
"""(links, 3): two agents and a step."""


@dataclass(frozen=True, slots=True, order=True)
class Stretch:
    """A route, as agents one linked to the next, at a step: whether it has to be longer than a bound, or shorter."""

    agents: tuple[int, ...]
    step: int
    longer: bool

    def bound(self, term: RouteNode) -> float:
        """Which of a term's bounds, metres: a route that must be is between them, one that must not be beyond one."""
        return term.low if self.longer != term.every else term.high


@dataclass(slots=True)
class Active:
    """What has to hold.

    ``margins``: where each ``Atom``, or negation of one, must hold, (agents, steps). ``joined``
    and ``parted``: the links a graph must have, and must not have.
    ``lengths``: the routes whose lengths are bounded, by the term that bounds them.
    """

    margins: dict[Node, Flags] = field(default_factory=dict)
    joined: dict[Graph, list[Links]] = field(default_factory=lambda: defaultdict(list))
    parted: dict[Graph, list[Links]] = field(default_factory=lambda: defaultdict(list))
    lengths: dict[RouteNode, list[Stretch]] = field(default_factory=dict)


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
) -> Active:
    """What has to hold of one candidate for all of the roots to hold at step 0.

    Args:
        order: every term, each after those below it.
        values: of every term, (agents, steps) or 1 in place of either, metres.
        links: of every graph that terms read, (steps, members, members), metres.
        position: (agents, steps, dim), metres.
        choices: where these have an answer it counts; elsewhere the values do.
        decided: only what has to hold whatever the values are, which are not looked at then.
        witness: is told what the values chose.
        closest: how near each other bodies let agents come, (agents, agents), metres: what is nearer is not asked for.
    """
    if closest is None:
        closest = np.zeros((len(position), len(position)))
    run = _Run(values, links, position, choices, decided, witness, closest)
    for root in roots:
        run.mask(root)[0, 0] = True
    for term in reversed(order):
        if term in run.masks:
            run.pass_on(term, run.masks.pop(term))
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
        self.chosen_terms = {term for term, _, _ in choices}
        self.active = Active()
        self.masks: dict[Node, Flags] = {}

    def mask(self, term: Node) -> Flags:
        if term not in self.masks:
            self.masks[term] = np.zeros(self.shape, dtype=np.bool_)
        return self.masks[term]

    def value(self, term: Node) -> Array:
        return np.broadcast_to(self.given[term], self.shape)

    def pass_on(self, term: Node, mask: Flags) -> None:
        match term:
            case kernel.Atom() | kernel.Not(kernel.Atom()):
                self.active.margins[term] = mask
            case kernel.Is() | kernel.Not(kernel.Is()):
                return
            case kernel.Route() | kernel.EveryRoute():
                self._length(term, mask)
            case kernel.All(parts):
                for part in parts:
                    self.mask(part)[mask] = True
            case kernel.Any(parts):
                self._choose(term, parts, 1, mask)
            case kernel.AtLeast(count, parts):
                self._choose(term, parts, count, mask)
            case kernel.At(agent, body):
                self.mask(body)[agent] |= mask.any(axis=0)
            case kernel.Always(body, low, high):
                for agent, step in np.argwhere(mask):
                    self.mask(body)[agent, step + low : self._last(step, high) + 1] = True
            case kernel.Eventually():
                self._eventually(term, mask)
            case kernel.Until():
                self._until(term, mask)
            case kernel.Release():
                self._release(term, mask)
            case kernel.Neighbour(graph, body):
                self._some_linked(term, graph, body, mask)
            case kernel.EveryNeighbour(graph, body):
                self._every_linked(graph, body, mask)
            case kernel.Not() | kernel.Reach() | kernel.EveryReach() | kernel.PathLength():
                raise AssertionError("not in a cost graph")
            case _:
                assert_never(term)

    def _note(self, term: Node, agent: int, step: int, chosen: int) -> None:
        if self.witness is not None:
            self.witness[term, agent, step] = chosen

    def _last(self, step: int, high: int | None) -> int:
        return self.shape[1] - 1 if high is None else min(step + high, self.shape[1] - 1)

    def _chosen(self, term: Node, agent: int, step: int) -> int | None:
        return self.choices.get((term, agent, step)) if term in self.chosen_terms else None

    def _choose(self, term: Node, parts: tuple[Node, ...], count: int, mask: Flags) -> None:
        """The best ``count`` of the parts, at each place of the mask."""
        if not parts:
            return
        if self.decided:
            for place in np.argwhere(mask).tolist() if term in self.chosen_terms else ():
                chosen = self._chosen(term, *place)
                if chosen is not None:
                    self.mask(parts[chosen])[tuple(place)] = True
            return
        agent, step = np.nonzero(mask)
        stacked = np.stack([self.value(part)[agent, step] for part in parts])
        best = np.argsort(-stacked, axis=0, kind="stable")[:count]
        if term in self.chosen_terms:
            for column, (one, moment) in enumerate(zip(agent.tolist(), step.tolist(), strict=True)):
                chosen = self._chosen(term, one, moment)
                if chosen is not None:
                    best[:, column] = [chosen, *(each for each in best[:, column] if each != chosen)][:count]
        if self.witness is not None and count == 1:
            for one, moment, number in zip(agent.tolist(), step.tolist(), best[0].tolist(), strict=True):
                self._note(term, one, moment, number)
        for row in best:
            for number in np.unique(row):
                here = row == number
                self.mask(parts[number])[agent[here], step[here]] = True

    def _moments(
        self, term: Node, mask: Flags, high: int | None, best: Callable[[int, int, int], int]
    ) -> Iterator[tuple[int, int, int, int]]:
        """Each place of the mask, as an agent and a step; the last step of the window there; the step chosen from it.

        Args:
            best: the step that the values choose, by agent, step and last step.
        """
        for agent, step in np.argwhere(mask).tolist():
            last, chosen = self._last(step, high), self._chosen(term, agent, step)
            if chosen is None:
                if self.decided:
                    continue
                chosen = best(agent, step, last)
                self._note(term, agent, step, chosen)
            yield agent, step, last, chosen

    def _eventually(self, term: kernel.Eventually, mask: Flags) -> None:
        def best(agent: int, step: int, last: int) -> int:
            return step + term.low + int(self.value(term.body)[agent, step + term.low : last + 1].argmax())

        for agent, _, _, chosen in self._moments(term, mask, term.high, best):
            self.mask(term.body)[agent, chosen] = True

    def _until(self, term: kernel.Until, mask: Flags) -> None:
        def best(agent: int, step: int, last: int) -> int:
            held = np.minimum.accumulate(np.r_[np.inf, self.value(term.hold)[agent, step:last]])
            ends = self.value(term.end)[agent, step : last + 1]
            return step + term.low + int(np.minimum(held, ends)[term.low :].argmax())

        for agent, step, _, chosen in self._moments(term, mask, term.high, best):
            self.mask(term.end)[agent, chosen] = True
            self.mask(term.hold)[agent, step:chosen] = True

    def _release(self, term: kernel.Release, mask: Flags) -> None:
        """``end`` at each step of the window up to one where ``hold`` holds, or up to the window's last."""

        def best(agent: int, step: int, last: int) -> int:
            window = self.value(term.end)[agent, step : last + 1].copy()
            window[: term.low] = np.inf
            kept = np.minimum.accumulate(window)  # kept[k]: `end` from `low` up to and with k steps ahead
            freed = np.minimum(self.value(term.hold)[agent, step : last + 1], kept)[:-1]
            return last if kept[-1] >= freed.max(initial=-np.inf) else step + int(freed.argmax())

        for agent, step, last, chosen in self._moments(term, mask, term.high, best):
            self.mask(term.end)[agent, step + term.low : chosen + 1] = True
            if chosen < last:
                self.mask(term.hold)[agent, chosen] = True

    def _places(self, graph: Graph, mask: Flags) -> tuple[Links, Links, Array]:
        """Places of the mask that are members: number of the member and step (places,) each; and their links."""
        member, step = np.nonzero(mask[list(graph.agents)])
        return member, step, self.links[graph][step, member]

    def _some_linked(self, term: Node, graph: Graph, body: Node, mask: Flags) -> None:
        if len(graph.agents) < 2:
            return
        agents = np.array(graph.agents)
        if self.decided:
            known = [(agent, self._chosen(term, agent, step), step) for agent, step in np.argwhere(mask).tolist()]
            self._join(graph, body, [(agent, other, step) for agent, other, step in known if other is not None])
            return
        member, step, links = self._places(graph, mask)
        there = self.value(body)[agents[None, :], step[:, None]]
        best = agents[np.minimum(links, there).argmax(axis=1)]
        found: list[tuple[int, int, int]] = []
        for agent, moment, other in zip(agents[member].tolist(), step.tolist(), best.tolist(), strict=True):
            chosen = self._chosen(term, agent, moment)
            if chosen is None:
                self._note(term, agent, moment, other)
            found.append((agent, other if chosen is None else chosen, moment))
        self._join(graph, body, found)

    def _join(self, graph: Graph, body: Node, links: list[tuple[int, int, int]]) -> None:
        if links:
            joined = np.array(links)
            self.mask(body)[joined[:, 1], joined[:, 2]] = True
            self.active.joined[graph].append(joined)

    def _every_linked(self, graph: Graph, body: Node, mask: Flags) -> None:
        if len(graph.agents) < 2 or self.decided:
            return
        agents = np.array(graph.agents)
        member, step, links = self._places(graph, mask)
        there = self.value(body)[agents[None, :], step[:, None]]
        elsewhere = np.arange(len(agents))[None, :] != member[:, None]
        place, other = np.nonzero(elsewhere & (there >= -links))
        self.mask(body)[agents[other], step[place]] = True
        place, other = np.nonzero(elsewhere & (there < -links))
        self.active.parted[graph].append(np.stack([agents[member[place]], agents[other], step[place]], axis=1))

    def _length(self, term: RouteNode, mask: Flags) -> None:
        """What the best route rests on; or, where none must be, what breaks each of them."""
        if self.decided:
            return
        agents = np.array(term.graph.agents, dtype=np.int64)
        if term.low <= 0:
            outside = np.setdiff1d(np.arange(len(mask)), agents)
            self.mask(term.end)[outside] |= mask[outside]
        holds = not term.every
        links: set[tuple[int, ...]] = set()
        stretches: set[Stretch] = set()
        member, steps = np.nonzero(mask[agents])
        places = {step: self._place(term, step) for step in set(steps.tolist())}
        for start, step in zip(member.tolist(), steps.tolist(), strict=True):
            place = places[step]
            worth = float(self.value(term)[agents[start], step])
            if holds and worth <= -UNLIMITED / 2:
                continue  # there is no such route, wherever the agents are
            for kind, members in (that_make if holds else that_break)(place, start, worth):
                named = tuple(agents[list(members)].tolist())
                match kind:
                    case "through" | "end":
                        self.mask(term.through if kind == "through" else term.end)[named[0], step] = True
                    case "link":
                        links.add((*named, step))
                    case "shorter" | "longer":
                        stretches.add(Stretch(named, step, kind == "longer"))
                    case _:
                        assert_never(kind)
        if links:
            lists = self.active.joined if holds else self.active.parted
            lists[term.graph].append(np.array(sorted(links)))
        if stretches:
            self.active.lengths[term] = sorted(stretches)

    def _place(self, term: RouteNode, step: int) -> Place:
        agents = np.array(term.graph.agents, dtype=np.int64)
        here = self.position[agents, step]
        lengths = np.linalg.norm(here[:, None] - here[None], axis=-1)
        through, end = (self.value(part)[agents, step] for part in (term.through, term.end))
        closest = self.closest[np.ix_(agents, agents)]
        return Place(self.links[term.graph][step], lengths, closest, through, end, term.low, term.high)
