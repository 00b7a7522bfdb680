"""Residual groups of a candidate's tasks: the margins and links in the active set.

Source:
    [clot] III-C, the predicates.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator
from functools import reduce
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from missionc.backends.clot.optimise.active_set import Active, Links, Stretch
from missionc.backends.clot.optimise.control_points import Arguments, Splines
from missionc.backends.clot.optimise.dual_numbers import Dual, Values, plain
from missionc.backends.clot.optimise.own_state_residuals import flag_pieces, level_groups
from missionc.backends.clot.optimise.residuals import Group
from missionc.backends.clot.settings import Spare, Weights, clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.natural_scale import natural_scale
from missionc.ir import (
    Beacon,
    Compare,
    Connectivity,
    Flagged,
    Formation,
    Graph,
    Mission,
    Predicate,
    Region,
)
from missionc.ir.couplings import directed
from missionc.ir.distances.convex_pieces import outer_half_spaces
from missionc.ir.kernel.nodes import RouteNode
from missionc.ir.language.margins.connected import spanning_tree
from missionc.ir.language.margins.formation import edge_error
from missionc.ir.language.margins.headings import of_velocity
from missionc.ir.language.margins.predicate_margins import link_margin
from missionc.ir.language.margins.view import View


class TaskCosts(Record, eq=False):
    """Residual groups of a mission's formulas for trajectories given by ``splines``."""

    mission: Mission
    splines: Splines
    weights: Weights
    spare: Spare

    def groups(self, control: Array, active: Active) -> Iterator[Group]:
        """Yield the residual groups of the active conditions of a candidate, (agents, points, dim), metres."""
        for (predicate, holds), mask in active.margins.items():
            yield from self._margin(predicate, holds, mask, control)
        for lists, together in ((active.joined, True), (active.parted, False)):
            for graph, links in lists.items():
                yield from self._links(graph, np.concatenate(links), together)
        for node, stretches in active.lengths.items():
            yield from self._lengths(node, stretches)

    def _margin(self, predicate: Predicate, holds: bool, mask: Flags, control: Array) -> Iterator[Group]:
        graph = predicate.restricted
        moments = np.flatnonzero(mask.any(axis=0)).astype(np.int64)
        if predicate.reads_past:
            yield from self._own_state(predicate, holds, mask, control)
        elif predicate.formation:
            yield from self._formation(predicate.formation, moments, holds, control)
        elif graph and holds:
            yield from self._links(graph, self._tree(graph, moments, control), True)
            if self.mission.solve.connectivity is Connectivity.LAMBDA2:
                yield from self._second_eigenvalue(graph, moments)
        elif graph:
            yield from self._links(graph, self._cut(graph, moments, control), False)
        else:
            yield self._measured(predicate, holds, mask)

    def _own_state(self, predicate: Predicate, holds: bool, mask: Flags, control: Array) -> Iterator[Group]:
        """Yield the residual groups of predicates of the past; control points (agents, points, dim), metres.

        Nothing is yielded for a trajectory that begins later than the mission.
        """
        made = self.splines
        if made.steps != self.mission.steps:
            return
        if isinstance(predicate, Flagged):
            for region, within, where in flag_pieces(predicate.flag, holds, mask, made.states(control)[0]):
                yield self._measured(region, within, where)
        elif isinstance(predicate, Compare):
            yield from level_groups(predicate, holds, mask, control, self.mission, made, self.weights, self.spare)

    def _formation(self, formation: Formation, moments: Indices, holds: bool, control: Array) -> Iterator[Group]:
        """Yield a residual group for every edge's error; for a forbidden formation, only for the worst edge.

        With a total tolerance, each edge gets the share nearest to its own error.

        Args:
            moments: steps, (moments,).
            control: (agents, points, dim), metres.
        """
        if not len(moments):
            return
        wanted = self._spare(float(formation.tolerance))
        spare = min(wanted, formation.tolerance / 3) if holds else wanted
        bound = formation.tolerance - spare if holds else formation.tolerance + spare
        position, _ = self.splines.states(control)
        errors = np.stack(
            [
                np.asarray(edge_error(np, edge, position[edge.first], position[edge.second]))[moments]
                for edge in formation.edges
            ]
        )
        bounds = shares(errors, bound) if formation.total else np.full(errors.shape, bound)
        mask = np.full(errors.shape, holds or formation.total)
        mask[errors.argmax(axis=0), np.arange(len(moments))] = True
        offset = np.array([isinstance(edge.target, tuple) for edge in formation.edges])
        for offsets in (False, True):
            number, moment = np.nonzero(mask & (offset == offsets)[:, None])
            if not number.size:
                continue
            edges = [formation.edges[edge] for edge in number]
            ends = [np.array([getattr(edge, end) for edge in edges]) for end in ("first", "second")]
            target = np.array([edge.target for edge in edges])
            most = bounds[number, moment]

            def over(
                a: Values, b: Values, target: Array = target, offsets: bool = offsets, most: Array = most
            ) -> Values:
                return (norm(b - a - target) if offsets else abs(norm(b - a) - target)) - most

            yield Group(
                f"{'' if holds else 'not '}formation {formation.name}",
                (self._at(ends[0], moments[moment]), self._at(ends[1], moments[moment])),
                over if holds else (lambda a, b, over=over: -over(a, b)),
                self.weights.task,
                spare / len(formation.edges) if formation.total else spare,
            )

    def _measured(self, predicate: Predicate, holds: bool, mask: Flags) -> Group:
        """Residual group of a predicate that reads agents' positions and velocities, at the agents and steps of the
        mask."""
        made, sign = self.splines, 1.0 if holds else -1.0
        agent, step = (index.astype(np.int64) for index in np.nonzero(mask))
        if predicate.about_team:
            step = np.unique(step)
            agent = np.zeros_like(step)
        wide, sides = self.spare.scaled > 0, None
        region = predicate.region if holds and wide else None
        beyond = outer_half_spaces(region.shape) if region else ()
        if beyond:  # each side by itself: no gradient of the depth leads out of a corner
            dim = self.mission.dimension
            normals = [(*side.normal, *(0.0,) * (dim - len(side.normal))) for side in beyond]
            every = np.repeat(np.arange(len(beyond)), len(agent))
            offsets = [side.offset for side in beyond]
            sides = np.array(normals)[every], np.array(offsets)[every]
            agent, step = np.tile(agent, len(beyond)), np.tile(step, len(beyond))
        arguments = [self._at(agent, step)]
        if predicate.reads_speed:
            arguments.append(made.velocity(agent, step))
        named = sorted(predicate.others)
        arguments.extend(self._at(np.full(len(step), other), step) for other in named)
        radius, altitude = (
            np.array([getattr(one, what) for one in self.mission.agents])[agent] for what in ("radius", "altitude")
        )
        of_speed = predicate.is_of_speed or predicate.reads_heading
        natural = natural_scale(predicate, self.mission) if wide else 0.0
        scale, spare = 1.0, self._spare(natural)
        if of_speed and made.steps:
            scale, spare = made.step, max(clot_settings(self.mission).spare.task, self.spare.scaled * natural)

        def shortfall(*points: Values) -> Values:
            measured = predicate.margin(_OfPoints(points, named, radius, altitude, sides)) + 0.0 * points[0][:, 0]
            return (spare - sign * measured) * scale

        name = f"{'' if holds else 'not '}{predicate.region.name}" if predicate.region else "comparison"
        return Group(name, tuple(arguments), shortfall, self.weights.task, spare * scale)

    def _links(self, graph: Graph, links: Links, together: bool) -> Iterator[Group]:
        if len(links) == 0:
            return
        sign = 1.0 if together else -1.0
        pair = [self._at(links[:, end], links[:, 2]) for end in (0, 1)]
        spare = self._spare(float(graph.radius))
        yield Group(
            f"link {graph.name}",
            tuple(pair),
            lambda a, b: spare - sign * link_margin(graph, links[:, 0], links[:, 1], a, b),
            self.weights.task,
            spare,
        )

    def _second_eigenvalue(self, graph: Graph, moments: Indices) -> Iterator[Group]:
        """Yield the residual group for λ₂ at least the λ₂ of a ring of full links; in metres, where λ₂ = 0 counts as a
        full link's margin.

        All of the residual is target margin: links of the best tree have their own residuals, since λ₂ of a
        disconnected graph has no gradient. If they are satisfied, λ₂ is positive.
        """
        count, full = len(graph.agents), self.spare.links
        if count < 2 or not len(moments):
            return
        agents = np.array(graph.agents)
        ring = min(2 - 2 * np.cos(2 * np.pi / count), count)

        def shortfall(*points: Values) -> Values:
            members = np.stack(points, axis=1)
            links = link_margin(graph, agents[:, None], agents, members[:, :, None], members[:, None])
            weight = link_weight(links, full) * (1.0 - np.eye(count))
            return full * (1 - second_eigenvalue(weight) / ring)

        where = tuple(self._at(np.full(len(moments), agent), moments) for agent in graph.agents)
        yield Group(f"connectivity of {graph.name}", where, shortfall, self.weights.links, full)

    def _lengths(self, node: RouteNode, stretches: list[Stretch]) -> Iterator[Group]:
        """Yield residual groups for routes that must be long, or short, enough; routes with equal numbers of agents
        form one group."""
        spare = min(self.spare.task, (node.high - node.low) / 3) if not node.every else self.spare.task
        for _, alike in groupby(sorted(stretches, key=_kind), key=_kind):
            some = list(alike)
            agents = np.array([each.agents for each in some])
            step = np.array([each.step for each in some])
            bound, sign = some[0].bound(node), 1.0 if some[0].longer else -1.0
            yield Group(
                f"length on {node.graph.name}",
                tuple(self._at(agent, step) for agent in agents.T),
                lambda *points, bound=bound, sign=sign: spare - sign * (_length(points) - bound),
                self.weights.task,
                spare,
            )

    def _tree(self, graph: Graph, moments: Indices, control: Array) -> Links:
        """Edges of each step's maximum spanning tree, (links, 3); for directed links, of both trees.

        Args:
            moments: steps, (moments,).
            control: (agents, points, dim), metres.
        """
        agents = np.array(graph.agents)
        if len(agents) < 2:
            return np.zeros((0, 3), dtype=np.int64)
        links = self._all_links(graph, moments, control)
        step = np.repeat(moments[:, None], len(agents) - 1, axis=1).ravel()
        first, second, _ = spanning_tree(links)
        there = np.stack([agents[first].ravel(), agents[second].ravel(), step], axis=1)
        if not directed(graph):
            return there
        first, second, _ = spanning_tree(links.mT)
        back = np.stack([agents[second].ravel(), agents[first].ravel(), step], axis=1)
        return np.unique(np.concatenate([there, back]), axis=0)

    def _cut(self, graph: Graph, moments: Indices, control: Array) -> Links:
        """Pairs of agents across the worst edge of each step's spanning tree, (links, 3): the cheapest cut of the
        graph.

        Args:
            moments: steps, (moments,).
            control: (agents, points, dim), metres.
        """
        if directed(graph):
            return self._one_way_cut(graph, moments, control)
        agents = np.array(graph.agents)
        links = self._all_links(graph, moments, control)
        first, second, worst = spanning_tree(links)
        cuts: list[Links] = []
        for row, step in enumerate(moments) if len(agents) > 1 else ():
            side = np.zeros(len(agents), dtype=np.bool_)
            side[second[row, worst[row]]] = True
            for number in range(worst[row] + 1, len(agents) - 1):  # edges are in the order of growth
                if side[first[row, number]]:
                    side[second[row, number]] = True
            one, other = np.nonzero(side[:, None] & ~side[None, :])
            cuts.append(np.stack([agents[one], agents[other], np.full(len(one), step)], axis=1))
        return np.concatenate(cuts) if cuts else np.zeros((0, 3), dtype=np.int64)

    def _one_way_cut(self, graph: Graph, moments: Indices, control: Array) -> Links:
        """Links that leave the agents before the worst edge, (links, 3), for the tree whose worst edge is worse. No
        link that leaves the agents is better than this worst edge.

        Args:
            moments: steps, (moments,).
            control: (agents, points, dim), metres.
        """
        agents = np.array(graph.agents)
        links = self._all_links(graph, moments, control)
        trees = [spanning_tree(each) for each in (links, links.mT)]
        cuts: list[Links] = [np.zeros((0, 3), dtype=np.int64)]
        for row, step in enumerate(moments) if len(agents) > 1 else ():
            ends = [(first[row, worst[row]], second[row, worst[row]]) for first, second, worst in trees]
            back = links[row, *ends[1][::-1]] < links[row, *ends[0]]
            _, second, worst = trees[int(back)]
            within = np.ones(len(agents), dtype=np.bool_)
            within[second[row, worst[row] :]] = False
            one, other = np.nonzero(np.outer(~within, within) if back else np.outer(within, ~within))
            cuts.append(np.stack([agents[one], agents[other], np.full(len(one), step)], axis=1))
        return np.concatenate(cuts)

    def _all_links(self, graph: Graph, moments: Indices, control: Array) -> Array:
        """Link margins at some steps: (moments, members, members), from and to, metres."""
        agents = np.array(graph.agents, dtype=np.int64)
        position, _ = self.splines.states(control)
        members = position[agents][:, moments].swapaxes(0, 1)
        return np.asarray(link_margin(graph, agents[:, None], agents, members[:, :, None], members[:, None, :]))

    def _spare(self, scale: float) -> float:
        """Target margin of a predicate with this natural scale, metres."""
        return max(self.spare.task, self.spare.scaled * scale) if np.isfinite(scale) else self.spare.task

    def _at(self, agent: Indices, step: Indices) -> Arguments:
        return self.splines.position(agent, step, np.zeros(len(agent)))


