"""Dual numbers: arrays with their exact partial derivatives, by forward-mode automatic differentiation.

A residual reads few points, so that its value and its few derivatives are computed together. numpy's functions accept
dual numbers like arrays; a function without a rule here is an error. Conditions see the values only. At a kink, the
derivative is finite and that of one side: at equal arguments that of the first, and 0 for a root at 0.

Source:
    Griewank and Walther, "Evaluating Derivatives", 2nd edition, 3.1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from missionc.base.trace import Array

Values: TypeAlias = Any
"""An array, a dual number, or a number: what numpy's functions accept."""


class Dual(NDArrayOperatorsMixin):
    """An array of values, (...), with the partial derivatives of each, (variables, ...)."""

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, value: Array, partials: Array) -> None:
        self.value, self.partials = value, partials

    @property
    def shape(self) -> tuple[int, ...]:
        return self.value.shape

    def detach(self) -> Array:
        """The values, (...), without derivatives."""
        return self.value

    def through(self, value: Array, slope: Array) -> Dual:
        """A function of these points, (rows, dim), with its value, (rows,), and gradient by the point, (rows, dim)."""
        return Dual(value, np.einsum("vrd,rd->vr", self.partials, slope))

    def sum(self, axis: int) -> Dual:
        return Dual(self.value.sum(axis=axis), self.partials.sum(axis=axis + 1 if axis >= 0 else axis))

    def __getitem__(self, key: Any) -> Dual:
        return Dual(self.value[key], self.partials[_of_each(key)])

    def __setitem__(self, key: Any, new: Dual) -> None:
        self.value, self.partials = self.value.copy(), self.partials.copy()
        self.value[key], self.partials[_of_each(key)] = new.value, new.partials

    def __array_ufunc__(self, function: np.ufunc, method: str, *inputs: Values, **options: Any) -> Any:
        values = [each.value if isinstance(each, Dual) else each for each in inputs]
        if function in CONDITIONS:
            return function(*values)
        if method != "__call__" or options or function not in SLOPES:
            return NotImplemented
        value = function(*values)
        chained = None
        for each, slope in zip(inputs, SLOPES[function](value, *values), strict=True):
            if isinstance(each, Dual):
                term = each.partials if each.value.ndim == value.ndim else _partials(each, value.ndim)
                term = term if slope is None else slope * term
                chained = term if chained is None else chained + term
        return _full(value, chained)

    def __array_function__(self, function: Any, types: Any, inputs: Any, options: Any) -> Any:
        return FUNCTIONS[function](*inputs, **options) if function in FUNCTIONS else NotImplemented


def variables(points: Sequence[Array]) -> list[Dual]:
    """Points, (rows, dim) each, as dual numbers whose variables are the coordinates of all points of a row."""
    rows, dim = points[0].shape
    partials: Array = np.zeros((len(points), dim, len(points), rows, dim))
    for number in range(len(points)):
        for axis in range(dim):
            partials[number, axis, number, :, axis] = 1.0
    count = len(points) * dim
    return [Dual(point, partials[:, :, number].reshape(count, rows, dim)) for number, point in enumerate(points)]


def _of_each(key: Any) -> tuple[Any, ...]:
    """An index of the values as an index of the partial derivatives."""
    return (slice(None), *key) if isinstance(key, tuple) else (slice(None), key)


def plain(given: Values) -> Any:
    """The values without derivatives."""
    return given.value if isinstance(given, Dual) else given


def _partials(given: Values, ndim: int) -> Any:
    """Partial derivatives of one argument of a function, aligned with a value of ``ndim`` axes; 0 of a constant."""
    if not isinstance(given, Dual):
        return 0.0
    partials, missing = given.partials, ndim + 1 - given.partials.ndim
    return partials.reshape(partials.shape[0], *(1,) * missing, *partials.shape[1:]) if missing else partials


def _full(value: Array, partials: Any) -> Dual:
    if partials.shape[1:] != value.shape:
        partials = np.broadcast_to(partials, (partials.shape[0], *value.shape))
    return Dual(value, partials)


def _where(condition: Array, one: Values, other: Values) -> Dual:
    value = np.where(condition, plain(one), plain(other))
    return _full(value, np.where(condition, _partials(one, value.ndim), _partials(other, value.ndim)))


def _clip(given: Dual, low: Values, high: Values) -> Dual:
    value = np.clip(given.value, low, high)
    return _full(value, (value == given.value) * _partials(given, value.ndim))


def _stack(parts: Sequence[Dual], axis: int = 0) -> Dual:
    own = axis + 1 if axis >= 0 else axis
    return Dual(np.stack([each.value for each in parts], axis), np.stack([each.partials for each in parts], own))


def _root_slope(value: Array, given: Array) -> tuple[Array]:
    return (np.divide(0.5, value, out=np.zeros_like(value), where=value > 0),)


def _angle_slopes(value: Array, rise: Array, run: Array) -> tuple[Array, Array]:
    square = rise * rise + run * run
    scale = np.divide(1.0, square, out=np.zeros_like(square), where=square > 0)
    return run * scale, -rise * scale


CONDITIONS = {np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal}

SLOPES: dict[np.ufunc, Callable[..., tuple[Any, ...]]] = {
    np.add: lambda value, one, other: (None, None),
    np.subtract: lambda value, one, other: (None, -1),
    np.negative: lambda value, given: (-1,),
    np.multiply: lambda value, one, other: (other, one),
    np.true_divide: lambda value, one, other: (1 / other, -value / other),
    np.power: lambda value, one, other: (other * one ** (other - 1), None),
    np.sqrt: _root_slope,
    np.absolute: lambda value, given: (np.sign(given),),
    np.maximum: lambda value, one, other: (one >= other, one < other),
    np.minimum: lambda value, one, other: (one <= other, one > other),
    np.arctan2: _angle_slopes,
}
"""Derivatives of functions by each argument, from the value and the arguments; None for 1. Exponents are constant."""

FUNCTIONS: dict[Any, Callable[..., Any]] = {np.where: _where, np.clip: _clip, np.stack: _stack}
