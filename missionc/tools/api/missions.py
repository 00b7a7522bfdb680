"""Functions of missions: check, compile and monitor a file, a text, or a mission built in Python.

Findings about a mission that was built in Python point at the lines that built it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from missionc.backends.api import Backend, Progress, ignore
from missionc.backends.options import Options
from missionc.base.continuous_time import ContinuousTime
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.limits import Limits
from missionc.base.source import Source
from missionc.base.units import Seconds
from missionc.compiler import driver
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Compiled, Monitored
from missionc.frontend.builder.mission import Mission
from missionc.frontend.builder.origins import at_origins
from missionc.tools.api.described import PLANNER_OPTIONS, described, planner_options

if TYPE_CHECKING:
    from missionc.backends.clot.settings import ClotSettings
    from missionc.backends.smt.settings import SmtSettings

MissionLike: TypeAlias = "str | Path | Source | Mission"
"""The path of a file, a text under a name, or a mission built in Python."""


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
        limits: sizes that a mission may have.

    Returns:
        Every finding, and the mission if there is no error.

    Raises:
        ValueError: there is no such profile.
    """
    checked = driver.check(
        source_of(mission), overrides=overrides, backend=backend, vehicle=vehicle, poses=poses, limits=limits
    )
    return replace(checked, findings=at_origins(checked.findings, mission)) if isinstance(mission, Mission) else checked


@described(PLANNER_OPTIONS)
def compile(
    mission: MissionLike,
    *,
    overrides: Mapping[str, str] | None = None,
    backend: str | Backend = "auto",
    settings: Mapping[str, object] | SmtSettings | ClotSettings | None = None,
    vehicle: str = "",
    poses: Path | Source | None = None,
    limits: Limits | None = None,
    seed: int = 0,
    time_limit: float = driver.DEFAULT_TIME_LIMIT,
    memory_limit: int = driver.DEFAULT_MEMORY_LIMIT,
    explain_limit: float = 0.0,
    continuous_time: ContinuousTime = ContinuousTime.WANTED,
    alternatives: int = 1,
    exports: tuple[str, ...] = (),
    listen: Callable[[Progress], None] = ignore,
    keep: Callable[[bytes], object] | None = None,
    resume: bytes | None = None,
    options: Options | None = None,
    **given: Any,
) -> Compiled:
    """Compile a mission into a verified plan.

    Args:
        mission: as for ``check``, like ``overrides``, ``vehicle``, ``poses`` and ``limits``.
        backend: also a backend itself, as one of a ``BackendExtension``.
        settings: of the backends by name, ``{"smt.nodes": 400}``, or the settings of one backend.
        seed: of everything drawn at random.
        time_limit: seconds, of the whole compilation. A search ends with the best plan so far.
        memory_limit: bytes, of this process and its solvers.
        explain_limit: seconds of the time limit for explaining why there is no plan.
        continuous_time: whether requirements must be satisfied between the steps too.
        alternatives: number of plans that differ.
        exports: names of further file formats, those of ``missionc export --list``.
        listen: receives the progress.
        keep: receives the bytes of a checkpoint, from time to time.
        resume: bytes of a checkpoint of the same mission, seed and options.
        options: values of the options below that are not given themselves.

    Returns:
        The outcome, and every finding.

    Raises:
        TypeError: there is no such option.
        ValueError: an option does not have such a value.
    """
    compiled = driver.compile(
        source_of(mission),
        overrides=overrides,
        backend=backend,
        settings=settings,
        vehicle=vehicle,
        poses=poses,
        limits=limits,
        seed=seed,
        time_limit=Seconds(time_limit),
        memory_limit=memory_limit,
        explain_limit=Seconds(explain_limit),
        throughout=continuous_time,
        alternatives=alternatives,
        exports=exports,
        listen=listen,
        keep=keep,
        resume=resume,
        options=planner_options("compile", given, options),
    )
    return replace(compiled, **_at_origins(compiled.checked, compiled.findings, mission))


def monitor(
    mission: MissionLike,
    trace: str | Path,
    *,
    overrides: Mapping[str, str] | None = None,
    limits: Limits | None = None,
    continuous: bool = False,
    tolerance: float = 0.0,
) -> Monitored:
    """Judge a recorded trace by a mission.

    Args:
        mission: as for ``check``, like ``overrides`` and ``limits``.
        trace: path of a trace, of a ``plan.json`` or of a plan folder.
        continuous: whether requirements and constraints must be satisfied between the samples too.
        tolerance: largest error of a recorded position, metres; of constraints.

    Returns:
        Verdict and robustness of each requirement, and the verdicts on constraints.
    """
    monitored = driver.monitor(
        source_of(mission), trace, overrides=overrides, limits=limits, continuous=continuous, tolerance=tolerance
    )
    return replace(monitored, **_at_origins(monitored.checked, monitored.findings, mission))


def source_of(mission: MissionLike) -> str | Path | Source:
    """A mission as the front end reads it.

    Raises:
        TypeError: the value is no mission.
    """
    if isinstance(mission, Mission):
        return mission.source
    if not isinstance(mission, str | Path | Source):
        raise TypeError(f"a path, a Source or a Mission was expected, not {mission!r}")
    return mission


def _at_origins(checked: Checked, findings: tuple[Diagnostic, ...], mission: MissionLike) -> dict[str, Any]:
    """The fields of a result whose findings point at the lines of Python that built the mission."""
    if not isinstance(mission, Mission):
        return {}
    moved = replace(checked, findings=at_origins(checked.findings, mission))
    return {"checked": moved, "findings": at_origins(findings, mission)}