class _OfPoints(View):
    """View of the points that a predicate reads, (moments, dim) each: own position, own velocity, then other agents."""

    def __init__(
        self,
        points: tuple[Values, ...],
        others: list[int],
        radius: Array,
        altitude: Array,
        sides: tuple[Array, Array] | None,
    ) -> None:
        super().__init__(np, points[0].shape[-1])
        self.sides = sides
        self.points, self.others = points, others
        self.own_radius, self.own_altitude = radius, altitude

    def own(self) -> Values:
        return self.points[0]

    def place(self, agent: int) -> Values:
        return self.points[self.others.index(agent) - len(self.others)]

    def velocity(self) -> Values:
        return self.points[1]

    def outside(self, region: Region) -> Values:
        if self.sides is None:
            return super().outside(region)
        normal, offset = self.sides
        return offset - (normal * self.own()).sum(axis=1)

    def facing(self, towards: float | Beacon, within: float) -> Values:
        return of_velocity(np, self.own(), self.velocity(), towards, within)

    def of_place(self, value: Callable[[Any, Values], Values]) -> Values:
        """Value of a function of the positions that knows arrays only: derivatives are central differences."""
        width = 1e-6  # metres
        own = self.own()
        if not isinstance(own, Dual):
            return value(np, own)
        here = own.value
        offsets = width * np.concatenate([np.zeros((1, here.shape[1])), np.eye(here.shape[1]), -np.eye(here.shape[1])])
        found = value(np, (here + offsets[:, None]).reshape(-1, here.shape[1])).reshape(len(offsets), len(here))
        ahead, behind = found[1:].reshape(2, here.shape[1], len(here))
        return own.through(found[0], ((ahead - behind) / (2 * width)).T)

    def radius(self) -> Values:
        return self.own_radius

    def plane(self) -> Values:
        return self.own_altitude


