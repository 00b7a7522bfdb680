"""Flight of a verified mission from measured poses, with the transfers replanned and the mission unchanged.

in   Mission, the texts of its verified polynomials, the file of the poses
out  FlownFrom: the mission with those pads, its transfers, and the files of the plan and proof
says MC546 MC547 MC544 MC545 MC740, and the findings of tables
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

from missionc.backends.api import Budget
from missionc.base.diagnostics.model import Diagnostic, has_errors
from missionc.base.late_dataclass import Record
from missionc.base.limits import Limits
from missionc.compiler.plan_ways import plan_ways
from missionc.frontend.checks.check_pads import check_pads
from missionc.frontend.resolve.measured_pads import with_measured_pads
from missionc.frontend.syntax.read_file import read_data
from missionc.ir import Mission
from missionc.output.documents.certificate_json import certificate_json
from missionc.output.documents.safe_end_json import safe_end_json
from missionc.output.documents.whole_flight_json import whole_flight_json
from missionc.output.folder.file_names import SAFE_END, WHOLE_FLIGHT
from missionc.output.folder.manifest import sha256
from missionc.output.output_files import WholeFlight

LONGEST = 60.0
"""Time limit for planning the transfers, seconds, since operators wait for them."""
PROOF = "whole_flight_certificate.json"
"""Name of the file that proves the transfers and the columns."""


class FlownFrom(Record, eq=False):
    """Mission with pads at the measured poses, its transfers, and the files of the plan and proof.

    ``whole`` is None if the flight is impossible from there; ``findings`` have the reason, or warnings.
    """

    mission: Mission
    whole: WholeFlight | None
    files: Mapping[str, bytes]
    findings: tuple[Diagnostic, ...]


def fly_from(mission: Mission, flown: Mapping[str, str], plan: bytes, poses: Path, limits: Limits) -> FlownFrom:
    """Plan and verify the transfers from the measured poses of the agents to the mission, and back.

    Args:
        flown: verified polynomials of each agent, by name.
        plan: file of their plan.
        poses: file of the measured poses.
    """
    text = read_data(poses, str(poses), limits)
    if isinstance(text, Diagnostic):
        return FlownFrom(mission, None, {}, (text,))
    placed, findings = with_measured_pads(mission, text, limits)
    if placed is None:
        return FlownFrom(mission, None, {}, tuple(findings))
    findings += check_pads(placed)
    if has_errors(findings):
        return FlownFrom(placed, None, {}, tuple(findings))
    whole = plan_ways(placed, flown, Budget(time.monotonic() + LONGEST, limits=limits))
    if isinstance(whole, Diagnostic):
        return FlownFrom(placed, None, {}, (*findings, whole))
    assert whole is not None, "every agent has a pad"
    files = {
        SAFE_END: safe_end_json(placed, whole.stops).encode(),
        WHOLE_FLIGHT: whole_flight_json(placed, flown, whole.ways).encode(),
        PROOF: certificate_json(whole.certificate, sha256(plan)).encode(),
    }
    return FlownFrom(placed, whole, files, tuple(findings))
