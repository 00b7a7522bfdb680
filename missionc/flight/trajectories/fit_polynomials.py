"""Minimum-acceleration polynomials through a plan, by one convex quadratic program with soft bounds.

They pass every step's position at its time, or near it. They rest at both ends, or begin in the present motion. They
minimise the integral of squared acceleration, with a small weight on the jerk, which smooths them.

A leg is a polynomial piece, or a part of one, near one segment of the plan. Its control points stay in a box inscribed
in the tube around the segment. Control points of two agents, or of one beside an obstacle, may be constrained to their
sides of a plane. Then the curves stay there too, since they lie in the hulls of their control points.

Source:
    Hönig, Preiss, Kumar, Sukhatme, Ayanian, "Trajectory Planning for Quadrotor Swarms" (2018), sections V and VI.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb, factorial, sqrt

import numpy as np
import piqp
from scipy.sparse import block_array, block_diag, coo_array, csc_matrix, csr_array, eye_array, hstack, kron

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.curves.smooth_splines import DEGREE, control_points_of, effort, part_of

PENALTY = 1e5
"""Penalty for a metre beyond a bound if not all bounds are feasible, in units of effort."""


class NoFit(Record):
    """Result of a quadratic program for which the solver found no solution."""

    status: str


class Rows:
    """Linear bounds on control points, added row by row; each belongs to a leg."""

    def __init__(self, columns: int) -> None:
        self.columns = columns
        self.count = 0
        self.row: list[Array] = []
        self.column: list[Array] = []
        self.value: list[Array] = []
        self.low: list[Array] = []
        self.high: list[Array] = []
        self.leg: list[Indices] = []

    def add(self, column: Array, value: Array, low: Array, high: Array, leg: Indices) -> None:
        """Add bounds on weighted sums of control points.

        Args:
            column, value: indices of control points and their weights, (rows, entries).
            low, high: bounds in metres, (rows,).
            leg: leg of each bound, (rows,).
        """
        rows = column.shape[0]
        self.row.append(np.repeat(np.arange(self.count, self.count + rows), column.shape[1]))
        self.column.append(column.ravel())
        self.value.append(np.broadcast_to(value, column.shape).ravel())
        self.low.append(np.broadcast_to(low, rows))
        self.high.append(np.broadcast_to(high, rows))
        self.leg.append(np.broadcast_to(leg, rows))
        self.count += rows

    def matrix(self) -> csr_array:
        if not self.count:
            return csr_array((0, self.columns))
        index = (np.concatenate(self.row), np.concatenate(self.column))
        return csr_array(coo_array((np.concatenate(self.value), index), shape=(self.count, self.columns)))

    def over(self, spread: csr_array, resting: Array) -> Bounds:
        """Bounds on the free spline coefficients instead of control points.

        Rows without free coefficients are left out.

        Args:
            spread: (columns, coefficients): contribution of each to the control points.
            resting: (columns,), metres: control points with all of them 0.
        """
        if not self.count:
            return Bounds(csr_array((0, spread.shape[1])), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
        matrix = self.matrix()
        weight, here = csr_array(matrix @ spread), matrix @ resting
        free = np.diff(weight.indptr) > 0
        low, high = np.concatenate(self.low) - here, np.concatenate(self.high) - here
        return Bounds(weight[free], low[free], high[free], np.concatenate(self.leg)[free])


class Bounds(Record, eq=False):
    """Linear bounds ``low <= weight @ numbers <= high``; each row belongs to a ``leg``."""

    weight: csr_array
    low: Array
    high: Array
    leg: Indices


class Solution(Record, eq=False):
    """Solution of a quadratic program, and its excess over bounds by leg: (legs,).

    ``kept`` is the number of fully satisfied groups of bounds.
    """

    numbers: Array
    excess: Array
    kept: int


class Program(Record, eq=False):
    """Quadratic program: minimise ``numbers @ quadratic @ numbers / 2 + linear @ numbers``, ``pins @ numbers ==
    target``.

    ``bounds`` come in groups; if not all are feasible, the last ones are exceeded first.
    """

    quadratic: csr_array
    linear: Array
    pins: csr_array
    target: Array
    bounds: tuple[Bounds, ...]

    def within(self, legs: int, most: int | None = None) -> Solution | NoFit:
        """Solution that satisfies as many groups of bounds as possible.

        Args:
            legs: number of legs.
            most: upper limit of satisfied groups, if more are known to fail.
        """
        none = NoFit("")
        for strict in range(len(self.bounds) if most is None else most, -1, -1):
            loose = self.bounds[strict:]
            if loose and not loose[0].low.size:
                continue
            solved = self._solved(list(self.bounds[:strict]), list(reversed(loose)), legs)
            if not isinstance(solved, NoFit):
                return Solution(*solved, strict)
            none = solved
        return none

    def _solved(self, strict: list[Bounds], loose: list[Bounds], legs: int) -> tuple[Array, Array] | NoFit:
        """Solution vector, (numbers,), and excess over ``loose`` bounds, (legs,), metres.

        ``loose`` bounds may be exceeded at a high cost.
        """
        count, extra = self.linear.size, legs if loose else 0
        weight, low, high = [bounds.weight for bounds in strict], [b.low for b in strict], [b.high for b in strict]
        blocks = [[part, csr_array((part.shape[0], extra))] for part in weight]
        for bounds in loose:
            for sign, border in ((1.0, bounds.low), (-1.0, bounds.high)):
                finite = np.flatnonzero(np.isfinite(border))
                where = (np.arange(finite.size), bounds.leg[finite])
                unit = coo_array((np.ones(finite.size), where), shape=(finite.size, extra))
                blocks += [[bounds.weight[finite] * sign, csr_array(unit)]]
                low += [sign * border[finite]]
                high += [np.full(finite.size, np.inf)]
        solver = piqp.SparseSolver()
        solver.settings.eps_abs = solver.settings.eps_rel = 1e-9
        solver.settings.max_iter = 200
        solver.setup(
            csc_matrix(block_diag([self.quadratic, csr_array((extra, extra))])),
            np.concatenate([self.linear, np.full(extra, PENALTY)]),
            csc_matrix(hstack([self.pins, csr_array((self.pins.shape[0], extra))])),
            self.target,
            csc_matrix(block_array(blocks)),
            np.concatenate(low),
            np.concatenate(high),
            np.concatenate([np.full(count, -np.inf), np.zeros(extra)]),
            np.full(count + extra, np.inf),
        )
        status = solver.solve()
        if status != piqp.PIQP_SOLVED:
            return NoFit(str(status))
        solution = np.array(solver.result.x)
        return solution[:count], solution[count:] if loose else np.zeros(legs)


SAFE = 1e-5
"""Margin by which every bound is tightened, metres: more than float32 rounding in a hall."""
ROUNDED = 2.0**-21
"""Margin by which bounds are tightened, as a fraction of the largest coordinate: eight float32 numbers are added, each
with error 2**-24.
"""
REST = 4
"""Number of coefficients at an end of the spline that are equal if the agent rests there."""
ROUNDING_OFF = 0.02
"""Weight of the squared jerk relative to the squared acceleration, in steps.

