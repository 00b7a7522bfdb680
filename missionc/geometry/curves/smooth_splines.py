"""Smooth splines: B-splines of degree 7 with four continuous derivatives, by their Bernstein control points.

A B-spline with threefold inner knots has four continuous derivatives at every joint, for any durations of the pieces.
Its coefficients are free; each piece's control points are averages of eight coefficients.

Source:
    Farin, "Curves and Surfaces for CAGD" (2002), chapters 4, 5 and 8.
"""

from __future__ import annotations

from math import comb

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import coo_array, csr_array

from missionc.base.trace import Array

DEGREE = 7
JOIN = 4
"""Number of continuous derivatives at the joints of the spline."""


def coefficients(pieces: int) -> int:
    """Number of B-spline coefficients of a spline with ``pieces`` pieces."""
    return DEGREE + 1 + (DEGREE - JOIN) * (pieces - 1)


def control_points_of(times: Array) -> csr_array:
    """Matrix from B-spline coefficients to the Bernstein control points of all pieces.

    Shape: (pieces * 8, coefficients), dimensionless.

    Args:
        times: joints of the spline, (pieces + 1,), seconds.
    """
    knots = np.concatenate(
        [np.repeat(times[:1], DEGREE + 1), np.repeat(times[1:-1], DEGREE - JOIN), np.repeat(times[-1:], DEGREE + 1)]
    )
    # A piece is determined by its values at eight places in it.
    share = (1 - np.cos((2 * np.arange(DEGREE + 1) + 1) * np.pi / (2 * DEGREE + 2))) / 2
    pieces = times.size - 1
    where = (times[:-1, None] + share * np.diff(times)[:, None]).ravel()
    sampled = BSpline.design_matrix(where, knots, DEGREE).data.reshape(pieces, DEGREE + 1, DEGREE + 1)
    points = np.linalg.solve(bernstein(share), sampled)
    # They are not negative; negative values are rounding.
    points[points < 1e-13] = 0.0
    points /= points.sum(axis=-1, keepdims=True)
    row = np.arange(pieces * (DEGREE + 1)).reshape(pieces, DEGREE + 1, 1)
    column = ((DEGREE - JOIN) * np.arange(pieces))[:, None, None] + np.arange(DEGREE + 1)
    index = tuple(np.broadcast_to(each, points.shape).ravel() for each in (row, column))
    matrix = csr_array(coo_array((points.ravel(), index), shape=(row.size, coefficients(pieces))))
    matrix.eliminate_zeros()
    return matrix


def effort(order: int, durations: Array) -> Array:
    """Quadratic forms of each piece's control points for the integral of the squared derivative of an order.

    Shape: durations (pieces,), seconds -> (pieces, 8, 8), s^(1 - 2 order).
    """
    left = DEGREE - order
    difference = np.diff(np.eye(DEGREE + 1), n=order, axis=0) * (np.prod(np.arange(left + 1, DEGREE + 1)))
    gram = np.array(
        [
            [comb(left, i) * comb(left, j) / (comb(2 * left, i + j) * (2 * left + 1)) for j in range(left + 1)]
            for i in range(left + 1)
        ]
    )
    form: Array = difference.T @ gram @ difference
    return np.asarray(form * (durations ** (1 - 2 * order))[:, None, None])


def part_of(low: float, high: float) -> Array:
    """Matrix from a piece's control points to the control points of its part between the parameters ``low`` and
    ``high`` in [0, 1].

    Shape: (8, 8), dimensionless weights.
    """
    share = (high - low) / (1 - low)
    after = np.array([[_split(DEGREE - i, j - i, low) for j in range(DEGREE + 1)] for i in range(DEGREE + 1)])
    before = np.array([[_split(i, j, share) for j in range(DEGREE + 1)] for i in range(DEGREE + 1)])
    return np.asarray(before @ after)


def bernstein(share: Array) -> Array:
    """Matrix from a piece's control points to its values at the parameters ``share`` in [0, 1]: (shares, 8),
    dimensionless."""
    return np.array([[_split(DEGREE, i, u) for i in range(DEGREE + 1)] for u in share.tolist()])


def rounded(points: Array, durations: Array) -> Array:
    """Power coefficients of pieces with given control points, rounded to float32.

    Shape: (..., pieces, dim, 8), metres, and durations (pieces,), seconds -> (..., pieces, dim, 8), ascending powers of
    seconds.
    """
    difference = points
    columns = []
    for power in range(DEGREE + 1):
        columns.append(difference[..., 0] * comb(7, power) / (durations**power)[:, None])
        difference = np.diff(difference, axis=-1)
    return np.stack(columns, axis=-1).astype(np.float32).astype(np.float64)


def _split(degree: int, index: int, share: float) -> float:
    return comb(degree, index) * share**index * (1 - share) ** (degree - index) if 0 <= index <= degree else 0.0
