"""Functions of missions: check and monitor a file, a text, or a mission built in Python.

Findings about a mission built in Python refer to the lines that built it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Monitored, with_origins
from missionc.frontend.builder.origins import MissionLike, at_origins, source_of


def check(
    mission: MissionLike,
    *,
    overrides: Mapping[str, str] | None = None,
    backend: str = "auto",
    vehicle: str = "",
    poses: Path | Source | None = None,
    limits: Limits | None = None,
) -> Checked:
    """Check a mission without planning it.

    Args:
        mission: path of a file, ``Source``, or ``Mission``.
        overrides: texts for parameters: ``{"T": "30 s"}``.
        backend: ``auto``, or the backend that must be able to plan it.
        vehicle: profile of teams that name none.
        poses: file of measured positions, from which the agents take off.
        limits: maximum sizes of a mission.

    Returns:
        Every finding, and the mission if there is no error.

    Raises:
        ValueError: the profile is unknown.
    """
    checked = driver.check(
        source_of(mission), overrides=overrides, backend=backend, vehicle=vehicle, poses=poses, limits=limits
    )
    return replace(checked, findings=at_origins(checked.findings, mission))


def monitor(
    mission: MissionLike,
    trace: str | Path,
    *,
    overrides: Mapping[str, str] | None = None,
    limits: Limits | None = None,
    continuous: bool = False,
    tolerance: float = 0.0,
) -> Monitored:
    """Evaluate a mission on a recorded trace.

    Args:
        mission: as in ``check``, like ``overrides`` and ``limits``.
        trace: path of a trace, of a ``plan.json`` or of a plan folder.
        continuous: whether requirements and constraints must be satisfied between the samples too.
        tolerance: maximum error of a recorded position, metres, for constraints.

    Returns:
        Verdict and robustness of each requirement, and the verdicts on constraints.
    """
    monitored = driver.monitor(
        source_of(mission), trace, overrides=overrides, limits=limits, continuous=continuous, tolerance=tolerance
    )
    return with_origins(monitored, mission)