Minimum jerk alone accelerates longer and reaches higher speeds.
"""


class Course(Record, eq=False):
    """Segments and joints that the polynomials of each agent follow.

    Args:
        times: (legs + 1,), seconds: the joints.
        joint: (agents, legs + 1, dim), metres: positions at the joints, if ``fixed``.
        fixed: (legs + 1,): True if the joint is at a step, with the plan's position.
        start, end: (agents, legs, dim): segment of the leg, metres.
        radius: (agents, legs), metres: tube radius.
        knot: (legs + 1,): True between two pieces; other joints lie within one.
        slack: tolerance of a step's position, metres; 0 for exact passage.
        begin: (agents, dim, 5), metres: first control points of the first piece, if some begin in motion.
    """

    times: Array
    joint: Array
    fixed: Flags
    start: Array
    end: Array
    radius: Array
    knot: Flags
    slack: float = 0.0
    begin: Array | None = None

    @property
    def pinned(self) -> Flags:
        """Flags of the joints that have the plan's exact position: (legs + 1,)."""
        if self.slack == 0.0:
            return self.fixed
        ends = np.zeros_like(self.fixed)
        ends[[0, -1]] = True
        return ends

    @property
    def safe(self) -> float:
        """Margin by which every bound is tightened, metres: more than float32 rounding, even kilometres from the
        origin.
        """
        return max(SAFE, ROUNDED * float(np.abs(self.joint).max()))


