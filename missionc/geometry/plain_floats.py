"""One place in plain numbers, with as much of an array library as signed distances use.

``signed_distance(plain_floats, shape, Place(point))`` is the very distance that arrays of places get, of a single
one, for those who must not wait for an array library to be loaded.
"""

from __future__ import annotations

import math
from types import EllipsisType
from typing import Any

abs, maximum, minimum, sqrt = abs, max, min, math.sqrt  # by the names of array libraries


class Place(tuple[float, ...]):
    """A point's coordinates, metres, read as those of an array are: ``place[..., axis]``, ``place[..., :2]``."""

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
