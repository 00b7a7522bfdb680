"""Dual numbers against central differences, and at kinks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from missionc.backends.clot.optimise.dual_numbers import Dual, variables
from missionc.base.trace import Array
from missionc.ir import Ball, Box, Disc, Polygon, Shape, Union
from missionc.ir.distances.line_of_sight import clear_line
from missionc.ir.distances.signed_distance import signed_distance

SHAPES: list[Shape] = [
    Box((-1.0, 0.0), (0.5, 2.0)),
    Disc((0.3, 0.2), 0.7),
    Ball((0.1, -0.4), 0.5),
    Union(Box((-1.0, 0.0), (0.5, 2.0)), Polygon(((0.0, 0.0), (2.0, 0.1), (1.0, 1.5)))),
]

FUNCTIONS: dict[str, Callable[[Any, Any], Any]] = {
    "arithmetic": lambda one, other: (2.0 - one[:, 0]) * other[:, 1] / (3.0 + one[:, 1] ** 2) - (-other[:, 0] + 1.0),
    "roots": lambda one, other: np.sqrt(((one - other) ** 2).sum(axis=1)) + np.abs(one[:, 0]),
    "bounds": lambda one, other: np.minimum(np.maximum(one, other), 0.3)[:, 0] + np.clip(other[:, 1], -0.5, 0.5),
    "choices": lambda one, other: np.where(one[:, 0] < other[:, 0], one[:, 1] * 2.0, 1.0),
    "angles": lambda one, other: np.arctan2(one[:, 1], other[:, 0]),
    "arrays": lambda one, other: (np.stack([one, 2.0 * other], axis=1) * np.ones((2, 1))).sum(axis=1)[..., 1],
    "pairs of rows": lambda one, other: (one[:, None] * other[:, :, None] - other[:, 1, None, None]).sum(axis=2)[:, 1],
    "lines of sight": lambda one, other: clear_line(np, SHAPES[:2], one, other, 9.0 + one[:, 0]),
    **{
        f"distance {number}": lambda one, other, shape=shape: signed_distance(np, shape, one)
        for number, shape in enumerate(SHAPES)
    },
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_derivatives_are_those_of_differences(name: str) -> None:
    tiny = 1e-6
    points = np.random.default_rng(3).uniform(-2, 2, (2, 40, 2))
    found = FUNCTIONS[name](*variables(list(points)))
    assert np.allclose(found.value, FUNCTIONS[name](*points), rtol=0, atol=1e-12)
    assert found.partials.shape == (4, 40)
    for number in range(2):
        for axis in range(2):
            moved = np.zeros((2, 1, 2))
            moved[number, :, axis] = tiny
            slope = (FUNCTIONS[name](*(points + moved)) - FUNCTIONS[name](*(points - moved))) / (2 * tiny)
            assert np.allclose(found.partials[2 * number + axis], slope, atol=1e-5)


def test_derivatives_at_kinks_are_finite() -> None:
    (point,) = variables([np.zeros((1, 2))])
    x, y = point[:, 0], point[:, 1]
    kinks = [np.sqrt(x * x + y * y), abs(x), np.maximum(x, y), np.minimum(x, y), np.arctan2(x, y), np.clip(x, 0.0, 1.0)]
    for kink in kinks:
        assert np.isfinite(kink.partials).all()
        assert np.abs(kink.partials).sum() <= 1.0


def test_a_part_is_replaced_without_changing_where_it_came_from() -> None:
    point: Any = variables([np.ones((3, 2))])[0]
    whole = point[:, 0] + 0.0
    some = np.array([True, False, True])
    whole[some] = 5.0 * point[some, 1]
    assert whole.value.tolist() == [5.0, 1.0, 5.0]
    assert whole.partials.T.tolist() == [[0.0, 5.0], [1.0, 0.0], [0.0, 5.0]]
    assert point[:, 0].partials.T.tolist() == [[1.0, 0.0]] * 3


def test_a_function_without_a_rule_is_an_error() -> None:
    point: Any = variables([np.ones((3, 2))])[0]
    with pytest.raises(TypeError):
        np.exp(point)
    with pytest.raises(TypeError):
        np.median(point)


def test_a_gradient_given_by_a_caller_is_chained() -> None:
    def squared(point: Dual) -> Any:
        square: Array = (point.value**2).sum(axis=1)
        return (2.0 * point).through(4.0 * square, 4.0 * point.value)

    points = np.random.default_rng(1).uniform(-1, 1, (5, 2))
    assert np.allclose(squared(variables([points])[0]).partials.T, 8.0 * points)
