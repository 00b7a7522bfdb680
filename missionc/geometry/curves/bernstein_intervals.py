"""Polynomials in Bernstein form, in doubles, with every rounding error bounded.

A polynomial over an interval lies in the hull of its control points, and so do its halves. The points are doubles;
``radius`` bounds their distance from the true ones. Every conclusion from points and radius therefore holds for the
true curve.

A sum of ``k`` products, in any order, has an error below ``k * ROUNDING`` times the sum of their magnitudes. This is
twice the necessary bound, so that the bound may itself be computed in doubles.

Source:
    Farin, "Curves and Surfaces for CAGD" (2002), chapters 4 and 5.
    Higham, "Accuracy and Stability of Numerical Algorithms" (2002), section 3.1.
"""

from __future__ import annotations

from functools import cache
from math import comb
from typing import Any

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array

ROUNDING = 2.0**-52
"""Twice the relative error of one operation on doubles."""

TINY = 2.0**-900
"""Bound on the error of underflow, for numbers initially below 2**150."""

GROWN = 1.0 + 2.0**-48
"""Factor that makes a bound valid in spite of rounding in a few operations."""


class Enclosed(Record, eq=False):
    """Polynomials of a share from 0 to 1, with error bounds.

    Args:
        points: (..., degree + 1): Bernstein control points.
        radius: (...): bound on the distance of each true control point; infinite if unknown.
    """

    points: Array
    radius: Array

    @property
    def degree(self) -> int:
        return int(self.points.shape[-1]) - 1

    def __getitem__(self, index: Any) -> Enclosed:
        """Select polynomials by an index of all axes except the last."""
        return Enclosed(self.points[index], self.radius[index])

    def __sub__(self, other: Enclosed) -> Enclosed:
        """Difference of two polynomials of the same degree."""
        points = self.points - other.points
        return _counted(points, self.radius + other.radius, ROUNDING * _largest(points))

    def moved(self, by: Array) -> Enclosed:
        """Sum with numbers of the shape of ``radius``, or broadcast to it, in the unit of the points."""
        points = self.points + np.asarray(by)[..., None]
        return _counted(points, self.radius, ROUNDING * _largest(points))

    def scaled(self, by: Array | float) -> Enclosed:
        """Product with dimensionless numbers of the shape of ``radius``, or broadcast to it."""
        factor = np.asarray(by, dtype=np.float64)
        points = self.points * factor[..., None]
        return _counted(points, self.radius * np.abs(factor), ROUNDING * _largest(points))

    def elevated(self, degree: int) -> Enclosed:
        """The same polynomials with the control points of a higher degree."""
        own = self.degree
        change = np.array(
            [
                [comb(own, i) * comb(degree - own, k - i) / comb(degree, k) if k >= i else 0.0 for i in range(own + 1)]
                for k in range(degree + 1)
            ]
        )
        return _counted(_times(self.points, change), self.radius, (own + 3) * ROUNDING * _largest(self.points))

    def halves(self) -> tuple[Enclosed, Enclosed]:
        """Polynomials over the first and the second half, each again over [0, 1]."""
        first = _halving(self.degree)
        spent = (self.degree + 2) * ROUNDING * _largest(self.points)
        halves = (_times(self.points, change) for change in (first, first[::-1, ::-1]))
        before, after = (_counted(points, self.radius, spent) for points in halves)
        return before, after

    def split(self, share: Array) -> tuple[Enclosed, Enclosed]:
        """Polynomials before and after a dimensionless share, which has the shape of ``radius`` or broadcasts to it."""
        weight = np.asarray(share)[..., None]
        level, first, last = self.points, [self.points[..., 0]], [self.points[..., -1]]
        for _ in range(self.degree):
            level = (1.0 - weight) * level[..., :-1] + weight * level[..., 1:]
            first.append(level[..., 0])
            last.append(level[..., -1])
        spent = 4 * self.degree * ROUNDING * _largest(self.points)
        before = _counted(np.stack(first, axis=-1), self.radius, spent)
        return before, _counted(np.stack(last[::-1], axis=-1), self.radius, spent)

    def squares(self) -> Enclosed:
        """Sum of the squares over the last axis of ``radius``, at twice the degree: (..., dim) -> (...)."""
        degree = self.degree
        weighted = self.points * _binomials(degree)
        product = np.zeros((*self.points.shape[:-1], 2 * degree + 1))
        for index in range(degree + 1):
            product[..., index : index + degree + 1] += weighted[..., index : index + 1] * weighted
        points = product.sum(axis=-2) / _binomials(2 * degree)
        largest = _largest(self.points)
        # The weights of the products add up to one, so the mean has the same error bound as the points.
        off = (2 * largest + self.radius) * self.radius
        spent = (degree + self.points.shape[-2] + 6) * ROUNDING * (largest**2).sum(axis=-1)
        return _counted(points, off.sum(axis=-1), spent)

    def middle(self) -> Enclosed:
        """Values at the middle, as constants: one control point each."""
        points = self.points @ (_binomials(self.degree) / 2.0**self.degree)
        return _counted(points[..., None], self.radius, (self.degree + 2) * ROUNDING * _largest(self.points))

    def ends(self) -> Enclosed:
        """Values at 0 and at 1: two control points each, which form no polynomial together."""
        return Enclosed(self.points[..., [0, -1]], self.radius)

    def low(self) -> Array:
        """Lower bound of the polynomial's values: (...), in the unit of the points."""
        return lowered(self.points.min(axis=-1) - self.radius)

    def high(self) -> Array:
        """Upper bound of the polynomial's values: (...), in the unit of the points."""
        return raised(self.points.max(axis=-1) + self.radius)