class Plane(Record, eq=False):
    """Separating plane: ``normal @ (first - second) >= offset`` for the 8 control points of a part of ``leg``.

    ``part`` has two fractions of the leg's duration. If ``second`` equals ``first``, it stands for the origin: the
    plane is for one agent.
    """

    leg: int
    part: tuple[float, float]
    first: int
    second: int
    normal: Array
    offset: Array


class Cut(Record, eq=False):
    """Cutting plane: ``weight``, (dim, 8), times the control points of an agent's piece is at most 1.

    Each axis of ``weight`` has sum 0: a cut is about a derivative, independent of the position.
    """

    agent: int
    piece: int
    weight: Array


class Fitted(Record, eq=False):
    """Control points of the fitted polynomials, with the bounds that they satisfy.

    Args:
        points: (agents, pieces, dim, 8), metres.
        excess: (legs,): excess of each leg over a bound, metres.
        kept: number of satisfied groups of tubes, planes and cuts, in this order.
    """

    points: Array
    excess: Array
    kept: int


class Splines(Record, eq=False):
    """Matrices over a spline's coefficients that all coordinates and agents of a course share.

    Args:
        whole: (pieces * 8, coefficients): control points of every piece.
        along: (legs * 8, coefficients): control points of every leg.
        cost: (coefficients, coefficients): quadratic form of the effort.
    """

    whole: csr_array
    along: csr_array
    cost: csr_array


def splines(course: Course) -> Splines:
    """Spline matrices for the joints of a course, which several fits can share."""
    times = _in_steps(course)
    curve = control_points_of(times[course.knot])
    lasting = np.diff(times[course.knot])
    form = effort(2, lasting) + ROUNDING_OFF * effort(3, lasting)
    return Splines(
        curve, csr_array(_legs(course) @ curve), csr_array(curve.T @ block_diag(list(form), format="csr") @ curve)
    )


def _in_steps(course: Course) -> Array:
    """Times of the joints in time steps, (legs + 1,), so that durations are near one."""
    return np.asarray(course.times * ((int(course.fixed.sum()) - 1) / course.times[-1]))


def fit(
    course: Course,
    planes: list[Plane],
    low: Array,
    high: Array,
    cuts: Sequence[Cut] = (),
    shared: Splines | None = None,
    most: int | None = None,
) -> Fitted | NoFit:
    """Polynomials of minimum effort within all bounds.

    If the bounds are infeasible, the excess over cuts, then planes, then tubes is minimised.

    Args:
        planes, cuts: bounds whose agents are indices in ``course``.
        low, high: (dim,) or (agents, legs, dim), metres: bounds of every control point.
        shared: the course's ``splines``, if already computed.
        most: number of groups satisfied in a fit with fewer bounds, an upper limit.
    """
    agents, legs, dim = course.start.shape
    points = np.arange(agents * dim * legs * (DEGREE + 1)).reshape(agents, dim, legs, DEGREE + 1)
    index = points.transpose(0, 2, 1, 3)
    # Numbers near one: coordinates relative to each agent's first position, and times in steps.
    origin = course.joint[:, 0]
    shared = shared or splines(course)
    many, last = csr_array(eye_array(agents * dim)), (course.joint[:, -1] - origin).ravel()
    first = _first_coefficients(course, shared, origin)
    whole, along = (_Spread(curve, many, first, last) for curve in (shared.whole, shared.along))
    free, cost = whole.free, shared.cost
    quadratic = csr_array(kron(many, cost[free, free]))
    linear: Array = (whole.fixed @ cost[:, free]).ravel()
    near, held, cut_rows = Rows(index.size), Rows(index.size), Rows(whole.matrix.shape[0])
    _world(near, index, course, origin, low, high)
    _tubes(near, index, course, origin)
    _waypoints(near, index, course, origin)
    for plane in planes:
        _hold(held, index, plane, course.pinned, origin)
    for cut in cuts:
        _keep(cut_rows, cut, course)
    inner = np.flatnonzero(course.pinned[1:-1]) + 1
    pins = index[..., 0][:, inner].ravel()
    target = (course.joint[:, inner] - origin[:, None]).ravel() - along.resting[pins]
    bounds = (
        near.over(along.matrix, along.resting),
        held.over(along.matrix, along.resting),
        cut_rows.over(whole.matrix, whole.resting),
    )
    solved = Program(quadratic, linear, along.matrix[pins], target, bounds).within(legs, most)
    if isinstance(solved, NoFit):
        return solved
    spread: Array = whole.matrix @ solved.numbers + whole.resting
    control_points = spread.reshape(agents, dim, -1, DEGREE + 1).transpose(0, 2, 1, 3) + origin[:, None, :, None]
    pinned, joint = course.pinned[course.knot], course.joint[:, course.knot]
    control_points[..., 0][:, pinned[:-1]] = joint[:, :-1][:, pinned[:-1]]
    control_points[..., DEGREE][:, pinned[1:]] = joint[:, 1:][:, pinned[1:]]
    return Fitted(control_points, solved.excess, solved.kept)


