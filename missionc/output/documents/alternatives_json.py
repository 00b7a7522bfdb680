"""``alternatives.json``: the alternative plans in a folder, ranked, with their differences.

in   the signature, the trace and the certificate of each plan, the best first
out  rows of a table; the document's text
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from missionc.base.late_dataclass import Record
from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.output.folder.file_names import ALTERNATIVES_FOLDER
from missionc.output.json_layout import compact, document, listed
from missionc.verification.certificate import Certificate
from missionc.verification.monitoring.signature import Signature, differences

SCHEMA = "missionc.alternatives/1"

DIGITS = 9
"""Number of decimals in the document; values read back from a plan differ by less."""

ROOM = frozenset(("requirement", "separation", "obstacle"))
"""Names of the checks of a plan at its steps whose margins in metres are clearances."""


class AlternativeRow(Record):
    """Row of the table of alternative plans.

    Args:
        rank: rank by the mission's objective, or by length without one; 1 is the best.
        folder: its subfolder in the output folder; empty for the best plan.
        differs: differences from the best plan, in words.
        length: total length of all paths, metres.
        duration: seconds until all agents stay.
        energy: sum of squared accelerations over time, m²/s³.
        margin: smallest margin of requirements, separations and clearances at the steps, metres; infinite if there are
            none.
    """

    rank: int
    folder: str
    differs: tuple[str, ...]
    length: float
    duration: float
    energy: float
    margin: float

    def as_record(self) -> dict[str, object]:
        """The row as a JSON record; null for the folder of the best plan, and for an infinite margin."""
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
    """Subfolder of a plan in the output folder, by its rank; empty for the best plan."""
    return f"{ALTERNATIVES_FOLDER}/{rank}" if rank > 1 else ""


def rows(
    signatures: Sequence[Signature], traces: Sequence[Trace], certificates: Sequence[Certificate]
) -> list[AlternativeRow]:
    """Rows of the table of alternative plans, the best plan first; differences are relative to the best plan."""
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
    """Smallest margin of requirements, separations and clearances of a plan at its steps, metres.

    Infinite without one.
    """
    return min((each.margin for each in certificate.checks if each.name in ROOM and each.unit == "m"), default=math.inf)


def alternatives_json(mission: Mission, table: Sequence[AlternativeRow]) -> str:
    """Content of ``alternatives.json``."""
    head = {"schema": SCHEMA, "mission": mission.name, "ranked_by": ranked_by(mission)}
    return document(head, listed("plans", (compact(row.as_record()) for row in table)))


def ranked_by(mission: Mission) -> str:
    """Name of the quantity by which plans are ranked, smaller first: duration, energy or length."""
    return {"duration": "duration", "energy": "energy"}.get(mission.objective.value, "length")
