"""Boxes of a proof: time intervals of the flight with a subject and a lower bound, from interval margins.

Times count pieces: 3.25 is a quarter into the fourth piece. A box ends at the beginning of the next box of its subject,
so the boxes cover the flight if the first begins with it and the last ends with it. Interval margins are bounds of
distances and limits on a part of a curve.
"""

from __future__ import annotations

import math
from itertools import pairwise
from math import floor

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.geometry.curves.bernstein_intervals import GROWN, Enclosed, lowered, root_above, root_below
from missionc.verification.proof.branch_and_bound import Bounds, BoxParts, Claim, Judge

FAR = 2.0
"""Margin beyond which no further precision is needed."""

ANGLE = 1e-14
"""Bound on the error of an arc tangent in double precision, rad."""


def at_least_in_box(need: Array, pieces: int = 1) -> Judge:
    """Function that bounds the length of a vector minus ``need`` on parts of a curve.

    The box of the control points decides for distant parts; the squared length is only used for the others.

    Args:
        need: minimum length, (items,), or (items / pieces,) if equal in all pieces, in the unit of the vector.
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
    """Lower bound on the length of every vector in a box, minus ``need``.

    Shape: (parts, dim) twice -> (parts,), metres.
    """
    aside = np.maximum(np.maximum(low, -high), 0.0)
    return np.asarray(lowered(_length(aside, axis=-1) / GROWN - need))


def at_most(limit: Array) -> Judge:
    """Function that bounds ``limit`` minus the length of a vector on parts of a curve.

    Args:
        limit: maximum length, (items,), in the unit of the vector, such as m/s.
    """

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        square = curve.squares()
        seen = limit[item][:, None] - root_below(lowered(square.ends().points - square.radius[:, None]))
        return (lowered(limit[item] - root_above(square.high())), *_least(seen))

    return judge


def between_bounds(low: Array, high: Array) -> Judge:
    """Function that bounds the distance of every coordinate from its lower and upper limit, inside positive, metres.

    Args:
        low, high: (items, dim), metres.
    """

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        under, over = low[item], high[item]
        bound = np.minimum(lowered(curve.low() - under), lowered(over - curve.high())).min(axis=-1)
        ends = curve.ends().points
        seen = np.minimum(ends - under[..., None], over[..., None] - ends).min(axis=1)
        return (bound, *_least(seen))

    return judge


def in_band(low: Array, high: Array) -> Judge:
    """Function that bounds the distance of a vector's length from both ends of a permitted range.

    Args:
        low, high: ends of the range, (items,), in the unit of the vector, such as m/s.
    """
    longer, shorter = at_least_in_box(low), at_most(high)

    def judge(item: Indices, curve: Enclosed) -> Bounds:
        least, most = longer(item, curve), shorter(item, curve)
        chosen = least[1] <= most[1]
        return np.minimum(least[0], most[0]), np.minimum(least[1], most[1]), np.where(chosen, least[2], most[2])

    return judge


def upright(limit: Array) -> Judge:
    """Function that bounds ``limit`` minus the angle between a three-dimensional vector and the third axis.

    A vector that does not point up has the angle pi.

    Args:
        limit: maximum angle, (items,), rad.
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
    """Smaller of the margins at both ends of a part, (parts, 2), and the end that has it, 0 or 1."""
    return seen.min(axis=-1), seen.argmin(axis=-1).astype(np.float64)


FINEST_EXPONENT = 40
"""Exponent of the smallest fraction of a piece: a box begins at a multiple of 2 to the power of minus this number."""

MOST_PARTS = 1 << 22
"""Maximum number of parts for the boxes of one check."""


class Boxes(Record, eq=False):
    """Proof of one check: time intervals of each subject with lower bounds of the margin.

    Args:
        claim: the claim that the bounds prove.
        ends: for each subject, the beginnings of its boxes and the end of the last.
        bounds: for each subject, the lower bound of the margin on each box.
    """

    claim: Claim
    ends: tuple[tuple[float, ...], ...]
    bounds: tuple[tuple[float, ...], ...]

    @property
    def least(self) -> float:
        return min(min(each) for each in self.bounds)


def stated(bound: float) -> float:
    """The bound as written in a certificate, rounded down by a billionth or two, so that other machines can prove it
    too.
    """
    if not -1e6 < bound < 1e6:
        return bound - abs(bound) * 1e-12
    return (floor(bound * 1e9) - 1) / 1e9


