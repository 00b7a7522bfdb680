"""The nearest miss: of the motions found for relaxed missions, the one that breaks one requirement the least.

in   Mission as written, its kernel, motions that are plans of relaxed missions
out  NearMiss, where one of them breaks nothing but one requirement
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from missionc.diagnostics.model import Diagnostic
from missionc.emit.near_miss import near_miss_json
from missionc.emit.plot import plot
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.monitoring import monitor
from missionc.plan import Judgement, Trace
from missionc.results import NearMiss, Relaxation
from missionc.verify import verify


def near_miss(
    mission: Mission, kernel: Kernel, backend: str, found: Iterable[tuple[Relaxation, Trace]]
) -> NearMiss | None:
    """With its files: ``near_miss.json``, and ``near_miss.svg`` where maps can be drawn."""
    best: tuple[Judgement, Trace, str] | None = None
    for relaxation, trace in found:
        broken = _broken(mission, kernel, trace)
        if broken is not None and (best is None or _by(broken) > _by(best[0])):
            best = broken, trace, relaxation.says
    if best is None:
        return None
    broken, trace, says = best
    files = [("near_miss.json", near_miss_json(mission, trace, monitor(mission, kernel, trace), broken, says).encode())]
    picture = plot(mission, trace, backend, "svg", broken)
    if not isinstance(picture, Diagnostic):
        files.append(("near_miss.svg", picture))
    return NearMiss(broken, says, tuple(files))


def _broken(mission: Mission, kernel: Kernel, trace: Trace) -> Judgement | None:
    """The one requirement that the motion breaks, where it is a motion of this mission and breaks nothing else."""
    if trace.position.shape[:2] != (len(mission.agents), mission.steps + 1):
        return None
    failures = verify(mission, kernel, trace).failures
    if [failure.name for failure in failures] != ["requirement"]:
        return None
    judged = monitor(mission, kernel, trace)[: len(kernel.requirements)]
    return next((each for each in judged if each.name == failures[0].subject and not each.satisfied), None)


def _by(broken: Judgement) -> float:
    return broken.robustness if math.isfinite(broken.robustness) else -math.inf
