"""Closest infeasible candidate: of the available trajectories, the one with the smallest violation.

in   original Mission, its kernel, plans of relaxed missions, a search's best candidate
out  NearMiss, if one of them violates only one requirement, or there is a candidate
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import PurePath

from missionc.backends.api import Attempt, Scope
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.late_dataclass import Record
from missionc.base.trace import Plan, Trace
from missionc.compiler.front_end import Checked
from missionc.compiler.provenance import texts
from missionc.compiler.results import NearMiss, Relaxation, Trial
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Kernel
from missionc.output.documents.near_miss_json import near_miss_json
from missionc.output.folder.manifest import sha256
from missionc.output.plot.plot import plot
from missionc.output.report.report_html import Plotted, report
from missionc.verification.verify_plan import verify

MOST_PLAYED = 12
"""Maximum number of suggested changes whose plans the page can replay; further ones are shown as text only."""


class Remedy(Record, eq=False):
    """A relaxed mission, with its verified plan."""

    checked: Checked
    trace: Trace


class Advice(Record, eq=False):
    """Explanation of the infeasibility for the page: the conflicting requirements, and the variants that were tried."""

    conflict: tuple[str, ...] = ()
    trials: tuple[Trial, ...] = ()


def near_miss(
    checked: Checked,
    backend: str,
    seed: int,
    relaxations: Sequence[tuple[Relaxation, Remedy]],
    best: Attempt | None = None,
    scope: Scope | None = None,
    advice: Advice | None = None,
) -> NearMiss | None:
    """Closest infeasible candidate with its files, or None if there is none.

    The files are ``near_miss.json``, ``near_miss.html``, and ``near_miss.svg`` if maps can be drawn.

    Args:
        backend, seed: backend and seed of the trajectories.
        relaxations: suggested changes, each with the plan of the relaxed mission.
        best: candidate of a search without a plan.
        scope: scope of the proof of infeasibility, if any.
        advice: explanation for the page.
    """
    mission, kernel = checked.valid_mission, checked.valid_kernel
    motions = [(each.says, remedy.trace) for each, remedy in relaxations] + ([("", best.trace)] if best else [])
    misses = [(_miss(mission, kernel, trace), says) for says, trace in motions]
    near = [(miss, says) for miss, says in misses if miss is not None]
    if near:
        miss, says = max(near, key=lambda each: _by(each[0]))
    elif best is not None:
        miss, says = best, ""
    else:
        return None
    document = near_miss_json(mission, miss, says, scope).encode()
    plan = Plan(mission.name, backend, seed, miss.trace, miss.requirements)
    certificate = verify(mission, kernel, miss.trace)
    violation = miss.violation(mission.step)
    shown = Plotted(mission, kernel, plan, certificate, {}, texts(checked), violation, digest=sha256(document))
    told = _told(advice or Advice(), violation, [relaxation for relaxation, _ in relaxations])
    page = report(shown, advice=(told, [_played(each, backend, seed) for _, each in relaxations[:MOST_PLAYED]]))
    files = [("near_miss.json", document), ("near_miss.html", page)]
    picture = plot(mission, miss.trace, backend, "svg", miss)
    if not isinstance(picture, Diagnostic):
        files.append(("near_miss.svg", picture))
    return NearMiss(miss, says, tuple(files))


def _miss(mission: Mission, kernel: Kernel, trace: Trace) -> Attempt | None:
    """Evaluation of a trajectory that violates exactly one requirement of this mission.

    None for any other trajectory.
    """
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


def _played(remedy: Remedy, backend: str, seed: int) -> Plotted:
    """Plan of a relaxed mission, without polynomials, as the page needs it."""
    mission, kernel = remedy.checked.valid_mission, remedy.checked.valid_kernel
    certificate = verify(mission, kernel, remedy.trace)
    plan = Plan(mission.name, backend, seed, remedy.trace, certificate.judgements)
    return Plotted(mission, kernel, plan, certificate, {}, texts(remedy.checked))


def _told(advice: Advice, violation: str, relaxations: Sequence[Relaxation]) -> dict[str, object]:
    """Explanation in the page's format; the plan of a change is numbered after the candidate."""
    return {
        "conflict": list(advice.conflict),
        "trials": [{"change": trial.says, "outcome": trial.outcome} for trial in advice.trials],
        "miss": violation,
        "changes": [
            {
                "change": each.says,
                "edits": [
                    {
                        "file": PurePath(edit.file).name,
                        "line": edit.line,
                        "before": edit.before,
                        "after": edit.after,
                    }
                    for edit in each.changes
                ],
                "smallest": each.smallest,
                "proven": each.proven,
                "guards": each.guards,
                "plan": rank if rank <= MOST_PLAYED + 1 else None,
            }
            for rank, each in enumerate(relaxations, 2)
        ],
    }