def boxes_of(claim: Claim, parts: BoxParts) -> Boxes:
    """Proof boxes from the parts of a branch and bound; consecutive complete pieces of a subject become one box."""
    subject, piece = np.divmod(parts.item, claim.pieces)
    whole = parts.width == 1.0
    follows = np.zeros(subject.size, dtype=bool)
    follows[1:] = (subject[1:] == subject[:-1]) & whole[1:] & whole[:-1]
    first = np.flatnonzero(~follows)
    lower = np.minimum.reduceat(parts.lower, first)
    begin = (piece + parts.begin)[first].tolist()
    bounds = [stated(bound) for bound in lower.tolist()]
    where = np.searchsorted(subject[first], np.arange(len(claim.agents) + 1)).tolist()
    spans = list(pairwise(where))
    return Boxes(
        claim,
        tuple((*begin[start:stop], float(claim.pieces)) for start, stop in spans),
        tuple(tuple(bounds[start:stop]) for start, stop in spans),
    )


@np.errstate(over="ignore", invalid="ignore")
def fault(boxes: Boxes) -> str | None:
    """Describe the error in stored proof boxes, a gap in time or a bound that does not hold.

    None if they are correct.
    """
    claim = boxes.claim
    for rows, what in ((boxes.ends, "boxes"), (boxes.bounds, "bounds")):
        if len(rows) != len(claim.agents):
            return f"it has {what} for {len(rows)} subjects instead of {len(claim.agents)}"
    subjects, moments, widths, stated_bounds = [], [], [], []
    far = claim.far(np.arange(len(claim.agents))) if claim.far is not None else np.full(len(claim.agents), -np.inf)
    for subject, (ends, bounds) in enumerate(zip(boxes.ends, boxes.bounds, strict=True)):
        if len(ends) != len(bounds) + 1 or ends[0] != 0.0 or ends[-1] != claim.pieces:
            return "its boxes do not cover the flight"
        if len(bounds) == 1 and bounds[0] <= far[subject]:
            continue
        for (begin, end), bound in zip(pairwise(ends), bounds, strict=True):
            if not (begin < end and _dyadic(begin) and _dyadic(end)):
                return f"its boxes do not cover the flight in order, at {claim.when(begin):.2f} s"
            parts = _parts(begin, end)
            subjects += [subject] * len(parts)
            moments += [part[0] for part in parts]
            widths += [part[1] for part in parts]
            stated_bounds += [bound] * len(parts)
            if len(moments) > MOST_PARTS:
                return "it has too many boxes to check"
    start, width = np.array(moments), np.array(widths)
    piece = np.floor(start).astype(np.int64)
    item = np.array(subjects, dtype=np.int64) * claim.pieces + piece
    holds = bound_on(claim, item, start - piece, width) >= np.array(stated_bounds)
    if holds.all():
        return None
    at = int(np.argmin(holds))
    return f"the bound of its box at {claim.when(float(start[at])):.2f} s does not hold"


def bound_on(claim: Claim, item: Indices, begin: Array, width: Array) -> Array:
    """Lower bounds of the margin on dyadic parts of items, recomputed: (parts,), in the claim's unit."""
    lower = np.empty(item.size)
    # For each level of the part's depth, take the half that contains it.
    depth = (1 - np.frexp(width)[1]).astype(np.int64)
    for start in range(0, item.size, 1 << 15):
        chosen = slice(start, start + (1 << 15))
        whole, place, deep = claim.curve(item[chosen]), begin[chosen].copy(), depth[chosen]
        curve = Enclosed(whole.points.copy(), whole.radius.copy())
        for level in range(int(deep.max(initial=0))):
            below = np.flatnonzero(deep > level)
            before, after = curve[below].halves()
            second = place[below] >= 0.5
            curve.points[below] = np.where(second[:, None, None], after.points, before.points)
            curve.radius[below] = np.where(second[:, None], after.radius, before.radius)
            place[below] = place[below] * 2 - second
        lower[chosen] = claim.judge(item[chosen], curve)[0]
    return lower


def _dyadic(moment: float) -> bool:
    return (moment * 2.0**FINEST_EXPONENT).is_integer()


def _parts(begin: float, end: float) -> list[tuple[float, float]]:
    """Split an interval into the longest parts that halving of pieces can give: begin and width of each."""
    parts = []
    while begin < end:
        width = 1.0 if begin.is_integer() else _lowest_bit(begin)
        while begin + width > end:
            width /= 2
        parts.append((begin, width))
        begin += width
    return parts


def _lowest_bit(moment: float) -> float:
    """Largest power of one half that divides a time, given in pieces."""
    scaled = int((moment % 1.0) * 2.0**FINEST_EXPONENT)
    return float((scaled & -scaled) / 2.0**FINEST_EXPONENT)
