"""The smoothest polynomials through a plan: one convex quadratic program.

Every piece is a degree-7 Bernstein curve. They pass every step's position at
its time, join with four continuous derivatives, rest at both ends, keep their
control points in a box inscribed in the tube around their segment, and have
the least integral of squared jerk. Control points of two agents, or of one
beside an obstacle, may be held on their sides of a plane: then so are the
curves, since they stay in the hulls of their points.

Source:
    Hönig, Preiss, Kumar, Sukhatme, Ayanian, "Trajectory Planning for Quadrotor Swarms" (2018), sections V and VI.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, sqrt

import numpy as np
import piqp
from scipy.sparse import coo_array, csc_matrix

from missionc.plan import Array, Flags

DEGREE = 7
JOIN = 4
"""Derivatives that are continuous at a joint."""
SAFE = 1e-5
"""Metres kept back from every bound: more than rounding to float32 takes."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Where each agent is to fly.

    Args:
        joint: (agents, pieces + 1, dim), metres: positions at the joints, where ``fixed``.
        fixed: (pieces + 1,): the joint is at a step, so that the position there is the plan's.
        start, end: (agents, pieces, dim): the segment that the piece stays near.
        radius: (agents, pieces), metres: how near.
    """

    joint: Array
    fixed: Flags
    start: Array
    end: Array
    radius: Array


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """In ``piece``: ``normal @ (first - second) >= offset`` for each of the 8 control points.

    ``second`` equal to ``first`` stands for the origin: the plane is about one agent.
    """

    piece: int
    first: int
    second: int
    normal: Array
    offset: Array


@dataclass(frozen=True, slots=True)
class NoFit:
    """The program has no solution, or the solver found none."""

    status: str


class _Rows:
    """Rows of a sparse matrix, with bounds, in the order they come."""

    def __init__(self, columns: int) -> None:
        self.columns = columns
        self.count = 0
        self.row: list[Array] = []
        self.column: list[Array] = []
        self.value: list[Array] = []
        self.low: list[Array] = []
        self.high: list[Array] = []

    def add(self, column: Array, value: Array, low: Array, high: Array) -> None:
        """(rows, entries) twice, (rows,) twice."""
        rows = column.shape[0]
        self.row.append(np.repeat(np.arange(self.count, self.count + rows), column.shape[1]))
        self.column.append(column.ravel())
        self.value.append(np.broadcast_to(value, column.shape).ravel())
        self.low.append(np.broadcast_to(low, rows))
        self.high.append(np.broadcast_to(high, rows))
        self.count += rows

    def matrix(self) -> csc_matrix:
        index = (np.concatenate(self.row), np.concatenate(self.column))
        return csc_matrix(coo_array((np.concatenate(self.value), index), shape=(self.count, self.columns)))

    def bounds(self) -> tuple[Array, Array]:
        return np.concatenate(self.low), np.concatenate(self.high)


def fit(course: Course, planes: list[Plane], low: Array, high: Array) -> Array | NoFit:
    """Control points (agents, pieces, dim, 8) in metres; pieces are of equal duration.

    Args:
        planes: agents by their index in ``course``.
        low, high: (dim,): the world, which holds every control point.
    """
    agents, pieces, dim = course.start.shape
    index = np.arange(agents * pieces * dim * (DEGREE + 1)).reshape(agents, pieces, dim, DEGREE + 1)
    # Numbers near zero: every agent's coordinates are counted from its first position.
    origin = course.joint[:, 0]
    equal, bounded = _Rows(index.size), _Rows(index.size)
    _join(equal, index, course.joint - origin[:, None], course.fixed)
    _tubes(bounded, index, course, origin)
    for plane in planes:
        _hold(bounded, index, plane, course.fixed, origin)
    x_low = np.broadcast_to((low - SAFE / 10 - origin)[:, None, :, None], index.shape).ravel()
    x_high = np.broadcast_to((high + SAFE / 10 - origin)[:, None, :, None], index.shape).ravel()
    solver = piqp.SparseSolver()
    solver.settings.eps_abs = solver.settings.eps_rel = 1e-10
    solver.settings.max_iter = 100
    target, _ = equal.bounds()
    h_low, h_high = bounded.bounds()
    cost = _jerk(agents * pieces * dim)
    solver.setup(cost, np.zeros(index.size), equal.matrix(), target, bounded.matrix(), h_low, h_high, x_low, x_high)
    status = solver.solve()
    if status != piqp.PIQP_SOLVED:
        return NoFit(str(status))
    points: Array = np.array(solver.result.x).reshape(index.shape) + origin[:, None, :, None]
    points[..., 0][:, course.fixed[:-1]] = course.joint[:, :-1][:, course.fixed[:-1]]
    points[..., DEGREE][:, course.fixed[1:]] = course.joint[:, 1:][:, course.fixed[1:]]
    return points


def _jerk(curves: int) -> csc_matrix:
    """The integral of squared jerk of each curve, up to a factor."""
    difference = np.zeros((DEGREE - 2, DEGREE + 1))
    for row in range(DEGREE - 2):
        difference[row, row : row + 4] = (-1, 3, -3, 1)
    left = DEGREE - 3
    gram = np.array(
        [[comb(left, i) * comb(left, j) / comb(2 * left, i + j) for j in range(left + 1)] for i in range(left + 1)]
    )
    block = difference.T @ gram @ difference
    row, column = np.indices(block.shape)
    shift = (np.arange(curves) * (DEGREE + 1))[:, None]
    entries = (np.tile(block.ravel(), curves), ((row.ravel() + shift).ravel(), (column.ravel() + shift).ravel()))
    size = curves * (DEGREE + 1)
    return csc_matrix(coo_array(entries, shape=(size, size)))


def _join(rows: _Rows, index: Array, joint: Array, fixed: Flags) -> None:
    """Positions at the steps, continuity between pieces, rest at both ends."""

    def pin(column: Array, where: Array) -> None:
        rows.add(column.reshape(-1, 1), np.ones(1), where.ravel(), where.ravel())

    pin(index[..., 0][:, fixed[:-1]], joint[:, :-1][:, fixed[:-1]])
    pin(index[..., DEGREE][:, fixed[1:]], joint[:, 1:][:, fixed[1:]])
    for order in range(1, 4):
        pin(index[:, 0, :, order], joint[:, 0])
        pin(index[:, -1, :, DEGREE - order], joint[:, -1])
    free = np.flatnonzero(~fixed[1:-1])
    if free.size:
        pairs = np.stack([index[..., DEGREE][:, free], index[..., 0][:, free + 1]], axis=-1)
        rows.add(pairs.reshape(-1, 2), np.array([1.0, -1.0]), np.zeros(1), np.zeros(1))
    for order in range(1, JOIN + 1):
        weight = np.array([(-1) ** (order - i) * comb(order, i) for i in range(order + 1)], dtype=np.float64)
        before = index[:, :-1, :, DEGREE - order :]
        after = index[:, 1:, :, : order + 1]
        columns = np.concatenate([before, after], axis=-1).reshape(-1, 2 * order + 2)
        rows.add(columns, np.concatenate([weight, -weight]), np.zeros(1), np.zeros(1))


def _tubes(rows: _Rows, index: Array, course: Course, origin: Array) -> None:
    """Each piece's control points in a box, in the frame of its segment, that the tube holds."""
    dim = origin.shape[-1]
    along = course.end - course.start
    length = np.linalg.norm(along, axis=-1)
    frame = _frames(along, length)
    # The box reaches as far past the segment's ends as beside it, its corners just inside the tube.
    spare = np.maximum(course.radius - SAFE, course.radius / 2) / sqrt(dim)
    columns = np.moveaxis(index, 3, 2)
    start = course.start - origin[:, None]
    loose = _loose(course.fixed)
    piece, point = np.nonzero(loose)
    for axis in range(dim):
        direction = frame[:, :, axis]
        base = (direction * start).sum(axis=-1)
        far = length if axis == 0 else np.zeros_like(length)
        rows.add(
            columns[:, piece, point].reshape(-1, dim),
            direction[:, piece].reshape(-1, dim),
            (base - spare)[:, piece].ravel(),
            (base + far + spare)[:, piece].ravel(),
        )


