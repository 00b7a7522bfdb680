"""The pieces of a spline: they join smoothly, and what is said of their control points is so."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from missionc.geometry.curves.smooth_splines import DEGREE, coefficients, control_points_of, effort, part_of

durations = st.lists(st.floats(0.05, 2.0), min_size=2, max_size=6).map(np.array)
seeds = st.integers(0, 2**32 - 1)


@given(durations, seeds)
def test_pieces_of_any_length_join_with_four_continuous_derivatives(lengths: np.ndarray, seed: int) -> None:
    times = np.concatenate([[0.0], np.cumsum(lengths)])
    count = coefficients(lengths.size)
    points = (control_points_of(times) @ np.random.default_rng(seed).normal(size=count)).reshape(-1, DEGREE + 1)
    for order in range(5):
        slope = np.diff(points, n=order, axis=-1) / lengths[:, None] ** order
        size = max(1.0, float(np.abs(slope).max()))
        assert slope[:-1, -1] == pytest.approx(slope[1:, 0], abs=1e-7 * size)


@given(durations)
def test_a_piece_is_made_of_averages_of_coefficients(lengths: np.ndarray) -> None:
    matrix = control_points_of(np.concatenate([[0.0], np.cumsum(lengths)]))
    assert matrix.shape == (8 * lengths.size, coefficients(lengths.size))
    assert matrix.min() >= 0.0
    assert matrix.sum(axis=1) == pytest.approx(np.ones(8 * lengths.size))
    assert np.diff(matrix.indptr).max() <= 8


@given(st.floats(0, 0.9), st.floats(0.05, 1), seeds)
def test_a_part_of_a_curve_is_the_curve_there(low: float, length: float, seed: int) -> None:
    high = min(1.0, low + length)
    points = np.random.default_rng(seed).normal(size=DEGREE + 1)
    whole, part = (BPoly(each[:, None], [0.0, 1.0]) for each in (points, part_of(low, high) @ points))
    share = np.linspace(0.0, 1.0, 9)
    assert part(share) == pytest.approx(whole(low + share * (high - low)), abs=1e-9)


@given(durations, st.integers(1, 4), seeds)
def test_the_effort_is_the_integral_of_the_squared_derivative(lengths: np.ndarray, order: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    for length, form in zip(lengths, effort(order, lengths), strict=True):
        points = generator.normal(size=DEGREE + 1)
        slope = BPoly(points[:, None], [0.0, length]).derivative(order)
        # Gauss-Legendre with 8 places is exact for these degrees.
        place, weight = np.polynomial.legendre.leggauss(8)
        integral = float((weight * slope((place + 1) / 2 * length) ** 2).sum()) * length / 2
        assert points @ form @ points == pytest.approx(integral, rel=1e-6)
