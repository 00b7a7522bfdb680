"""The nearest miss: of the motions at hand, the one that violates the mission as written the least.

in   Mission as written, its kernel, motions that are plans of relaxed missions, a search's best candidate
out  NearMiss, where one of them breaks nothing but one requirement, or there is a candidate
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from missionc.backends.api import Attempt, Scope
from missionc.base.trace import Plan, Trace
from missionc.diagnostics.model import Diagnostic
from missionc.ir import Mission
from missionc.kernel.nodes import Kernel
from missionc.output.documents.near_miss_json import near_miss_json
from missionc.output.plot.plot import plot
from missionc.output.report.report_html import Plotted, report
from missionc.pipeline.checked import Checked
from missionc.pipeline.provenance import texts
from missionc.pipeline.results import NearMiss, Relaxation
from missionc.verify.verify_plan import verify


def near_miss(
    checked: Checked,
    backend: str,
    seed: int,
    relaxations: Iterable[tuple[Relaxation, Trace]],
    best: Attempt | None = None,
    scope: Scope | None = None,
) -> NearMiss | None:
    """With its files: ``near_miss.json``, ``near_miss.html``, and ``near_miss.svg`` where maps can be drawn.

    Args:
        backend, seed: what planned the motions, and with which seed.
        best: the candidate of a search that found no plan.
        scope: of the refusal, where there is one.
    """
    mission, kernel = checked.mission, checked.kernel
    assert mission is not None
    assert kernel is not None
    motions = [(each.says, trace) for each, trace in relaxations] + ([("", best.trace)] if best else [])
    misses = [(_miss(mission, kernel, trace), says) for says, trace in motions]
    near = [(miss, says) for miss, says in misses if miss is not None]
    if near:
        miss, says = max(near, key=lambda each: _by(each[0]))
    elif best is not None:
        miss, says = best, ""
    else:
        return None
    files = [
        ("near_miss.json", near_miss_json(mission, miss, says, scope).encode()),
        (
            "near_miss.html",
            _page(checked, mission, kernel, Plan(mission.name, backend, seed, miss.trace, miss.requirements), miss),
        ),
    ]
    picture = plot(mission, miss.trace, backend, "svg", miss)
    if not isinstance(picture, Diagnostic):
        files.append(("near_miss.svg", picture))
    return NearMiss(miss, says, tuple(files))


def _miss(mission: Mission, kernel: Kernel, trace: Trace) -> Attempt | None:
    """What a motion of this mission comes to that breaks one requirement, and nothing else."""
    if trace.position.shape[:2] != (len(mission.agents), mission.steps + 1):
        return None
    certificate = verify(mission, kernel, trace)
    if [failure.name for failure in certificate.failures] != ["requirement"]:
        return None
    miss = Attempt(certificate.judgements, (), trace)
    return miss if len(miss.violated) == 1 else None


def _by(miss: Attempt) -> float:
    robustness = miss.violated[0].robustness
    return robustness if math.isfinite(robustness) else -math.inf


def _page(checked: Checked, mission: Mission, kernel: Kernel, motion: Plan, miss: Attempt) -> bytes:
    """The report of a motion that is no plan: it has no polynomials, and says what is wrong with it."""
    certificate = verify(mission, kernel, motion.trace)
    return report(Plotted(mission, kernel, motion, certificate, {}, texts(checked), miss.violation(mission.step)))
