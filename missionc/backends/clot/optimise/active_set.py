"""Active set of trajectory optimisation: margins and links that imply a goal, with one choice per disjunction.

A conjunction needs all of its parts; of a disjunction, the part nearest to being satisfied is selected, or the part of
a witness. The result is a conjunction of margins at agents and steps, each with its own gradient. A trajectory for
which all of them are positive satisfies the goal. The minimum of a hundred margins has no gradient for ninety-nine of
them; the active set has a gradient for each margin.

Witnesses of routes bounded in metres: the links of one route, or a violation of every route, at one step.

The existence of a route depends on one route: its links, agents and length. The absence depends on a violation of every
route, and one violation may apply to many routes.

Goals of a candidate: formulas that must be true at step 0, and the choices of a witness.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from heapq import heappop, heappush
from itertools import pairwise
from typing import Literal, TypeAlias, assert_never

import numpy as np
from numpy.typing import NDArray

from missionc.backends.clot.cost_graph.cost_graph import SignedPredicate, Unrolled, signed_predicate
from missionc.backends.clot.optimise.condition_values import ConditionValues
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Graph, Mission
from missionc.ir.couplings import directed
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
from missionc.ir.kernel.walk import children, graph_of, postorder
from missionc.verification.monitoring.graph_routes import shortest

ROUNDING = 1e-9
"""Rounding difference of sums in another order, metres."""

Members: TypeAlias = tuple[int, ...]
"""Members of a graph, by index."""

Piece: TypeAlias = tuple[Literal["link", "through", "end", "shorter", "longer"], Members]
"""Condition of a route: a link of two members (or its absence), the through or end condition of one member, or a length
of the route below, or above, its bound."""


class RoutePoint(Record, eq=False):
    """Graph at one step, for routes of ``low`` to ``high`` metres.

    Args:
        links: link margins, (members, members), from and to, metres; ``lengths``: link lengths, likewise.
        closest: least allowed distances of the bodies, (members, members), metres.
        through: value of each agent on a route except the last, (members,), metres; ``end``: value of the last.
        one_way: True for directed links.
    """

    links: Array
    lengths: Array
    closest: Array
    through: Array
    end: Array
    low: float
    high: float
    one_way: bool = False

    def link(self, one: int, other: int) -> Piece:
        """Link condition from one member to another; for undirected links, both directions are the same."""
        return ("link", (one, other)) if self.one_way else ("link", (min(one, other), max(one, other)))


def that_make(place: RoutePoint, start: int, worth: float) -> set[Piece]:
    """Conditions that imply the best route from a member.

    Args:
        start: index of the member.
        worth: value of the best route, metres.
    """
    route = _route(place, start, worth - ROUNDING)
    pieces: set[Piece] = {("end", route[-1:])}
    for one, other in pairwise(route):
        pieces |= {place.link(one, other), ("through", (one,))}
    if len(route) > 1 and np.isfinite(place.high):
        pieces.add(("shorter", route))
    if place.low > 0:
        pieces.add(("longer", route))
    return pieces


def that_break(place: RoutePoint, start: int, worth: float) -> set[Piece]:
    """For each route from a member, its best violation, unless a violation selected for another route suffices.

    Args:
        place: graph with ``through`` and ``end`` in the form for violations.
        worth: value of the worst route's best violation, metres: a lower bound for all selected violations.
    """
    clear = 0.4  # metres of shortfall at one link or agent, from which the rest of a route does not count
    most = 300  # number of route beginnings considered, the shortest first
    enough = max(worth, clear) - ROUNDING
    parted, passed, closed = -place.links >= enough, place.through >= enough, place.end >= enough
    metres = _metres(place, ~parted & ~passed[:, None])
    reached = np.isfinite(shortest(metres.T[None], np.arange(len(parted))[None] == start)[0])
    border = np.argwhere(parted & (reached & ~passed)[:, None]).tolist()
    pieces = {place.link(one, other) for one, other in border if one != other}
    pieces |= {("through", (one,)) for one in np.flatnonzero(reached & passed).tolist()}
    pieces |= {("end", (one,)) for one in np.flatnonzero(reached & closed).tolist()}
    left = shortest(metres[None], ~closed[None])[0]
    queue: list[tuple[float, Members, float]] = [(left[start], (start,), 0.0)]
    for _ in range(most):
        if not queue:
            break
        _, route, length = heappop(queue)
        crossed = ((place.link(one, other), ("through", (one,))) for one, other in pairwise(route))
        if any(not pieces.isdisjoint(each) for each in crossed):
            continue
        here = route[-1]
        if (len(route) > 1 or place.low <= 0) and ("end", (here,)) not in pieces:
            pieces.add(max(_breaking(place, route, length), key=lambda each: each[0])[1])
        for after in np.flatnonzero(np.isfinite(metres[here] + left)).tolist():
            longer = length + metres[here, after]
            if after not in route and longer + left[after] <= place.high + enough + 2 * ROUNDING:
                heappush(queue, (longer + left[after], (*route, after), longer))
    return pieces


def _breaking(place: RoutePoint, route: Members, length: float) -> Iterator[tuple[float, Piece]]:
    """Yield every violation of a route, with its value, metres."""
    yield place.end[route[-1]], ("end", route[-1:])
    for one, other in pairwise(route):
        yield -place.links[one, other], place.link(one, other)
        yield place.through[one], ("through", (one,))
    if len(route) > 1:
        yield length - place.high, ("longer", route)
        if place.low > sum(place.closest[one, other] for one, other in pairwise(route)):
            yield place.low - length, ("shorter", route)


def _route(place: RoutePoint, start: int, enough: float) -> Members:
    """Route whose parts all have a value of at least ``enough``; shortest paths are tried first."""
    ends = place.end >= enough
    if place.low <= 0 and ends[start]:
        return (start,)
    metres = _metres(place, (place.links >= enough) & (place.through >= enough)[:, None])
    left = shortest(metres[None], ends[None])[0]
    stack: list[tuple[Members, float]] = [((start,), 0.0)]
    while stack:
        route, length = stack.pop()
        here = route[-1]
        if len(route) > 1 and ends[here] and (place.low <= 0 or length - place.low >= enough):
            return route
        whole = length + metres[here] + left
        onward = np.flatnonzero(np.isfinite(whole) & (whole <= place.high - enough))
        nearest_last = onward[np.argsort(-whole[onward], kind="stable")].tolist()
        stack.extend(((*route, after), length + metres[here, after]) for after in nearest_last if after not in route)
    raise AssertionError("no route is worth so much")


def _metres(place: RoutePoint, usable: Flags) -> Array:
    """Lengths of the usable links, (members, members), metres; infinite for others."""
    return np.where(usable & ~np.eye(len(usable), dtype=np.bool_), place.lengths, np.inf)


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


class Demand(Record, eq=False):
    """Goals of joint trajectories, with methods on their positions and velocities, (agents, steps, dim), metres and
    m/s.

    Args:
        roots: formulas that must be true at step 0 (for a single configuration, at its step).
        choices: fixed choices; without a choice, the values decide.
    """

    mission: Mission
    roots: tuple[Node, ...]
    choices: Choices = field(default_factory=dict)
    order: Sequence[Node] = ()
    ruled_out: Mapping[SignedPredicate, Flags] = field(default_factory=dict)
    """Agents and steps, (agents, steps), at which predicates or negations are impossible because of fixed choices."""

    @staticmethod
    def of(mission: Mission, roots: tuple[Node, ...], choices: Choices, steps: int) -> Demand:
        """Goals of trajectories with ``steps`` steps."""
        order = postorder(roots)
        nowhere = np.zeros((len(mission.agents), steps + 1, 0))
        forced = activate(order, roots, {}, {}, nowhere, choices, decided=True).margins
        ruled_out = {(predicate, not holds): mask for (predicate, holds), mask in forced.items() if mask.any()}
        return Demand(mission, roots, choices, order, ruled_out)

    def active(self, position: Array, velocity: Array) -> Active:
        """Conditions that imply the goals on this trajectory, (agents, steps, dim), metres and m/s; values decide open
        choices."""
        return self._activated(position, velocity, None)

    def witness(self, position: Array, velocity: Array) -> Choices:
        """Choices of part, step and link that the values imply on this trajectory, (agents, steps, dim), metres and
        m/s."""
        choices: dict[tuple[Node, int, int], int] = {}
        self._activated(position, velocity, choices)
        return choices

    def states_asked(self, position: Array, velocity: Array) -> Mapping[Node, Flags]:
        """Largest single-step formulas that must be true, each with the agents and steps at which they must be,
        (agents, steps).

        Args:
            position: (agents, steps, dim), metres; ``velocity``, m/s.
        """
        whole: set[Node] = set()
        for node in self.order:
            reads_past = isinstance(node, Atom) and node.predicate.reads_past
            if not isinstance(node, WindowNode | UntilNode) and not reads_past and whole.issuperset(children(node)):
                whole.add(node)
        return self._activated(position, velocity, None, whole).formulas

    def failing(self, allowed: Mapping[Node, float], position: Array, velocity: Array) -> Mapping[Node, Flags]:
        """Agents and steps, (agents, steps), at which a formula must be true but fails by more than its allowed
        violation.

        Args:
            allowed: allowed violation of each formula, metres.
        """
        values = ConditionValues(self.mission, position, velocity, self.ruled_out).values(self.order)
        asked = self._activated(position, velocity, None, allowed.keys()).formulas
        return {leaf: mask & (values[leaf] < -allowed[leaf]) for leaf, mask in asked.items()}

    def _activated(
        self,
        position: Array,
        velocity: Array,
        witness: dict[tuple[Node, int, int], int] | None,
        whole: Collection[Node] = frozenset(),
    ) -> Active:
        evaluation = ConditionValues(self.mission, position, velocity, self.ruled_out)
        values = evaluation.values(self.order)
        graphs = {graph for node in self.order if (graph := graph_of(node))}
        links = {graph: evaluation.links_of(graph, slice(None)) for graph in graphs}
        everyone = np.arange(len(self.mission.agents))
        closest = SpacingTable.of(self.mission).between(everyone[:, None], everyone)
        return activate(self.order, self.roots, values, links, position, self.choices, False, witness, closest, whole)

    def untangled(self, position: Array, velocity: Array) -> Demand | None:
        """Goals without conflicts between a margin and its opposite; None if there are no conflicts.

        Two separate choices may require both, each nearly satisfied, and an optimiser is then stuck between them:
        ``(row or parked) and (fan or not parked)``, on the border of the parking region. Positions are (agents, steps,
        dim), metres.
        """
        masks = self.active(position, velocity).margins
        torn = []
        for (predicate, holds), mask in masks.items():
            opposite = masks.get((predicate, False)) if holds else None
            if opposite is not None:
                steps = (mask & opposite).any(axis=0)
                torn += [(predicate, steps)] if steps.any() else []
        if not torn:
            return None
        sides = []
        for truth in (True, False):
            ruled_out = dict(self.ruled_out)
            for predicate, steps in torn:
                dropped, where = (predicate, not truth), masks[predicate, truth] & steps
                ruled_out[dropped] = ruled_out[dropped] | where if dropped in ruled_out else where
            sides.append(replace(self, ruled_out=ruled_out))
        return max(sides, key=lambda side: side.worst(position, velocity))

    def worst(self, position: Array, velocity: Array) -> float:
        """Least robustness of the root formulas, metres, for states (agents, steps, dim)."""
        values = ConditionValues(self.mission, position, velocity, self.ruled_out).values(self.order)
        return min(float(values[root][0, 0]) for root in self.roots)
