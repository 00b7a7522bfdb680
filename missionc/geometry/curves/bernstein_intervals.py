"""Polynomials in Bernstein form in double precision, with a bound on every rounding error.

A polynomial over an interval lies in the convex hull of its control points. The stored points are doubles; ``radius``
bounds their distance from the exact points. Every conclusion from points and radius therefore holds for the exact
curve.

A sum of ``k`` products, in any order, has an error below ``k * ROUNDING`` times the sum of their magnitudes. This is
twice the necessary bound, so that the bound may itself be computed in doubles.

Source:
    Farin, "Curves and Surfaces for CAGD" (2002), chapters 4 and 5. Higham, "Accuracy and Stability of Numerical
    Algorithms" (2002), section 3.1.
"""

from __future__ import annotations

from functools import cache
from math import comb
from typing import Any

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array

ROUNDING = 2.0**-52
"""Twice the maximum relative error of one operation on doubles."""

TINY = 2.0**-900
"""Bound on underflow errors, for numbers initially below 2**150."""

GROWN = 1.0 + 2.0**-48
"""Factor that keeps a bound valid despite the rounding errors of the few operations that compute it."""


class Enclosed(Record, eq=False):
    """Polynomials over [0, 1] in Bernstein form, with bounds on their errors.

    Args:
        points: Bernstein control points, (..., degree + 1).
        radius: bound on the distance of each control point from the exact point, (...); infinite if unknown.
    """

    points: Array
    radius: Array

    @property
    def degree(self) -> int:
        return int(self.points.shape[-1]) - 1

    def __getitem__(self, index: Any) -> Enclosed:
        """Select polynomials by an index into all axes except the last."""
        return Enclosed(self.points[index], self.radius[index])

    def __sub__(self, other: Enclosed) -> Enclosed:
        """Difference of two polynomials of the same degree."""
        points = self.points - other.points
        return _counted(points, self.radius + other.radius, ROUNDING * _largest(points))

    def moved(self, by: Array) -> Enclosed:
        """Polynomials plus constants ``by``, in the unit of the points; broadcasts to the shape of ``radius``."""
        points = self.points + np.asarray(by)[..., None]
        return _counted(points, self.radius, ROUNDING * _largest(points))

    def scaled(self, by: Array | float) -> Enclosed:
        """Polynomials times dimensionless factors ``by``, which broadcast to the shape of ``radius``."""
        factor = np.asarray(by, dtype=np.float64)
        points = self.points * factor[..., None]
        return _counted(points, self.radius * np.abs(factor), ROUNDING * _largest(points))

    def elevated(self, degree: int) -> Enclosed:
        """Same polynomials with the control points of a higher degree."""
        own = self.degree
        change = np.array(
            [
                [comb(own, i) * comb(degree - own, k - i) / comb(degree, k) if k >= i else 0.0 for i in range(own + 1)]
                for k in range(degree + 1)
            ]
        )
        return _counted(_times(self.points, change), self.radius, (own + 3) * ROUNDING * _largest(self.points))

    def halves(self) -> tuple[Enclosed, Enclosed]:
        """Polynomials restricted to the first and to the second half, each reparametrised to [0, 1]."""
        first = _halving(self.degree)
        spent = (self.degree + 2) * ROUNDING * _largest(self.points)
        halves = (_times(self.points, change) for change in (first, first[::-1, ::-1]))
        before, after = (_counted(points, self.radius, spent) for points in halves)
        return before, after

    def split(self, share: Array) -> tuple[Enclosed, Enclosed]:
        """Polynomials restricted to the parts before and after the parameter ``share``, each reparametrised to [0, 1].

        ``share`` is dimensionless and broadcasts to the shape of ``radius``.
        """
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
        """Sums of the squared polynomials over the last axis of ``radius``, at twice the degree: (..., dim) ->
        (...)."""
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
        """Values at the parameter 1/2, as constant polynomials."""
        points = self.points @ (_binomials(self.degree) / 2.0**self.degree)
        return _counted(points[..., None], self.radius, (self.degree + 2) * ROUNDING * _largest(self.points))

    def ends(self) -> Enclosed:
        """Values at the parameters 0 and 1, as two control points each, which do not form a polynomial."""
        return Enclosed(self.points[..., [0, -1]], self.radius)

    def low(self) -> Array:
        """Lower bounds of the polynomials' values: (...), in the unit of the points."""
        return lowered(self.points.min(axis=-1) - self.radius)

    def high(self) -> Array:
        """Upper bounds of the polynomials' values: (...), in the unit of the points."""
        return raised(self.points.max(axis=-1) + self.radius)


def from_powers(coefficients: Array, duration: Array) -> Enclosed:
    """Bernstein form, with error bounds, of polynomials of time over [0, duration].

    Args:
        coefficients: coefficients of ascending powers of seconds, (..., degree + 1); exact numbers below 2**150.
        duration: exact durations, seconds; broadcasts to the other axes.
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
    """Coefficients of the time derivative of polynomials in seconds.

    Shape: (..., degree + 1), ascending powers -> (..., degree).

    Float32 coefficients may be differentiated three times without rounding errors, since the products fit into a
    double.
    """
    return coefficients[..., 1:] * np.arange(1, coefficients.shape[-1])


def lowered(bound: Array) -> Array:
    """Lower bounds, (...), any unit, reduced by the rounding error of one operation; -inf for NaN."""
    return np.where(np.isnan(bound), -np.inf, np.nextafter(bound, -np.inf))


def raised(bound: Array) -> Array:
    """Upper bounds, (...), any unit, increased by the rounding error of one operation; inf for NaN."""
    return np.where(np.isnan(bound), np.inf, np.nextafter(bound, np.inf))


def root_below(square: Array) -> Array:
    """Lower bound of a square root from a lower bound of the square: (...) -> (...), any unit."""
    return np.maximum(lowered(np.sqrt(np.maximum(square, 0.0))), 0.0)


def root_above(square: Array) -> Array:
    """Upper bound of a square root from an upper bound of the square: (...) -> (...), any unit."""
    return raised(np.sqrt(np.maximum(square, 0.0)))


def _counted(points: Array, radius: Array, spent: Array) -> Enclosed:
    """Polynomials with the rounding error ``spent`` of an operation added to their radius; the radius is infinite after
    an overflow.

    Shape: points (..., degree + 1), radius and error (...), in one unit.
    """
    total = (radius + spent) * GROWN + TINY
    known = np.isfinite(points).all(axis=-1) & np.isfinite(total)
    if known.all():
        return Enclosed(points, np.array(np.broadcast_to(total, points.shape[:-1])))
    return Enclosed(np.where(known[..., None], points, 0.0), np.where(known, total, np.inf))


def _largest(points: Array) -> Array:
    return np.asarray(np.abs(points).max(axis=-1))


def _times(points: Array, change: Array) -> Array:
    """Rows of control points, (..., degree + 1), each multiplied by one dimensionless matrix."""
    return np.asarray((points.reshape(-1, points.shape[-1]) @ change.T).reshape(*points.shape[:-1], len(change)))


@cache
def _binomials(degree: int) -> Array:
    return np.array([comb(degree, index) for index in range(degree + 1)], dtype=np.float64)


@cache
def _halving(degree: int) -> Array:
    """Matrix from the control points of a polynomial to the control points of its first half: (degree + 1, degree + 1),
    exact numbers."""
    return np.array([[comb(i, j) / 2.0**i for j in range(degree + 1)] for i in range(degree + 1)])
