"""Geodesics around static obstacles: shortest paths on a grid for a point with some clearance.

Growing obstacles have their initial size. Unlike a visibility graph, a grid gives the distances from all cells to a
goal at once, and its cells may have speed limits (``slowness``).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse.csgraph import dijkstra

from missionc.backends.clot.optimise.obstacle_index import Obstacles
from missionc.backends.clot.settings import clot_settings
from missionc.base.trace import Array, Indices
from missionc.geometry.polylines import at_lengths, at_shares, length
from missionc.geometry.vectors import norm
from missionc.ir import Box, Dynamics, Mission, Still
from missionc.ir.distances.signed_distance import signed_distance


class Geodesics:
    """Shortest paths between points with a clearance to obstacles and the world's bounds, on a grid.

    Args:
        figure: offsets of the moving body's parts from its reference point, (parts, dim), metres.
    """

    def __init__(self, mission: Mission, figure: Array | None = None) -> None:
        self.mission = mission
        self.figure = np.zeros((1, mission.dimension)) if figure is None else figure
        standing = [replace(each, growth=0.0) for each in mission.obstacles if isinstance(each.motion, Still)]
        self.standing = Obstacles(mission, standing)
        low, high = np.array(mission.world.low), np.array(mission.world.high)
        size = high - low
        self.cell = float((np.prod(size) / clot_settings(mission).schedule.cells) ** (1 / len(size)))
        self.low = low
        self.shape = tuple(int(count) for count in np.maximum(np.ceil(size / self.cell), 1))
        self.graphs: dict[float, sparse.csr_matrix] = {}

    @cached_property
    def points(self) -> Array:
        """Centres of the cells, (grid, dim), metres."""
        return middles(self.low, self.cell, self.shape)

    @cached_property
    def room(self) -> Array:
        """Clearance at the centres of the cells, (grid,), metres."""
        return self.room_at(self.points)

    def room_at(self, points: Array) -> Array:
        """Clearance at points: least distance of the body's parts from static obstacles and bounds, (..., dim), metres
        -> (...), metres."""
        together = 1 << 18  # points in one array
        size = max(1, together // (points.size // points.shape[-1]))
        parts = self.figure.reshape(-1, *(1,) * (points.ndim - 1), points.shape[-1])
        some = [self._room(points + parts[begin : begin + size]).min(axis=0) for begin in range(0, len(parts), size)]
        room: Array = np.min(some, axis=0)
        return room

    def room_near(self, points: Array) -> Array:
        """Clearance at the centre of the cell that contains a point: (..., dim), metres -> (...), metres; -inf outside
        the grid."""
        flat = points.reshape(-1, points.shape[-1])
        room: Array = self.room[tuple(self._cell(flat).T)].reshape(points.shape[:-1])
        outside = ((points < self.low) | (points > np.array(self.mission.world.high))).any(axis=-1)
        return np.where(outside, -np.inf, room)

    def _room(self, points: Array) -> Array:
        world = Box(self.mission.world.low, self.mission.world.high)
        room: Array = -np.asarray(signed_distance(np, world, points))
        standing = self.standing.standing_room(points.reshape(-1, points.shape[-1]))
        room = np.minimum(room, standing.reshape(room.shape))
        return room

    def way(
        self,
        start: Array,
        end: Array,
        wanted: float,
        least: float,
        avoid: Array | None = None,
        slowness: Array | None = None,
    ) -> Array | None:
        """Shortest path from start to end, (dim,) each, as corners, (corners, dim), metres; None without a path.

        Args:
            wanted: target clearance along the path, metres; less if the detour would be too long.
            least: minimum clearance between the ends, metres.
            avoid: points of paths to avoid, (points, dim), metres.
            slowness: cost per metre in each cell, (grid,), for the fastest path; None for 1.
        """
        shortest = self._with(start, end, least, avoid, slowness)
        if shortest is None:
            return None
        longest = clot_settings(self.mission).schedule.detour * self._effort(shortest, slowness)
        for room in (wanted, (wanted + least) / 2):
            way = self._with(start, end, room, avoid, slowness)
            if way is not None and self._effort(way, slowness) <= longest and self._open(way, least):
                return way
        return shortest

    def paced(self, way: Array, share: Array, slowness: Array | None) -> Array:
        """Points of a path at fractions, (points,), of its duration: (points, dim), metres.

        Args:
            slowness: cost per metre in each cell, (grid,); None for 1.
        """
        if slowness is None:
            return at_shares(way, share)
        fine = self._fine(way)
        effort = np.r_[0.0, np.cumsum(self._efforts(fine, slowness))]
        if effort[-1] == 0:
            return np.repeat(way[:1], len(share), axis=0)
        return at_lengths(fine, effort, share * effort[-1])

    def _effort(self, way: Array, slowness: Array | None) -> float:
        """Cost of a path, (corners, dim), in weighted metres."""
        return length(way) if slowness is None else float(self._efforts(self._fine(way), slowness).sum())

    def _efforts(self, fine: Array, slowness: Array) -> Array:
        """Cost of each segment of a path, (pieces,), in weighted metres; no segment is longer than half a cell."""
        cell = self._cell((fine[1:] + fine[:-1]) / 2)
        efforts: Array = norm(np.diff(fine, axis=0)) * slowness.reshape(self.shape)[tuple(cell.T)]
        return efforts

    def _fine(self, way: Array) -> Array:
        """Path with additional points, (points, dim), metres, no further apart than half a cell."""
        pieces = []
        for here, there in pairwise(way):
            count = max(1, int(np.ceil(float(np.linalg.norm(there - here)) / (self.cell / 2))))
            pieces.append(here + (there - here) * (np.arange(count) / count)[:, None])
        return np.concatenate([*pieces, way[-1:]])

    def lengths(self, start: Array, room: float) -> Array:
        """Path length from a point, (dim,), to each cell with this clearance, (cells,), metres; infinite without a
        path."""
        first = self._free(start, room)
        return np.asarray(dijkstra(self._graph(room), directed=True, indices=np.array(first)))

    def _with(self, start: Array, end: Array, room: float, avoid: Array | None, slowness: Array | None) -> Array | None:
        """Shortest path with this clearance, (corners, dim), metres, straight if possible; None without a path."""
        if avoid is None and slowness is None and self._clear(start, end, room):
            return np.stack([start, end])
        return self._around(start, end, room, avoid, slowness)

    def _open(self, way: Array, room: float) -> bool:
        """Return true if each segment of a path, (corners, dim), metres, is clear; the nearest free cell may be behind
        a wall."""
        return all(self._clear(here, there, room) for here, there in pairwise(way))

    def _clear(self, start: Array, end: Array, room: float) -> bool:
        """Return true if the straight path is clear, except for clearance that is already missing near its ends,
        (dim,), metres."""
        count = max(2, int(np.ceil(float(np.linalg.norm(end - start)) / (self.cell / 2))) + 1)
        share = np.linspace(0.0, 1.0, count)[:, None]
        points = start * (1 - share) + end * share
        from_ends = np.minimum(norm(points - start), norm(points - end))
        there = self.room_at(points)
        lacking = room - min(there[0], there[-1], room)
        return bool((there >= room - np.maximum(lacking - from_ends, 0.0) - 1e-9).all())

    def _around(
        self, start: Array, end: Array, room: float, avoid: Array | None, slowness: Array | None
    ) -> Array | None:
        graph = self._graph(room) if slowness is None else slowed(self._graph(room), slowness)
        if avoid is not None:
            near = np.zeros(self.shape, dtype=np.bool_)
            near[tuple(self._cell(avoid).T)] = True
            wide = ndimage.binary_dilation(near, iterations=max(1, int(0.6 / self.cell))).ravel()
            scale = sparse.diags(np.where(wide, 4.0, 1.0))
            graph = scale @ graph
        first, last = self._free(start, room), self._free(end, room)
        lengths, before = dijkstra(graph, directed=True, indices=np.array(first), return_predecessors=True)
        if not np.isfinite(lengths[last]):
            return None
        cells = [last]
        while cells[-1] != first:
            cells.append(int(before[cells[-1]]))
        path = self.points.reshape(-1, self.points.shape[-1])[cells[::-1]]
        return self._pulled(np.concatenate([start[None], path, end[None]]), room, slowness)

    def _graph(self, room: float) -> sparse.csr_matrix:
        """Graph of moves between neighbouring free cells, weighted by their length, metres."""
        if room not in self.graphs:
            free = self.room >= room
            number = np.pad(np.where(free, np.arange(free.size).reshape(self.shape), -1), 1, constant_values=-1)
            moves = np.array([move for move in product((-1, 0, 1), repeat=len(self.shape)) if any(move)])
            neighbours = [number[tuple(map(slice, 1 + move, 1 + move + self.shape))] for move in moves]
            other = np.stack(neighbours, axis=-1).reshape(free.size, len(moves))
            allowed = free.reshape(-1, 1) & (other >= 0)
            lengths = np.tile(self.cell * norm(moves), (free.size, 1))
            ends = np.r_[0, np.cumsum(allowed.sum(axis=1))]
            self.graphs[room] = sparse.csr_matrix((lengths[allowed], other[allowed], ends), shape=2 * (free.size,))
        return self.graphs[room]

    def _cell(self, points: Array) -> Indices:
        return cells_of(points, self.low, self.cell, self.shape)

    def _free(self, point: Array, room: float) -> int:
        """Index of the cell with this clearance that is nearest to a point, (dim,), metres."""
        free = np.flatnonzero(self.room >= room)
        if len(free) == 0:
            return int(np.ravel_multi_index(tuple(self._cell(point)), self.shape))
        centres = self.points.reshape(-1, self.points.shape[-1])[free]
        return int(free[norm(centres - point).argmin()])

    def _pulled(self, path: Array, room: float, slowness: Array | None) -> Array:
        """Path, (corners, dim), metres, without corners that are unnecessary and do not save time."""
        corners = [path[0]]
        here = 0

        def can_be_straight(ahead: int) -> bool:
            if slowness is not None:
                straight, bent = (
                    self._effort(each, slowness) for each in (path[[here, ahead]], path[here : ahead + 1])
                )
                if straight > bent:
                    return False
            return self._clear(path[here], path[ahead], room)

        while here < len(path) - 1:
            ahead = len(path) - 1
            while ahead > here + 1 and not can_be_straight(ahead):
                ahead = here + (ahead - here + 1) // 2
            corners.append(path[ahead])
            here = ahead
        return np.array(corners)


def middles(low: Array, cell: float, shape: tuple[int, ...]) -> Array:
    """Centres of the cells of a grid, (*shape, dim), metres, with lowest corner ``low``, (dim,)."""
    axes = [first + (np.arange(count) + 0.5) * cell for first, count in zip(low, shape, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def cells_of(points: Array, low: Array, cell: float, shape: tuple[int, ...]) -> Indices:
    """Indices of the cells that contain, or are nearest to, points: (..., dim), metres -> (..., dim)."""
    index: Indices = np.clip(np.floor((points - low) / cell).astype(np.int64), 0, np.array(shape) - 1)
    return index


def slowed(moves: sparse.csr_matrix, slowness: Array) -> sparse.csr_matrix:
    """Graph of moves with each length, metres, multiplied by the mean slowness of its two cells, (grid,)."""
    row = np.repeat(np.arange(moves.shape[0]), np.diff(moves.indptr))
    lengths = moves.data * (slowness[row] + slowness[moves.indices]) / 2
    return sparse.csr_matrix((lengths, moves.indices, moves.indptr), shape=moves.shape)


def eased(share: Array, way: Array, seconds: float, dynamics: Dynamics) -> Array:
    """Fractions of a path's length at fractions of its time, (points,) each: from rest to rest if time suffices,
    otherwise at constant speed.

    Args:
        way: (corners, dim), metres.
        seconds: duration.
    """
    ease = 0.8  # share of the top acceleration that an agent uses if there is time
    far = length(way)
    most = ease * dynamics.top_acceleration * seconds**2
    if not 0 < 4 * far <= most < np.inf:
        return share
    ramp = (1 - np.sqrt(1 - 4 * far / most)) / 2
    if far / seconds > (1 - ramp) * dynamics.top_speed:
        return share
    side = np.minimum(share, 1 - share)
    gone = np.where(side < ramp, side**2 / (2 * ramp), side - ramp / 2) / (1 - ramp)
    result: Array = np.where(share <= 0.5, gone, 1 - gone)
    return result
