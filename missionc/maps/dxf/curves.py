"""Curves of a drawing: straight pieces, elliptical arcs and splines, each as chords within a tolerance.

The number of chords follows from the second derivative ``P''``: over a parameter step ``h`` a chord is no further from
its curve than ``h² max‖P''‖ / 8``. So chords are counted before any is computed.

Source:
    Zheng and Sederberg, "Estimating tessellation parameter intervals for rational curves and surfaces" (2000).
    Piegl and Tiller, "The NURBS Book", 3.3, for the control points of a derivative.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import dataclass

Points: TypeAlias = NDArray[np.float64]
"""(points, 3); (points, 2) if they are seen from above."""

WIDEST = math.pi / 4
"""The largest angle of a chord in an arc, radians, however coarse the tolerance is."""


class UnusableError(Exception):
    """A part of a drawing makes no area.

    Args:
        reason: follows the name of the part.
        way_out: one action.
    """

    def __init__(self, reason: str, way_out: str = "correct it, or name other layers with `layer`") -> None:
        super().__init__(reason)
        self.way_out = way_out


@dataclass(frozen=True, slots=True)
class Straight:
    """Straight pieces from point to point."""

    corners: Points

    def chords(self, tolerance: float) -> int:
        return len(self.corners) - 1

    def points(self, tolerance: float) -> Points:
        return self.corners

    def split(self, count: int) -> Points:
        return self.corners


@dataclass(frozen=True, slots=True)
class Arc:
    """``centre + growth (across cos angle + up sin angle)``.

    Args:
        sweep: radians from ``start`` to the end, negative if the arc is clockwise.
        growth: of the radius, at the start and at the end, linear between: other than 1 on the edges of a wide arc.
    """

    centre: Points
    across: Points
    up: Points
    start: float
    sweep: float
    growth: tuple[float, float] = (1.0, 1.0)

    def chords(self, tolerance: float) -> int:
        radius = max(float(np.linalg.norm(self.across)), float(np.linalg.norm(self.up)))
        first, last = self.growth
        bend = radius * (max(abs(first), abs(last)) * self.sweep**2 + 2 * abs(last - first) * abs(self.sweep))
        return max(_whole(math.sqrt(bend / (8 * tolerance))), _whole(abs(self.sweep) / WIDEST), 1)

    def points(self, tolerance: float) -> Points:
        return self.split(self.chords(tolerance))

    def split(self, count: int) -> Points:
        """Ends of that number of chords, each of the same angle."""
        share = np.linspace(0.0, 1.0, count + 1)[:, None]
        angle = self.start + self.sweep * share
        growth = self.growth[0] + (self.growth[1] - self.growth[0]) * share
        return self.centre + growth * (self.across * np.cos(angle) + self.up * np.sin(angle))


class Spline:
    """A B-spline of ``ezdxf``, polynomial or rational.

    Raises:
        UnusableError: a weight is not above 0.
    """

    def __init__(self, spline: Any) -> None:
        self._spline, degree, knots = spline, spline.degree, np.array(spline.knots(), dtype=float)
        points = np.array([point.xyz for point in spline.control_points])
        weights = np.array(spline.weights() or np.ones(len(points)), dtype=float)[:, None]
        if not weights.min() > 0:
            raise UnusableError("has a weight that is not above 0")
        points = points - points.mean(axis=0)
        reach = float(np.linalg.norm(points, axis=1).max())
        bend = _second_derivative(points * weights, knots, degree) + reach * _second_derivative(weights, knots, degree)
        self._bend = bend / float(weights.min())
        self._breaks = np.unique(knots[degree : len(points) + 1])

    def chords(self, tolerance: float) -> int:
        return sum(self._counts(tolerance))

    def points(self, tolerance: float) -> Points:
        spans = zip(self._breaks[:-1], self._breaks[1:], self._counts(tolerance), strict=True)
        steps = [np.linspace(low, high, count, endpoint=False) for low, high, count in spans]
        return np.array([point.xyz for point in self._spline.points([*np.concatenate(steps), self._breaks[-1]])])

    def _counts(self, tolerance: float) -> list[int]:
        density = math.sqrt(self._bend / (8 * tolerance))
        return [max(_whole(float(span) * density), 1) for span in np.diff(self._breaks)]


Curve: TypeAlias = Straight | Arc | Spline


def _second_derivative(points: NDArray[np.float64], knots: NDArray[np.float64], degree: int) -> float:
    """Upper bound of the norm between knots; the derivative may jump at a knot."""
    for order in (degree, degree - 1):
        gaps = (knots[order + 1 : order + len(points)] - knots[1 : len(points)])[:, None]
        points = np.divide(
            order * np.diff(points, axis=0), gaps, out=np.zeros((len(gaps), points.shape[1])), where=gaps > 0
        )
        knots = knots[1:-1]
    return float(np.linalg.norm(points, axis=1).max(initial=0.0))


def _whole(value: float) -> int:
    """The next whole number.

    Raises:
        UnusableError: the value is not finite.
    """
    if not math.isfinite(value):
        raise UnusableError("has a coordinate or a size that is not a finite number")
    return math.ceil(value)
