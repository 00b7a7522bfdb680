"""Regions in which a condition on an agent is true, for region predicates and comparisons.

in   Mission, a formula without operators
out  Region
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from missionc.backends.clot.cost_graph.cost_graph import SignedPredicate, signed_predicate
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array
from missionc.geometry.required_separation import SpacingTable
from missionc.geometry.sampling import points_in
from missionc.ir import Ball, Beacon, Box, Compare, Disc, Intersection, Mission, Polygon, Prism, Region, Shape
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Atom, Node, Not
from missionc.ir.predicates.features import DistanceTo


@dataclass(slots=True)
class Places:
    """Cache of the regions in which a mission's conditions are true."""

    mission: Mission
    made: dict[SignedPredicate | tuple[Region, Region], Region | None] = field(default_factory=dict)
    deepest: dict[Region, Array] = field(default_factory=dict)

    def of(self, node: Node) -> Region | None:
        """Region in which an atom, or its negation, is true for an agent; None for other formulas.

        The result is a region of the mission, one side of a line or plane, or the surroundings of a beacon or region.
        """
        if not isinstance(node, Atom | Not) or (isinstance(node, Not) and not isinstance(node.body, Atom)):
            return None
        predicate, holds = asked = signed_predicate(node)
        if asked not in self.made:
            if isinstance(predicate, Compare):
                self.made[asked] = self._compared(predicate if holds else _negated(predicate))
            else:
                self.made[asked] = predicate.region if holds else None
        return self.made[asked]

    def both(self, one: Region, other: Region) -> Region:
        """Intersection of two regions; the second region if the intersection is empty."""
        if one is other:
            return one
        if (one, other) not in self.made:
            shape = Intersection(one.shape, other.shape)
            found = len(points_in(shape, self.mission.world, 1, np.random.default_rng(0))[0])
            self.made[one, other] = replace(other, shape=shape) if found else other
        made = self.made[one, other]
        assert made is not None
        return made

    def centre(self, place: Region) -> Array:
        """Point deep inside a region, (dim,), metres."""
        if place not in self.deepest:
            world = self.mission.world
            count = clot_settings(self.mission).schedule.samples
            points, depth = points_in(place.shape, world, count, np.random.default_rng(0))
            middle = np.array(world.low) / 2 + np.array(world.high) / 2
            best = depth >= depth.max(initial=0.0) * 0.98
            self.deepest[place] = points[best].mean(axis=0) if len(points) else middle
        return self.deepest[place]

    def toward(self, region: Region, middle: Array, extent: float) -> Array:
        """Target of a team's centre in a region, (dim,), metres: no deeper than the team's extent requires."""
        centre = self.centre(region)
        deepest = -float(signed_distance(np, region.shape, centre))
        wanted = min(extent + 0.1, deepest * 0.95)
        low, high = 0.0, 1.0
        for _ in range(20):
            half = (low + high) / 2
            inside = -float(signed_distance(np, region.shape, middle + half * (centre - middle)))
            low, high = (low, half) if inside >= wanted else (half, high)
        target: Array = middle + high * (centre - middle)
        return target

    def slots(self, region: Region, agents: list[int], pitch: float) -> Array:
        """Positions in a region, one per agent, on a grid, nearest to its centre first: (agents, dim), metres."""
        widest = max(self.mission.agents[agent].radius for agent in agents)
        apart = SpacingTable.of(self.mission).among(np.array(agents)) + 0.3 * pitch
        centre = self.centre(region)
        count = int(np.ceil(np.sqrt(len(agents)))) + 4
        line = (np.arange(2 * count + 1) - count) * apart
        grids = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        points = np.tile(centre, (len(grids), 1))
        points[:, :2] += grids
        inside = -np.asarray(signed_distance(np, region.shape, points)) >= widest
        near = points[inside][np.argsort(np.linalg.norm(points[inside] - centre, axis=1), kind="stable")]
        if len(near) >= len(agents):
            chosen: Array = near[: len(agents)]
            return chosen
        spread, _ = points_in(region.shape, self.mission.world, 4 * len(agents), np.random.default_rng(0))
        padded: Array = np.concatenate([near, spread, np.tile(centre, (len(agents), 1))])[: len(agents)]
        return padded

    def _compared(self, compare: Compare) -> Region | None:
        shape: Shape | None = None
        directions = [feature.direction(self.mission.dimension) for _, feature in compare.terms]
        if compare.terms and all(directions) and any(any(direction or ()) for direction in directions):
            weights = np.zeros(self.mission.dimension)
            for (weight, _), direction in zip(compare.terms, directions, strict=True):
                weights += weight * np.array(direction)
            shape = self._half_space(weights, compare.constant)
        elif len(compare.terms) == 1 and isinstance(near := compare.terms[0][1], DistanceTo):
            weight = compare.terms[0][0]
            radius = -compare.constant / weight
            if weight < 0 and radius > 0:
                shape = self._near(near, radius)
        return None if shape is None else Region("comparison", shape, self.mission.world.span)

    def _half_space(self, weights: Array, constant: float) -> Shape | None:
        """Part of the world with ``weights @ point + constant >= 0``, weights (dim,), metres; None if no shape
        describes it."""
        low, high = list(self.mission.world.low), list(self.mission.world.high)
        axes = np.flatnonzero(weights)
        if len(axes) == 1:
            axis = int(axes[0])
            border = -constant / float(weights[axis])
            if weights[axis] > 0:
                low[axis] = max(low[axis], border)
            else:
                high[axis] = min(high[axis], border)
            return Box(tuple(low), tuple(high)) if low[axis] < high[axis] else None
        if 2 in axes:
            return None
        normal = weights[:2] / float(weights[:2] @ weights[:2])
        far = 4 * float(np.linalg.norm(np.array(high) - low) + np.abs([*low, *high]).max())
        origin, inward = -constant * normal, far * normal / float(np.linalg.norm(normal))
        beside = np.array([-inward[1], inward[0]])
        side = shapely.Polygon([origin - beside, origin + beside, origin + beside + inward, origin - beside + inward])
        part = shapely.intersection(side, shapely.box(low[0], low[1], high[0], high[1]))
        if not isinstance(part, shapely.Polygon) or part.area == 0:
            return None
        corners = tuple((float(x), float(y)) for x, y in part.exterior.coords[:-1])
        return Polygon(corners, Prism(low[2], high[2]) if len(low) == 3 else None)

    def _near(self, feature: DistanceTo, radius: float) -> Shape | None:
        """Points within ``radius`` metres of a beacon; for a region as the target, the region itself."""
        match feature.target:
            case Beacon(position=position):
                return Disc(position, radius) if len(position) == 2 else Ball(position, radius)
            case Region(shape=shape):
                return shape
            case _:
                return None


def _negated(compare: Compare) -> Compare:
    return Compare(tuple((-weight, each) for weight, each in compare.terms), -compare.constant, not compare.strict)
