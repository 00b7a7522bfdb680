"""Branch and bound over parts of a flight: the minimum margin of a claim with a proof, or the pieces on which it fails.

A claim is a margin along curves that can be bounded on any part of them. With many subjects, the bounding box of a
trajectory shows which subjects are far; the nearest come first.

The control points of a curve bound a margin on a complete piece. If the bound does not suffice the piece is halved, all
items together, until the minimum bound is within the claim's gap of the minimum computed margin. The pieces on which a
claim fails are found likewise, but every piece is decided separately.

Source:
    Farouki, "The Bernstein polynomial basis: a centennial retrospective" (2012), section 6.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices
from missionc.geometry.curves.bernstein_intervals import Enclosed

Bounds: TypeAlias = tuple[Array, Array, Array]
"""Arrays (parts,): lower bound of the margin over each part, margin at one of its points, and position of that point.

The position of the point is a fraction of the part.
"""

Curve: TypeAlias = Callable[[Indices], Enclosed]
"""Function from item indices to the items' curves over their complete pieces: (items, dim)."""

Far: TypeAlias = Callable[[Indices], Array]
"""Function from subjects to lower bounds of their margins over the complete flight, from bounding boxes: (subjects,).
"""

Judge: TypeAlias = Callable[[Indices, Enclosed], Bounds]
"""Function that bounds the margin of items, given their curves over a part of each item's time, (parts, dim)."""


class Claim(Record, eq=False):
    """Claim that a margin is at least 0 at all times, for every subject (an agent or a pair of agents).

    Args:
        name, subject, unit, tolerance, detail: fields of the check.
        agents: (subjects, one or two): agent indices of each subject.
        times: (pieces + 1,), seconds.
        curve: the curves of items; item ``subject * pieces + piece`` is a subject in a piece.
        judge: function that bounds the margin.
        gap: maximum difference between the minimum computed margin and the proved bound.
        far: a fast bound, if there is one.
    """

    name: str
    subject: str
    unit: str
    tolerance: float
    detail: str
    agents: Indices
    times: Array
    curve: Curve
    judge: Judge
    gap: float
    far: Far | None = None

    @property
    def pieces(self) -> int:
        return self.times.size - 1

    @property
    def items(self) -> int:
        return len(self.agents) * self.pieces

    def when(self, moment: float) -> float:
        """Time in seconds that corresponds to a time in pieces: 3.25 is a quarter into the fourth piece."""
        return float(np.interp(moment, np.arange(self.times.size), self.times))


def everyone(count: int) -> Indices:
    """Subjects of a claim about each single agent: the agent indices, (count, 1)."""
    return np.arange(count, dtype=np.int64)[:, None]


