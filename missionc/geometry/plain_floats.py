"""Single point in plain numbers, with the functions of an array library that signed distances need.

``signed_distance(plain_floats, shape, Place(point))`` gives the same distance as arrays of points, without loading an
array library.
"""

from __future__ import annotations

import math
from types import EllipsisType
from typing import Any

abs, maximum, minimum, sqrt = abs, max, min, math.sqrt  # under the names of array libraries


class Place(tuple[float, ...]):
    """Coordinates of a point, metres, indexed like an array: ``place[..., axis]``, ``place[..., :2]``."""

    __slots__ = ()

    @property
    def shape(self) -> tuple[int, ...]:
        return (len(self),)

    def __getitem__(self, key: int | tuple[EllipsisType, int | slice]) -> Any:  # type: ignore[override]
        coordinates = super().__getitem__(key if isinstance(key, int) else key[1])
        return Place(coordinates) if isinstance(coordinates, tuple) else coordinates


def where(condition: bool, then: float, otherwise: float) -> float:
    return then if condition else otherwise


def clip(value: float, low: float | None, high: float | None) -> float:
    if low is not None and value < low:
        return low
    return high if high is not None and value > high else value
