"""Proof of a claim, as a check with its boxes."""

from __future__ import annotations

from math import isfinite

from missionc.ir import Mission
from missionc.verify.certificate import Check
from missionc.verify.proof.branch_and_bound import branch_and_bound
from missionc.verify.proof.claims import Claim
from missionc.verify.proof.proof_boxes import Boxes, boxes_of

MANY = 20_000
"""Parts: where the least margin takes more, boxes that prove what is asked are stated, if they are fewer."""


def prove(mission: Mission, claim: Claim) -> tuple[Check, Boxes]:
    """The check, whose margin is the least of its boxes' bounds. The claim has at least one item."""
    parts = branch_and_bound(claim)
    slack = claim.tolerance + (claim.gap if isfinite(claim.gap) else 0.0)
    if parts.item.size > MANY and parts.lower.min() >= -slack:
        fewer = branch_and_bound(claim, enough=-slack)
        parts = fewer if fewer.item.size < parts.item.size else parts
    boxes = boxes_of(claim, parts)
    subject, piece = divmod(parts.worst, claim.pieces)
    check = Check(
        name=claim.name,
        subject=claim.subject,
        margin=boxes.least,
        unit=claim.unit,
        tolerance=slack,
        # A witness below the tolerance refutes; between witnesses the proof may be short by the gap.
        passed=boxes.least >= -slack and parts.least >= -claim.tolerance,
        at=claim.when(piece + parts.moment),
        agents=tuple(mission.agents[agent].name for agent in claim.agents[subject].tolist()),
        detail=claim.detail,
    )
    return check, boxes