def _loose(fixed: Flags) -> Flags:
    """(pieces, 8): the control point is not at a step, where the plan alone says what is right."""
    loose = np.ones((fixed.size - 1, DEGREE + 1), dtype=bool)
    loose[:, 0], loose[:, DEGREE] = ~fixed[:-1], ~fixed[1:]
    return loose


def _frames(along: Array, length: Array) -> Array:
    """Right-angled frames whose first direction is along the segment: (..., axis, dim)."""
    dim = along.shape[-1]
    first = np.zeros_like(along)
    first[..., 0] = 1.0
    moving = length > 1e-9
    first[moving] = along[moving] / length[moving][:, None]
    if dim == 2:
        return np.stack([first, np.stack([-first[..., 1], first[..., 0]], axis=-1)], axis=-2)
    other = np.zeros_like(first)
    np.put_along_axis(other, np.abs(first).argmin(axis=-1)[..., None], 1.0, axis=-1)
    second = np.cross(first, other)
    second /= np.linalg.norm(second, axis=-1)[..., None]
    return np.stack([first, second, np.cross(first, second)], axis=-2)


def _hold(rows: _Rows, index: Array, plane: Plane, fixed: Flags, origin: Array) -> None:
    offset = plane.offset - plane.normal @ origin[plane.first]
    columns = index[plane.first, plane.piece].T
    weight = plane.normal
    if plane.second != plane.first:
        offset = offset + plane.normal @ origin[plane.second]
        columns = np.concatenate([columns, index[plane.second, plane.piece].T], axis=-1)
        weight = np.concatenate([weight, -weight])
    loose = _loose(fixed)[plane.piece]
    rows.add(columns[loose], weight, offset[loose], np.full(int(loose.sum()), np.inf))