def of_agents(curves: Enclosed) -> Curve:
    """Function from item indices to curves, for curves (agents, pieces, dim) with each agent as a subject."""
    pieces = curves.radius.shape[1]
    return lambda item: curves[item // pieces, item % pieces]


SHORTEST = 2.0**-10
"""Fraction of a piece below which an unproved part counts as failing."""

CHUNK = 1 << 15
"""Number of parts that are evaluated together; it bounds the memory and fits the cache."""

FEW = 1 << 12
"""Number of items above which subjects that are far apart over the complete flight are not examined piece by piece."""

MOST_PARTS = 1 << 20
"""Maximum number of parts of a proof; afterwards the bounds are returned as they are, valid but looser."""

SHARE = 1e-3
"""Relative precision to which large margins are computed."""

FINEST = 2.0**-40
"""Fraction of a piece below which parts are not halved; a claim that is unproved on such a part stays unproved."""


class BoxParts(Record, eq=False):
    """Parts that cover every item of a claim, with the bounds that prove it, in order of item and time.

    Args:
        item: (parts,): index of the item.
        begin, width: (parts,): dyadic fractions of the item's piece. All pieces of a subject may be one part.
        lower: (parts,): lower bound of the margin on the part.
        least: minimum computed margin.
        worst: item of the minimum computed margin.
        moment: its time, as a fraction of the piece.
    """

    item: Indices
    begin: Array
    width: Array
    lower: Array
    least: float
    worst: int
    moment: float


def branch_and_bound(claim: Claim, enough: float = np.inf) -> BoxParts:
    """Parts whose bounds prove the minimum margin up to the claim's gap, or only that it is at least ``enough``."""
    far, unseen = _nearest_last(claim)
    waiting: list[tuple[Indices, Array, Array, Enclosed | None]] = []
    done: list[tuple[Indices, Array, Array, Array]] = []
    least, worst, moment, spent = np.inf, 0, 0.0, 0
    while waiting or unseen:
        if not waiting:
            subject = unseen.pop()
            clear = far[subject] >= min(least - claim.gap - SHARE * abs(least), enough)
            whole, subject = subject[clear], subject[~clear]
            done.append((whole * claim.pieces, np.zeros(whole.size), np.full(whole.size, claim.pieces), far[whole]))
            item = (subject[:, None] * claim.pieces + np.arange(claim.pieces)).ravel()
            if item.size:
                waiting.append((item, np.zeros(item.size), np.ones(item.size), None))
            continue
        item, begin, width, curve = waiting.pop()
        curve = claim.curve(item) if curve is None else curve
        lower, upper, share = claim.judge(item, curve)
        spent += item.size
        best = int(upper.argmin())
        if upper[best] < least:
            least, worst, moment = float(upper[best]), int(item[best]), float(begin[best] + share[best] * width[best])
        wanted = min(least - claim.gap - SHARE * abs(least), enough)
        settled = (lower >= wanted) | (width <= FINEST) | (spent > MOST_PARTS) | ~np.isfinite(lower)
        done.append((item[settled], begin[settled], width[settled], lower[settled]))
        rest = ~settled
        if rest.any():
            before, after = curve[rest].halves()
            item, begin, half = item[rest], begin[rest], width[rest] / 2
            waiting += [(item, begin + half, half, after), (item, begin, half, before)]
            _joined(waiting)
    item, begin, width, lower = (np.concatenate(column) for column in zip(*done, strict=True))
    order = np.lexsort((begin, item))
    return BoxParts(item[order], begin[order], width[order], lower[order], least, worst, moment)


def _nearest_last(claim: Claim) -> tuple[Array, list[Indices]]:
    """Lower bounds of each subject's margin over the complete flight, (subjects,), and batches of subjects, the nearest
    last.
    """
    count = len(claim.agents)
    far, order = np.full(count, -np.inf), np.arange(count)
    if claim.far is not None and claim.items > FEW:
        far = claim.far(order)
        order = np.argsort(-far, kind="stable")
    chunks = []
    size = FEW
    while order.size:
        taken = max(1, (size if claim.items > FEW else CHUNK) // claim.pieces)
        chunks.append(order[-taken:])
        order, size = order[:-taken], min(2 * size, CHUNK)
    return far, chunks[::-1]


def _joined(waiting: list[tuple[Indices, Array, Array, Enclosed | None]]) -> None:
    """Merge the last two waiting batches if they are small, since a small batch costs as much as a large one."""
    first, second = waiting[-2:]
    if first[0].size + second[0].size > CHUNK or first[3] is None or second[3] is None:
        return
    item, begin, width = (np.concatenate([first[place], second[place]]) for place in range(3))
    points = np.concatenate([first[3].points, second[3].points])
    waiting[-2:] = [(item, begin, width, Enclosed(points, np.concatenate([first[3].radius, second[3].radius])))]


def failing_pieces(claim: Claim) -> set[int]:
    """Indices of the pieces on which some subject's margin is, or may be, below the claim's tolerance."""
    subjects = np.arange(len(claim.agents))
    if claim.far is not None:
        subjects = subjects[~(claim.far(subjects) >= 0)]
    items = (subjects[:, None] * claim.pieces + np.arange(claim.pieces)).ravel()
    failing = np.zeros(claim.pieces, dtype=np.bool_)
    for begin in range(0, items.size, CHUNK):
        item = items[begin : begin + CHUNK]
        _decide(claim, item, claim.curve(item), failing)
    return set(np.flatnonzero(failing).tolist())


def _decide(claim: Claim, item: Indices, curve: Enclosed, failing: Flags) -> None:
    """Mark in ``failing`` the pieces on which the claim fails for these items."""
    width = 1.0
    while item.size:
        lower, seen, _ = claim.judge(item, curve)
        open_ = ~(lower >= -claim.tolerance)
        fails = open_ & (~(seen >= -claim.tolerance) | (width <= SHORTEST))
        failing[item[fails] % claim.pieces] = True
        rest = open_ & ~failing[item % claim.pieces]
        if not rest.any():
            return
        before, after = curve[rest].halves()
        item, width = np.tile(item[rest], 2), width / 2
        curve = Enclosed(np.concatenate([before.points, after.points]), np.concatenate([before.radius, after.radius]))
