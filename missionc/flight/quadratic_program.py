"""Convex quadratic programs over the numbers of splines, with soft bounds where not all can be kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import piqp
from scipy.sparse import block_array, block_diag, coo_array, csc_matrix, csr_array, hstack

from missionc.base.trace import Array
from missionc.curves.piecewise_polynomials import Indices

PENALTY = 1e5
"""The penalty of a metre beyond a bound, where not all bounds can be kept, in units of effort."""


@dataclass(frozen=True, slots=True)
class NoFit:
    """The solver found no solution."""

    status: str


class Rows:
    """Bounds on weighted sums of control points, in the order they come; each belongs to a leg."""

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
        """(rows, entries) twice, (rows,) three times."""
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
        """The same of the free coefficients; rows that are free of them are left out.

        Args:
            spread: (columns, coefficients): what each of them adds to the control points.
            resting: (columns,), metres: the control points where all of them are 0.
        """
        if not self.count:
            return Bounds(csr_array((0, spread.shape[1])), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
        matrix = self.matrix()
        weight, here = csr_array(matrix @ spread), matrix @ resting
        free = np.diff(weight.indptr) > 0
        low, high = np.concatenate(self.low) - here, np.concatenate(self.high) - here
        return Bounds(weight[free], low[free], high[free], np.concatenate(self.leg)[free])


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """``low <= weight @ numbers <= high``; each row belongs to a ``leg``."""

    weight: csr_array
    low: Array
    high: Array
    leg: Indices


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """The numbers; by how much they exceed bounds: (legs,); and how many groups of bounds all are kept."""

    numbers: Array
    excess: Array
    kept: int


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """``numbers @ quadratic @ numbers / 2 + linear @ numbers``, to be least where ``pins @ numbers == target``.

    ``bounds`` come in groups; where not all can be kept, the last ones are the first to be exceeded.
    """

    quadratic: csr_array
    linear: Array
    pins: csr_array
    target: Array
    bounds: tuple[Bounds, ...]

    def within(self, legs: int, most: int | None = None) -> Solution | NoFit:
        """The least, with as many groups of bounds kept as can be: at ``most`` so many, if more are known to fail."""
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
        """``loose`` bounds may be exceeded, each leg's by an excess of its own that is dear."""
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