def from_powers(coefficients: Array, duration: Array) -> Enclosed:
    """Enclose polynomials of seconds over [0, duration].

    Args:
        coefficients: (..., degree + 1), ascending powers, exact numbers below 2**150.
        duration: shape of the other axes, or broadcast to it; exact, seconds.
    """
    degree = coefficients.shape[-1] - 1
    change = np.array([[comb(i, j) / comb(degree, j) for j in range(degree + 1)] for i in range(degree + 1)])
    with np.errstate(over="ignore", invalid="ignore"):
        power = np.cumprod(np.broadcast_to(np.asarray(duration)[..., None], coefficients.shape), axis=-1)
        terms = coefficients.copy()
        terms[..., 1:] *= power[..., :-1]
        spent = (2 * degree + 4) * ROUNDING * np.abs(terms).sum(axis=-1)
        return _counted(_times(terms, change), np.zeros(terms.shape[:-1]), spent)


def derivative(coefficients: Array) -> Array:
    """Coefficients of the derivative by time in seconds.

    Shape: (..., degree + 1), ascending powers -> (..., degree).

    Float32 coefficients may be differentiated three times exactly: the products fit into a double.
    """
    return coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])


def lowered(bound: Array) -> Array:
    """Lower bound, (...), any unit, corrected for the rounding of one operation; -inf for NaN."""
    return np.where(np.isnan(bound), -np.inf, np.nextafter(bound, -np.inf))


def raised(bound: Array) -> Array:
    """Upper bound, (...), any unit, corrected for the rounding of one operation; inf for NaN."""
    return np.where(np.isnan(bound), np.inf, np.nextafter(bound, np.inf))


def root_below(square: Array) -> Array:
    """Lower bound of the root from a lower bound of the square, any unit: (...) -> (...)."""
    return np.maximum(lowered(np.sqrt(np.maximum(square, 0.0))), 0.0)


def root_above(square: Array) -> Array:
    """Upper bound of the root from an upper bound of the square, any unit: (...) -> (...)."""
    return raised(np.sqrt(np.maximum(square, 0.0)))


def _counted(points: Array, radius: Array, spent: Array) -> Enclosed:
    """Polynomials with the error of an operation added to the radius; unknown after an overflow.

    Points are (..., degree + 1), radius and error (...), in the same unit.
    """
    total = (radius + spent) * GROWN + TINY
    known = np.isfinite(points).all(axis=-1) & np.isfinite(total)
    if known.all():
        return Enclosed(points, np.array(np.broadcast_to(total, points.shape[:-1])))
    return Enclosed(np.where(known[..., None], points, 0.0), np.where(known, total, np.inf))


def _largest(points: Array) -> Array:
    return np.asarray(np.abs(points).max(axis=-1))


def _times(points: Array, change: Array) -> Array:
    """Multiply each row of control points, (..., degree + 1), by a dimensionless matrix, all rows at once."""
    return np.asarray((points.reshape(-1, points.shape[-1]) @ change.T).reshape(*points.shape[:-1], len(change)))


@cache
def _binomials(degree: int) -> Array:
    return np.array([comb(degree, index) for index in range(degree + 1)], dtype=np.float64)


@cache
def _halving(degree: int) -> Array:
    """Matrix from control points to those of the first half.

    Shape: (degree + 1, degree + 1), exact dyadic numbers.
    """
    return np.array([[comb(i, j) / 2.0**i for j in range(degree + 1)] for i in range(degree + 1)])
