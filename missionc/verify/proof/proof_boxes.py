"""The boxes of a proof: stretches of the flight, each with its subject and a lower bound of the margin on it.

Moments count pieces: 3.25 is a quarter into the fourth. A box ends where the
next one of its subject begins, so that what is stated covers the flight if the
first begins with it and the last ends with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import floor

import numpy as np

from missionc.base.trace import Array
from missionc.curves.bernstein_intervals import Enclosed
from missionc.curves.piecewise_polynomials import Indices
from missionc.verify.proof.branch_and_bound import Parts
from missionc.verify.proof.claims import Claim

FINEST_EXPONENT = 40
"""No box begins at a finer part of a piece than this power of one half."""

MOST_PARTS = 1 << 22
"""That the boxes of one check may come to."""


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """What proves one check.

    Args:
        claim: what the bounds are of.
        ends: for each subject the moments at which its boxes begin, and the end of the last.
        bounds: for each subject the lower bound of the margin on each box.
    """

    claim: Claim
    ends: tuple[tuple[float, ...], ...]
    bounds: tuple[tuple[float, ...], ...]

    @property
    def least(self) -> float:
        return min(min(each) for each in self.bounds)


def stated(bound: float) -> float:
    """As it is written: rounded down by a billionth or two, so that the doubles of another machine prove it too."""
    if not -1e6 < bound < 1e6:
        return bound - abs(bound) * 1e-12
    return (floor(bound * 1e9) - 1) / 1e9


def boxes_of(claim: Claim, parts: Parts) -> Boxes:
    """Whole pieces of a subject that follow each other become one box."""
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
    """What is wrong with boxes that somebody stated: they leave time out, or do not hold."""
    claim = boxes.claim
    for rows, what in ((boxes.ends, "boxes"), (boxes.bounds, "bounds")):
        if len(rows) != len(claim.agents):
            return f"it has {what} for {len(rows)} subjects, not for {len(claim.agents)}"
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
                return "it has more boxes than can be looked at"
    start, width = np.array(moments), np.array(widths)
    piece = np.floor(start).astype(np.int64)
    item = np.array(subjects, dtype=np.int64) * claim.pieces + piece
    holds = bound_on(claim, item, start - piece, width) >= np.array(stated_bounds)
    if holds.all():
        return None
    at = int(np.argmin(holds))
    return f"the bound of its box at {claim.when(float(start[at])):.2f} s does not hold"


def bound_on(claim: Claim, item: Indices, begin: Array, width: Array) -> Array:
    """(parts,): the lower bound of the margin on dyadic parts of items, each computed from its curve anew."""
    lower = np.empty(item.size)
    # As deep as the part is short, the half is taken that it lies in.
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
    """A stretch as parts that halving pieces leads to, the longest ones there are: begin and width of each."""
    parts = []
    while begin < end:
        width = 1.0 if begin.is_integer() else _lowest_bit(begin)
        while begin + width > end:
            width /= 2
        parts.append((begin, width))
        begin += width
    return parts


def _lowest_bit(moment: float) -> float:
    """The largest power of one half that the moment is a multiple of."""
    scaled = int((moment % 1.0) * 2.0**FINEST_EXPONENT)
    return float((scaled & -scaled) / 2.0**FINEST_EXPONENT)