def _kind(stretch: Stretch) -> tuple[int, bool]:
    return len(stretch.agents), stretch.longer


def _length(points: tuple[Values, ...]) -> Values:
    """Length of routes through points, (rows, dim) each, metres -> (rows,), metres."""
    return reduce(operator.add, [norm(after - here) for here, after in pairwise(points)])


def shares(errors: Array, total: float) -> Array:
    """Projection of errors, (edges, moments), metres, to nonnegative numbers with a given sum over the edges.

    Source:
        Duchi, Shalev-Shwartz, Singer and Chandra, "Efficient projections onto the l1-ball", 2008, algorithm 1.
    """
    falling = -np.sort(-errors, axis=0)
    over = (np.cumsum(falling, axis=0) - total) / np.arange(1, len(errors) + 1)[:, None]
    last = (falling > over).sum(axis=0, keepdims=True) - 1
    nearest: Array = np.maximum(errors - np.take_along_axis(over, last, axis=0), 0.0)
    return nearest


def norm(vector: Values) -> Values:
    """Lengths of vectors, (rows, dim) -> (rows,), in their unit, with a gradient everywhere."""
    axes = [vector[:, axis] for axis in range(vector.shape[1])]
    return np.sqrt(reduce(operator.add, [axis * axis for axis in axes]) + 1e-18)


def second_eigenvalue(weight: Values) -> Values:
    """Eigenvalue λ₂ of weighted graphs.

    Shape: (graphs, members, members), symmetric, zero diagonal -> (graphs,), dimensionless.

    Its derivative by a weight is the squared difference of its eigenvector along that link. Weights are dimensionless.

    Source:
        [clot] III-C, λ₂(L); Fiedler, "Algebraic connectivity of graphs", 1973.
    """
    weights = plain(weight)
    values, vectors = np.linalg.eigh(np.eye(weights.shape[-1]) * weights.sum(axis=-1)[..., None] - weights)
    if not isinstance(weight, Dual):
        return values[..., 1]
    second = vectors[..., 1]
    slope = (second[:, :, None] - second[:, None]) ** 2 / 2  # each link has two weights
    links = Dual(weights.reshape(len(weights), -1), weight.partials.reshape(*weight.partials.shape[:2], -1))
    return links.through(values[..., 1], slope.reshape(len(weights), -1))


def link_weight(link: Values, full: float) -> Values:
    """Weight of links in λ₂ by their margins, (...) -> (...), metres: 0 without a link, 1 from ``full`` on, smooth."""
    share = np.clip(link / full, 0.0, 1.0)
    return share * share * (3 - 2 * share)