class _Spread:
    """Map from the free coefficients of all agents' splines to control points: ``matrix @ numbers + resting``.

    Args:
        curve: (points, coefficients), for one coordinate of one agent.
        many: identity over all of them.
        first: (agents * dim, coefficients), metres: coefficients fixed by the beginning.
        last: (agents * dim,), metres: final positions, at rest.
    """

    def __init__(self, curve: csr_array, many: csr_array, first: Array, last: Array) -> None:
        count = curve.shape[1]
        self.free = slice(first.shape[1], count - REST)
        self.fixed: Array = np.zeros((last.size, count))
        self.fixed[:, : first.shape[1]] = first
        self.fixed[:, count - REST :] = last[:, None]
        self.matrix = csr_array(kron(many, curve[:, self.free]))
        self.resting: Array = (curve @ self.fixed.T).T.ravel()


def _first_coefficients(course: Course, shared: Splines, origin: Array) -> Array:
    """Initial spline coefficients, (agents * dim, coefficients), metres from each origin: at rest, or in motion.

    Args:
        origin: (agents, dim), metres.
    """
    if course.begin is None:
        return np.zeros((origin.size, REST))
    points = (course.begin - origin[..., None]).reshape(origin.size, -1)
    size = points.shape[1]
    return np.asarray(np.linalg.solve(shared.whole[:size, :size].toarray(), points.T).T)


def begins_with(state: Array, duration: float) -> Array:
    """First control points of a piece that begins in a given state: (dim, 5), metres.

    Args:
        state: (5, dim): the position and its derivatives by seconds up to the fourth.
        duration: duration of the piece, seconds.
    """
    powers = [each / factorial(order) * duration**order for order, each in enumerate(state)]
    points = [
        sum(comb(index, order) / comb(DEGREE, order) * powers[order] for order in range(index + 1))
        for index in range(len(state))
    ]
    return np.stack(points, axis=-1)


def _legs(course: Course) -> csr_array:
    """Matrix from the control points of the pieces to the control points of every leg.

    Shape: (legs * 8, pieces * 8), dimensionless weights.
    """
    piece_of = np.cumsum(course.knot[:-1]) - 1
    knots = course.times[course.knot]
    begin, lasting = knots[piece_of], np.diff(knots)[piece_of]
    low, high = (course.times[:-1] - begin) / lasting, (course.times[1:] - begin) / lasting
    blocks = [part_of(*shares) for shares in zip(low.tolist(), np.minimum(high, 1.0).tolist(), strict=True)]
    legs, size = piece_of.size, DEGREE + 1
    row = np.broadcast_to(np.arange(legs * size).reshape(legs, size, 1), (legs, size, size))
    column = np.broadcast_to((piece_of * size)[:, None, None] + np.arange(size), (legs, size, size))
    shape = (legs * size, (knots.size - 1) * size)
    return csr_array(coo_array((np.stack(blocks).ravel(), (row.ravel(), column.ravel())), shape=shape))


