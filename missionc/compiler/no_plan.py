"""Diagnostics for a mission without a plan: one message for each reason.

says MC564 MC570 MC601 to MC609 MC710
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from missionc.backends.api import Impossible, NotFound, Planned, Progress, Reason, Scope
from missionc.backends.choose_backend import choose_backend
from missionc.backends.registry import AUTO, BACKENDS
from missionc.base.diagnostics import code as codes
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.units import Seconds
from missionc.compiler.front_end import Checked
from missionc.compiler.results import Explained, Trial
from missionc.compiler.run_limited import Ended
from missionc.ir import Mission

if TYPE_CHECKING:
    from missionc.verification.verify_plan import Certificate


def impossible(mission: Mission, outcome: Impossible, explained: Explained | None) -> Diagnostic:
    """Diagnostic of the requirements in conflict, each with its location: infeasible on roadmaps, or for any motion."""
    spans = [(each.name, each.span) for each in mission.requirements if each.name in outcome.conflict]
    doubt = (outcome.doubt,) if outcome.doubt else ()
    notes = (outcome.statement, *doubt, *(_blamed(explained) if explained else ()), *outcome.report.notes)
    proven = outcome.scope is Scope.MISSION
    code, where = (codes.NO_MOTION, "by any motion of these agents") if proven else (codes.IMPOSSIBLE, "on the roadmap")
    if not spans:
        return Diagnostic(
            code,
            "no motion of these agents is feasible, even without the requirements"
            if proven
            else "no plan exists on the roadmap, even without the requirements",
            Label(mission.time_span or mission.span, "time available"),
            notes=notes,
            help="check the starts and finishes",
        )
    way_out = "relax one of these requirements" if proven else _roadmap(mission)
    return Diagnostic(
        code,
        f"{outcome.says} {where}",
        Label(spans[0][1], "conflicting requirement" if len(spans) > 1 else ""),
        tuple(Label(span, "conflicting requirement") for _, span in spans[1:]),
        notes,
        _smallest(explained) if explained and explained.relaxations else way_out,
    )


def _roadmap(mission: Mission) -> str:
    """Suggestion for a change of the roadmap that may make the mission feasible."""
    lanes = mission.solve.roadmap
    finer = "use a finer roadmap: `solve with smt { nodes = 400 }`"
    return finer if lanes is None else f"add nodes and lanes to `{lanes.path}`"


def _smallest(explained: Explained) -> str:
    first, *others = explained.relaxations
    safe = not first.guards and any(each.guards and each.size < first.size for each in others)
    which = "smallest change that works without loosening safety" if safe else "smallest change that works"
    return f"apply the {which}: {first.says}"


def _blamed(explained: Explained) -> tuple[str, ...]:
    """Sentences on the cause of the conflict, and on the variants of the mission whose results show it."""
    who = {
        "REQUIREMENTS": "",
        "HORIZON": "the mission is too short",
        "ROADMAP": "these roadmaps are too coarse",
        "UNKNOWN": "",
    }[explained.blame.name]
    planned = any(trial.outcome == "planned" for trial in explained.trials)
    says = {
        "planned": "gives a plan",
        "impossible": "gives no plan" if planned else "gives no plan on roadmaps",
        "undecided": "gives no answer in time",
    }
    trials = [
        f"{_variants([trial for trial in explained.trials if trial.outcome == outcome])} {words}"
        for outcome, words in says.items()
        if any(trial.outcome == outcome for trial in explained.trials)
    ]
    head = ": ".join(filter(None, (who, "; ".join(trials))))
    return (head,) if head else ()


def _variants(trials: Sequence[Trial]) -> str:
    """Text for variants of the mission that were tried, such as ``dropping `relay` or `rescue```."""
    dropped = [trial.says.removeprefix(WITHOUT) for trial in trials if trial.says.startswith(WITHOUT)]
    others = [trial.says for trial in trials if not trial.says.startswith(WITHOUT)]
    return " or ".join([*([f"dropping {' or '.join(dropped)}"] if dropped else []), *others])


WITHOUT = "without "
"""Prefix in the description of a variant that drops requirements."""


def not_found(checked: Checked, outcome: NotFound, explained: Explained | None) -> Diagnostic:
    """Diagnostic of a search without a plan: the reason for its end, the best candidate's violations, and one
    suggestion.
    """
    code, help_ = {
        "TIME": (codes.OUT_OF_TIME, "raise the limit with `--time-limit`"),
        "MEMORY": (codes.OUT_OF_MEMORY, "raise the limit with `--memory-limit`"),
        "SIZE": (codes.PROBLEM_TOO_LARGE, "raise the limit with `--limit clauses=…`"),
        "METHOD": (
            codes.METHOD_ENDED,
            "plan without `--preset`",
        ),
        "NO_ROADMAP": (codes.NO_ROADMAP, "check the starts, the dynamics and the space between obstacles"),
        "SOLVER": (codes.SOLVER_GAVE_UP, "try another seed with `--seed`"),
    }[outcome.reason.name]
    if outcome.reason not in (Reason.TIME, Reason.MEMORY) and checked.choice and _is_foreign(checked.choice.backend):
        help_ = "try another seed with `--seed`"
    head, *more = outcome.says
    mission, kernel = checked.mission, checked.kernel
    if outcome.best is not None and mission is not None and kernel is not None:
        from missionc.compiler.diagnose_candidate import diagnose

        diagnosis = diagnose(mission, kernel, outcome.best)
        more += diagnosis.notes
        help_ = diagnosis.advice or help_
    return Diagnostic(
        code,
        head,
        None,
        notes=(*more, *outcome.report.notes, *_others(checked), "a plan may still exist"),
        help=_smallest(explained) if explained and explained.relaxations else help_,
    )


def _is_foreign(backend: str) -> bool:
    """Return whether a backend is defined by an extension, and so has no presets, solvers or roadmaps."""
    return backend not in BACKENDS.built_in


def _others(checked: Checked) -> list[str]:
    """Suggestion of another engine that can plan the mission, as a list.

    Empty if several were used or none is available.
    """
    if checked.mission is None or checked.choice is None:
        return []
    able, _ = choose_backend(checked.mission, AUTO)
    others = [] if able is None else [name for name in able.engines if name not in checked.choice.engines]
    return (
        [f"`--backend {others[0]}` can also plan this mission"] if others and len(checked.choice.engines) == 1 else []
    )


def not_brought_home(ended: Ended, planned: Planned, seconds: Sequence[tuple[str, Seconds]]) -> NotFound:
    """Outcome if a limit was reached after a plan was found, but before it was verified and written.

    Args:
        seconds: duration of each stage.
    """
    searched = sum(spent for _, spent in planned.report.seconds)
    stage = Progress(seconds[-1][0] if seconds else "verify")
    statement = f"a plan was found in {searched:.1f} s, but not verified: {ended.during(stage.activity)}"
    return NotFound(ended.reason, statement, planned.report)


def not_between(mission: Mission, certificate: Certificate) -> tuple[Diagnostic, ...]:
    """Diagnostics of the requirements that fail, or are undecided, between the steps."""
    spans = {each.name: each.span for each in mission.requirements}
    return tuple(
        Diagnostic(
            codes.NOT_BETWEEN,
            each.detail,
            Label(spans[each.requirement], ""),
            help="use a shorter time step",
        )
        for each in certificate.at_steps_alone
    )


def not_tolerated(mission: Mission, certificate: Certificate) -> Diagnostic:
    """Diagnostic of a required delay tolerance that the plan does not have, with the violated check."""
    checks = {check.subject: check for check in certificate.failures}
    asked = [
        tolerance
        for tolerance in mission.tolerances
        if any(mission.agents[agent].name in checks for agent in tolerance.agents)
    ]
    return Diagnostic(
        codes.NOT_TOLERATED,
        f"undecided: {Reason.DELAY.value}",
        Label(asked[0].span, ""),
        tuple(Label(each.span, "") for each in asked[1:]),
        notes=tuple(f"{check.subject}: {check.detail}" for check in list(checks.values())[:MOST_LATE]),
        help="tolerate a shorter delay",
    )


MOST_LATE = 4
"""Maximum number of agents listed in a message on delay tolerance."""


def not_verified(certificate: Certificate, backend: str) -> Diagnostic:
    """Diagnostic of a plan that verification rejects: a defect of the compiler, or of the extension with the
    backend.
    """
    ours = not _is_foreign(backend)
    return Diagnostic(
        codes.NOT_VERIFIED if ours else codes.REJECTED_PLAN,
        "internal error: the plan found fails verification"
        if ours
        else f"the plan of the backend `{backend}` fails verification",
        None,
        notes=tuple(
            f"{check.name} {check.subject}: margin {check.margin:g} {check.unit}"
            + (f", {check.detail}" if check.name == "rule" else "")
            for check in certificate.failures[:5]
        ),
        help="report this bug with the mission and the seed"
        if ours
        else f"report this bug to the authors of `{backend}`",
    )
