"""Interval bounds of margins on a part of a curve: distances kept, limits kept, bounds kept."""

from __future__ import annotations

import math

import numpy as np

from missionc.base.trace import Array
from missionc.curves.bernstein_intervals import GROWN, Enclosed, lowered, root_above, root_below
from missionc.curves.piecewise_polynomials import Indices
from missionc.verify.proof.claims import Bounds, Judge

FAR = 2.0
"""A margin beyond which nobody asks more precisely how far is far."""

ANGLE = 1e-14
"""Rad: more than an arc tangent of doubles errs."""


def at_least(need: Array, pieces: int = 1) -> Judge:
    """How much longer the vector is than ``need``, (items,), or (items / pieces,) where it is the same in all pieces.

    The box that holds the control points tells those that are far; only of the others is the square looked at.
    """

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        needed = need[item // pieces]
        lower = far_from_origin(curve.low(), curve.high(), needed)
        near = np.flatnonzero(lower < FAR)
        squared = root_below(curve[near].squares().low())
        lower[near] = np.maximum(lower[near], lowered(squared - needed[near]))
        ends = np.abs(curve.points[..., [0, -1]]) + curve.radius[..., None]
        return (lower, *_least(_length(ends, axis=1) * GROWN - needed[:, None]))

    return judge


def far_from_origin(low: Array, high: Array, need: Array) -> Array:
    """How much longer than ``need``, (parts,), every vector in a box is: (parts, dim) twice -> (parts,)."""
    aside = np.maximum(np.maximum(low, -high), 0.0)
    return np.asarray(lowered(_length(aside, axis=-1) / GROWN - need))


def at_most(limit: Array) -> Judge:
    """How much shorter the vector is than ``limit``, (items,)."""

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        square = curve.squares()
        seen = limit[item][:, None] - root_below(lowered(square.ends().points - square.radius[:, None]))
        return (lowered(limit[item] - root_above(square.high())), *_least(seen))

    return judge


def between(low: Array, high: Array) -> Judge:
    """How far every coordinate is from its bounds: (items, dim) twice."""

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        under, over = low[item], high[item]
        bound = np.minimum(lowered(curve.low() - under), lowered(over - curve.high())).min(axis=-1)
        ends = curve.ends().points
        seen = np.minimum(ends - under[..., None], over[..., None] - ends).min(axis=1)
        return (bound, *_least(seen))

    return judge


def in_band(low: Array, high: Array) -> Judge:
    """How far the vector's length is from the ends of a band: (items,) twice."""
    longer, shorter = at_least(low), at_most(high)

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        least, most = longer(item, curve), shorter(item, curve)
        chosen = least[1] <= most[1]
        return np.minimum(least[0], most[0]), np.minimum(least[1], most[1]), np.where(chosen, least[2], most[2])

    return judge


def upright(limit: Array) -> Judge:
    """How much less than ``limit``, (items,), rad, a vector of three coordinates leans from the third axis.

    One that does not point up leans by half a turn.
    """

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        aside, up = root_above(curve[:, :2].squares().high()), curve[:, 2].low()
        steepest = np.where(up > 0, np.arctan2(aside, np.maximum(up, 0.0)), math.pi)
        ends = curve.points[..., [0, -1]]
        leans = np.where(ends[:, 2] > 0, np.arctan2(np.hypot(ends[:, 0], ends[:, 1]), ends[:, 2]), math.pi)
        seen = limit[item][:, None] - leans
        return (lowered(limit[item] - steepest - ANGLE), *_least(seen))

    return judge


def _length(vectors: Array, axis: int) -> Array:
    return np.asarray(np.sqrt((vectors**2).sum(axis=axis)))


def _least(seen: Array) -> tuple[Array, Array]:
    """The smaller of the margins at both ends of a part, (parts, 2), and where."""
    return seen.min(axis=-1), seen.argmin(axis=-1).astype(np.float64)