def _world(rows: Rows, index: Array, course: Course, origin: Array, low: Array, high: Array) -> None:
    """Add bounds that keep control points within the world where a tube extends beyond it.

    Args:
        low, high: corners of the world, (dim,), metres.
    """
    reach = course.radius[..., None]
    low, high = (np.broadcast_to(side, course.start.shape) for side in (low, high))
    beyond = (np.minimum(course.start, course.end) - reach < low) | (
        np.maximum(course.start, course.end) + reach > high
    )
    agent, leg, axis = np.nonzero(beyond)
    agent, leg, axis, point = (np.repeat(each, DEGREE + 1) for each in (agent, leg, axis, axis))
    point = np.tile(np.arange(DEGREE + 1), agent.size // (DEGREE + 1))
    rows.add(
        index[agent, leg, axis, point][:, None],
        np.ones(1),
        (low - SAFE / 10)[agent, leg, axis] - origin[agent, axis],
        (high + SAFE / 10)[agent, leg, axis] - origin[agent, axis],
        leg,
    )


def _tubes(rows: Rows, index: Array, course: Course, origin: Array) -> None:
    """Add bounds that keep each leg's control points in a box inside the tube, in the frame of its segment.

    Args:
        origin: (agents, dim), metres.
    """
    dim = origin.shape[-1]
    along = course.end - course.start
    length = np.linalg.norm(along, axis=-1)
    frame = _frames(along, length)
    # The box extends past the segment's ends as far as beside it, with its corners just inside the tube.
    spare = np.maximum(course.radius - course.safe, course.radius / 2) / sqrt(dim)
    columns = np.moveaxis(index, 3, 2)
    start = course.start - origin[:, None]
    leg, point = np.nonzero(_loose(course.pinned))
    for axis in range(dim):
        direction = frame[:, :, axis]
        base = (direction * start).sum(axis=-1)
        far = length if axis == 0 else np.zeros_like(length)
        rows.add(
            columns[:, leg, point].reshape(-1, dim),
            direction[:, leg].reshape(-1, dim),
            (base - spare)[:, leg].ravel(),
            (base + far + spare)[:, leg].ravel(),
            np.tile(leg, len(origin)),
        )


def _waypoints(rows: Rows, index: Array, course: Course, origin: Array) -> None:
    """Add bounds on the positions at steps that the trajectory need not pass exactly.

    Args:
        origin: (agents, dim), metres.
    """
    dim = origin.shape[-1]
    inner = np.flatnonzero(course.fixed & ~course.pinned)
    if not inner.size:
        return
    spare = max(course.slack - course.safe, course.slack / 2) / sqrt(dim)
    target = course.joint[:, inner] - origin[:, None]
    leg = np.broadcast_to(inner[:, None], target.shape)
    rows.add(
        index[..., 0][:, inner].reshape(-1, 1),
        np.ones(1),
        (target - spare).ravel(),
        (target + spare).ravel(),
        leg.ravel(),
    )


def _keep(rows: Rows, cut: Cut, course: Course) -> None:
    """Add the bound of a cut; all cuts share the excess of the first leg, so that the largest violation is
    minimised.
    """
    dim, size = cut.weight.shape
    pieces = int(course.knot.sum()) - 1
    first = ((cut.agent * dim + np.arange(dim)[:, None]) * pieces + cut.piece) * size + np.arange(size)
    none = np.full(1, -np.inf)
    rows.add(first.reshape(1, -1), cut.weight.reshape(1, -1), none, np.ones(1), np.zeros(1, dtype=np.int64))


def _loose(pinned: Flags) -> Flags:
    """Flags of the control points that are not fixed to a step's planned position: (legs, 8)."""
    loose = np.ones((pinned.size - 1, DEGREE + 1), dtype=bool)
    loose[:, 0], loose[:, DEGREE] = ~pinned[:-1], ~pinned[1:]
    return loose


def _frames(along: Array, length: Array) -> Array:
    """Orthonormal frames whose first direction is along the segment: (..., axis, dim).

    Args:
        along: segment vectors, (..., dim), metres.
        length: their lengths, (...), metres.
    """
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


def _hold(rows: Rows, index: Array, plane: Plane, pinned: Flags, origin: Array) -> None:
    """Add the bounds of a plane on the control points of its part of the leg, except those at exact positions.

    Args:
        origin: (agents, dim), metres.
    """
    offset = plane.offset - plane.normal @ origin[plane.first]
    columns, weight = [index[plane.first, plane.leg]], [plane.normal]
    if plane.second != plane.first:
        offset = offset + plane.normal @ origin[plane.second]
        columns, weight = [*columns, index[plane.second, plane.leg]], [plane.normal, -plane.normal]
    loose = np.ones(DEGREE + 1, dtype=bool)
    loose[0] = plane.part[0] > 0 or not pinned[plane.leg]
    loose[DEGREE] = plane.part[1] < 1 or not pinned[plane.leg + 1]
    part = part_of(*plane.part)[loose]
    count = len(part)
    column = np.concatenate([each.reshape(-1) for each in columns])
    value = np.concatenate([(each[:, None] * part[:, None, :]).reshape(count, -1) for each in weight], axis=-1)
    rows.add(
        np.broadcast_to(column, (count, column.size)),
        value,
        offset[loose],
        np.full(count, np.inf),
        np.array(plane.leg),
    )
