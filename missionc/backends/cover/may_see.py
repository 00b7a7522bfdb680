"""Lines of sight between cells: which two cells have no two points that see each other.

A line from a point of one cell to a point of another crosses every plane between them. Where all that it may cross of
one lies in a body, it is hidden.
"""

from __future__ import annotations

import numpy as np

from missionc.backends.cover.bodies import bodies
from missionc.backends.cover.cells import Cells
from missionc.base.late_dataclass import dataclass
from missionc.base.trace import Array, Flags
from missionc.ir import Box, Compare, Feature, Sight

INSIDE = 1e-5
"""Metres inside of a body's border, from where on it hides what is behind."""


@dataclass(frozen=True, slots=True)
class SightLink(Compare):
    """A bound on the distance of two agents who see each other on a graph."""

    terms: tuple[tuple[float, Feature], ...]
    constant: float
    strict: bool
    sight: Sight


def hidden(graph: Sight, one: Cells, other: Cells) -> Flags:
    """Which cells see nothing of which others: (cells of one, cells of the other)."""
    found: Flags = np.zeros((len(one), len(other)), dtype=np.bool_)
    for body in (body for shape in graph.shapes for body in bodies(shape)):
        if isinstance(body, Box):
            for axis, (low, high) in enumerate(zip(body.low, body.high, strict=True)):
                for at in (low + INSIDE, (low + high) / 2, high - INSIDE):
                    found |= _hides(body, axis, at, one, other) | _hides(body, axis, at, other, one).T
    return found


def _hides(body: Box, axis: int, at: float, one: Cells, other: Cells) -> Flags:
    """Which lines from below a plane to above it cross it within a body: (cells of one, cells of the other)."""
    hides: Flags = (one.high[:, None, axis] < at) & (other.low[None, :, axis] > at)
    least, most = (_share(at - one_end, other_end - at) for one_end, other_end in _ends(axis, one, other))
    for across in range(len(body.low)):
        if across != axis:
            low = np.minimum(*(_between(one.low, other.low, across, share) for share in (least, most)))
            high = np.maximum(*(_between(one.high, other.high, across, share) for share in (least, most)))
            hides &= (low > body.low[across] + INSIDE) & (high < body.high[across] - INSIDE)
    return hides


def _ends(axis: int, one: Cells, other: Cells) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """The coordinates between which the least share of a line, and the greatest, lies before a plane."""
    return (
        (one.high[:, None, axis], other.high[None, :, axis]),
        (one.low[:, None, axis], other.low[None, :, axis]),
    )


def _share(before: Array, after: Array) -> Array:
    """The share of a line before a plane; anything where it does not cross it."""
    whole = before + after
    return np.clip(np.divide(before, whole, out=np.zeros_like(whole), where=whole > 0), 0.0, 1.0)


def _between(first: Array, second: Array, axis: int, share: Array) -> Array:
    return (1 - share) * first[:, None, axis] + share * second[None, :, axis]
