"""The smallest margin of every kind of check in the certificate, with its time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from missionc.base.trace import Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.certificate import Certificate, Check
from missionc.verification.monitoring.verdict_table import table

ROOM = frozenset(("requirement", "separation", "obstacle", "flown requirement", "flown separation", "flown obstacle"))
"""Names of the checks whose margin in metres is a clearance of the trajectories."""

OF_FILES = frozenset(("manifest", "certificate", "document"))
"""Names of the checks about a folder's files rather than the plan, which are shown only if they fail."""


def checks(certificate: Certificate, mission: Mission, kernel: Kernel, trace: Trace) -> list[dict[str, Any]]:
    """Rows of the smallest margins, one for each requirement and for each other kind of check.

    Failed checks come first.
    """
    times = _decisive(mission, kernel, trace)
    kinds: dict[tuple[str, str], list[Check]] = {}
    for check in certificate.checks:
        if not (check.name in OF_FILES and check.passed):
            kinds.setdefault((check.name, check.subject if _asked(check) else ""), []).append(check)
    rows = [_row(group, times) for group in kinds.values()]
    tight = [row for row in rows if row["at"] is not None and row["name"] in ROOM and row["margin"] is not None]
    tightest = min(tight, key=lambda row: row["margin"], default=None)
    for row in rows:
        row["tightest"] = row is tightest
    return sorted(rows, key=lambda row: row["passed"])


def _row(group: list[Check], times: dict[str, float]) -> dict[str, Any]:
    # Ties within rounding go to the first, for any author of the certificate.
    worst = min(
        group, key=lambda check: (check.passed, round(check.margin, 6) if math.isfinite(check.margin) else check.margin)
    )
    at = times.get(worst.subject) if worst.at is None and _asked(worst) else worst.at
    return {
        "name": worst.name,
        "subject": worst.subject,
        "agents": list(worst.agents),
        "count": len(group),
        "margin": round(worst.margin, 6) + 0.0 if math.isfinite(worst.margin) else None,
        "unit": worst.unit,
        "tolerance": worst.tolerance,
        "at": None if at is None else round(at, 6),
        "passed": all(check.passed for check in group),
        "detail": worst.detail,
    }


def _asked(check: Check) -> bool:
    return check.name.endswith("requirement")


def _decisive(mission: Mission, kernel: Kernel, trace: Trace) -> dict[str, float]:
    """Time in seconds at which the robustness of each requirement is attained, by name."""
    goals = [goal.formula for goal in kernel.requirements]
    rows = table(goals, goals, mission, trace, {})
    times = {}
    for goal in kernel.requirements:
        row = rows[goal.formula]
        final = row.least[0, -1] if row.unfolds else row.least[0, 0]
        reached = (row.most[0] == final) | (row.least[0] == final)
        times[goal.name] = float(np.argmax(reached)) * mission.step
    return times
