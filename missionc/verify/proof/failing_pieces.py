"""The pieces of a flight on which a claim fails: each that was seen to, or that cannot be proved.

in   Claim
out  pieces

Where ``branch_and_bound`` looks for the least margin of all, here every piece is decided by itself.
"""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Flags
from missionc.curves.bernstein_intervals import Enclosed
from missionc.curves.piecewise_polynomials import Indices
from missionc.verify.proof.branch_and_bound import CHUNK
from missionc.verify.proof.claims import Claim

SHORTEST = 2.0**-10
"""The share of a piece below which one is taken to fail that is not proved yet."""


def failing_pieces(claim: Claim) -> set[int]:
    """The numbers of the pieces on which the margin of some subject is, or may be, below the claim's tolerance."""
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
    """Marks the pieces that fail among these items."""
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
