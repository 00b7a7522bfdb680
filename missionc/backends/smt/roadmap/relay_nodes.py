"""Relay nodes: rows of nodes between two regions, each nearer to the next than agents that must be linked.

    in   Ground, kernel
    out  points in free space

A team that stays linked on its way from one region to another needs a node for each relay, and the relays move. Several
rows are therefore placed between the nearest parts of the two regions. Random nodes hardly ever form such a row.
"""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
from scipy.spatial import cKDTree

from missionc.backends.smt.roadmap.sample_nodes import Ground
from missionc.backends.smt.settings import smt_settings
from missionc.base.trace import Array
from missionc.geometry.sampling import far_apart, points_in
from missionc.ir import Proximity, Region
from missionc.ir.kernel.analysis import linked_by
from missionc.ir.kernel.nodes import Atom, Kernel
from missionc.ir.kernel.walk import postorder


def relay_nodes(ground: Ground, kernel: Kernel, generator: np.random.Generator) -> Array:
    """Rows of nodes for the links of the kernel, (nodes, dim), metres; none without regions in its linked formulas."""
    found = [np.zeros((0, ground.mission.dimension))]
    for goal in kernel.requirements:
        below = postorder((goal.formula,))
        graphs = [graph for graph in linked_by((goal.formula,)) if isinstance(graph, Proximity)]
        regions = dict.fromkeys(region for node in below if isinstance(node, Atom) for region in node.predicate.regions)
        for graph in graphs:
            for one, other in combinations(regions, 2):
                found.append(_rows(ground, (one, other), graph.radius, len(graph.agents), generator))
    points = np.concatenate(found)
    return points[ground.is_free(points)]


def _rows(
    ground: Ground, regions: tuple[Region, Region], radius: float, most: int, generator: np.random.Generator
) -> Array:
    """Rows from one region to the other, at most ``radius`` between nodes and with at most ``most`` links."""
    near = 0.97  # share of the radius between two nodes
    settings, world = smt_settings(ground.mission).roadmap, ground.mission.world
    here, there = (points_in(region.shape, world, settings.region_samples, generator)[0] for region in regions)
    here, there = here[ground.is_free(here)], there[ground.is_free(there)]
    if not len(here) or not len(there):
        return np.zeros((0, world.dimension))
    distance, nearest = cKDTree(there).query(here)
    apart, target = np.asarray(distance), np.asarray(nearest)
    links = math.ceil(float(apart.min()) / (near * radius))
    able = np.flatnonzero(apart <= links * near * radius)
    if not 1 <= links <= most:
        return np.zeros((0, world.dimension))
    first = able[far_apart(here[able], settings.relay_rows, there[:0])]
    shares = np.linspace(0.0, 1.0, links + 1)[:, None, None]
    return np.concatenate(here[first] + shares * (there[target[first]] - here[first]))
