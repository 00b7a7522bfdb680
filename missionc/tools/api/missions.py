"""Public functions that read a mission: check it, and evaluate it on a recorded trace.

A mission is a file, a text, or an object built in Python. Findings about the latter refer to the Python lines that
built it.
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
        overrides: values of parameters as texts, by name: ``{"T": "30 s"}``.
        backend: name of the backend that must support the mission, or ``auto`` for any.
        vehicle: vehicle profile of teams that name none.
        poses: file of measured positions, from which the agents take off; None for the starts of the mission.
        limits: maximum sizes of a mission; the defaults of ``Limits`` if None.

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
        mission: path of a file, ``Source``, or ``Mission``.
        trace: path of a trace, of a ``plan.json`` or of a plan folder.
        overrides: values of parameters as texts, by name.
        limits: maximum sizes of a mission and a trace; the defaults of ``Limits`` if None.
        continuous: whether to evaluate requirements and constraints between the samples too.
        tolerance: maximum error of a recorded position, metres, for constraints.

    Returns:
        Verdict and robustness of each requirement, and the verdicts on constraints.
    """
    monitored = driver.monitor(
        source_of(mission), trace, overrides=overrides, limits=limits, continuous=continuous, tolerance=tolerance
    )
    return with_origins(monitored, mission)
