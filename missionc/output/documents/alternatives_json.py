"""``alternatives.json``: the plans of a folder that differ, ranked, and what is different in each.

in   the signature, the trace and the certificate of each, the best first
out  rows of a table; the document's text
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.output.folder.file_names import ALTERNATIVES_FOLDER
from missionc.output.json_layout import compact, document, listed
from missionc.verification.certificate import Certificate
from missionc.verification.monitoring.signature import Signature, differences

SCHEMA = "missionc.alternatives/1"

DIGITS = 9
"""Decimals of figures: what is read back from a plan differs by less."""

ROOM = frozenset(("requirement", "separation", "obstacle"))
"""Kinds of checks of a plan at its steps, whose margins in metres are room that it might have had more of."""


@dataclass(frozen=True, slots=True)
class AlternativeRow:
    """One plan of the table.

    Args:
        rank: 1 is the best by the mission's objective, or the shortest where it has none.
        folder: where its files are in the output folder; empty of the best one.
        differs: what is different from the best one, in words.
        length: metres that all agents travel together.
        duration: seconds after which nobody moves any more.
        energy: the square of all accelerations, summed over time, m²/s³.
        margin: the least of its requirements', separations' and clearances' margins at the steps, metres; infinite
            where there are none.
    """

    rank: int
    folder: str
    differs: tuple[str, ...]
    length: float
    duration: float
    energy: float
    margin: float

    def as_record(self) -> dict[str, object]:
        """For JSON: nothing in place of the folder of the best, and of a margin of nothing."""
        return {
            "rank": self.rank,
            "folder": self.folder or None,
            "differs": list(self.differs),
            "length": round(self.length, DIGITS),
            "duration": round(self.duration, DIGITS),
            "energy": round(self.energy, DIGITS),
            "margin": round(self.margin, DIGITS) if math.isfinite(self.margin) else None,
        }


def folder_of(rank: int) -> str:
    """Where the files of a plan lie in the output folder; empty of the best one."""
    return f"{ALTERNATIVES_FOLDER}/{rank}" if rank > 1 else ""


def rows(
    signatures: Sequence[Signature], traces: Sequence[Trace], certificates: Sequence[Certificate]
) -> list[AlternativeRow]:
    """The table, the best first; what is different is so from that one."""
    return [
        AlternativeRow(
            rank,
            folder_of(rank),
            () if rank == 1 else differences(signatures[0], signature),
            trace.metres,
            trace.lasts * float(trace.step),
            trace.effort,
            least_margin(certificate),
        )
        for rank, (signature, trace, certificate) in enumerate(zip(signatures, traces, certificates, strict=True), 1)
    ]


def least_margin(certificate: Certificate) -> float:
    """The least margin of a plan at its steps, metres; infinite where nothing has one."""
    return min((each.margin for each in certificate.checks if each.name in ROOM and each.unit == "m"), default=math.inf)


def alternatives_json(mission: Mission, table: Sequence[AlternativeRow]) -> str:
    """The text of ``alternatives.json``."""
    head = {"schema": SCHEMA, "mission": mission.name, "ranked_by": ranked_by(mission)}
    return document(head, listed("plans", (compact(row.as_record()) for row in table)))


def ranked_by(mission: Mission) -> str:
    """What the best plan has least of."""
    return {"duration": "duration", "energy": "energy"}.get(mission.objective.value, "length")
