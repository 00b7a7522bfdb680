"""Diagnostics for a mission without a plan: one message for each way to end without.

says MC564 MC570 MC601 to MC609 MC710
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from missionc.backends.api import Impossible, NotFound, Planned, Reason, Scope
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
    """The requirements in conflict, each at its place: on roadmaps, or whatever the motion."""
    spans = [(each.name, each.span) for each in mission.requirements if each.name in outcome.conflict]
    doubt = (outcome.doubt,) if outcome.doubt else ()
    notes = (outcome.statement, *doubt, *(_blamed(explained) if explained else ()), *outcome.report.notes)
    proven = outcome.scope is Scope.MISSION
    code, where = (codes.NO_MOTION, "by any motion of these agents") if proven else (codes.IMPOSSIBLE, "on the roadmap")
    if not spans:
        return Diagnostic(
            code,
            "no motion of these agents is a plan, whatever the requirements"
            if proven
            else "no plan exists on the roadmap, whatever the requirements",
            Label(mission.time_span or mission.span, "in this time"),
            notes=notes,
            help="give the agents more time or more room, or look at their starts and finishes",
        )
    room = "more room" if proven else _roadmap(mission)
    return Diagnostic(
        code,
        f"{outcome.says} {where}",
        Label(spans[0][1], "this" if len(spans) > 1 else ""),
        tuple(Label(span, "and this") for _, span in spans[1:]),
        notes,
        _smallest(explained)
        if explained and explained.relaxations
        else f"relax one of them, give the agents more time, or {room}",
    )


def _roadmap(mission: Mission) -> str:
    """What a roadmap might have that would help."""
    lanes = mission.solve.roadmap
    finer = "a finer roadmap: `solve with smt { nodes = 400 }`"
    return finer if lanes is None else f"more nodes and lanes in `{lanes.path}`"


def _smallest(explained: Explained) -> str:
    first, *others = explained.relaxations
    safe = not first.guards and any(each.guards and each.size < first.size for each in others)
    which = ", has a plan and keeps others safe" if safe else " and has a plan"
    return f"the smallest change that was tried{which}: {first.says}"


def _blamed(explained: Explained) -> tuple[str, ...]:
    """Who is to blame, and by which trials that is known."""
    who = {
        "REQUIREMENTS": "",
        "HORIZON": "the mission is too short",
        "ROADMAP": "it is these roadmaps that are too coarse",
        "UNKNOWN": "",
    }[explained.blame.name]
    planned = any(trial.outcome == "planned" for trial in explained.trials)
    says = {
        "planned": "gives a plan",
        "impossible": "does not" if planned else "leaves none on roadmaps",
        "undecided": "gave none in time",
    }
    trials = [
        f"{_variants([trial for trial in explained.trials if trial.outcome == outcome])} {words}"
        for outcome, words in says.items()
        if any(trial.outcome == outcome for trial in explained.trials)
    ]
    head = ": ".join(filter(None, (who, "; ".join(trials))))
    return (head,) if head else ()


def _variants(trials: Sequence[Trial]) -> str:
    """``dropping `relay` or `rescue```, or what was tried otherwise; more than one joined by *or*."""
    dropped = [trial.says.removeprefix(WITHOUT) for trial in trials if trial.says.startswith(WITHOUT)]
    others = [trial.says for trial in trials if not trial.says.startswith(WITHOUT)]
    return " or ".join([*([f"dropping {' or '.join(dropped)}"] if dropped else []), *others])


WITHOUT = "without "
"""How a trial begins that leaves requirements out."""


def not_found(checked: Checked, outcome: NotFound, explained: Explained | None) -> Diagnostic:
    """Why the search ended, what its best candidate fails, and one thing to try that follows from it."""
    code, help_ = {
        "TIME": (codes.OUT_OF_TIME, "allow more with `--time-limit`"),
        "MEMORY": (codes.OUT_OF_MEMORY, "allow more with `--memory-limit`"),
        "SIZE": (codes.PROBLEM_TOO_LARGE, "allow more with `--limit clauses=…`, or use fewer nodes, steps or agents"),
        "METHOD": (
            codes.METHOD_ENDED,
            "leave `--preset` out, or try another roadmap with `--seed`, `nodes` or `neighbors`",
        ),
        "NO_ROADMAP": (codes.NO_ROADMAP, "look at the starts, the dynamics and the room between obstacles"),
        "SOLVER": (codes.SOLVER_GAVE_UP, "try another seed with `--seed`, or another solver with `--solver`"),
    }[outcome.reason.name]
    head, *more = outcome.says
    mission, kernel = checked.mission, checked.kernel
    if outcome.best is not None and mission is not None and kernel is not None:
        from missionc.compiler.diagnose_candidate import diagnose

        diagnosis = diagnose(mission, kernel, outcome.best)
        more += diagnosis.notes
        searched_enough = diagnosis.late and outcome.reason is Reason.TIME
        help_ = "; or ".join([diagnosis.advice] * bool(diagnosis.advice) + [help_] * (not searched_enough))
    elif outcome.reason is Reason.TIME and not outcome.report.tried:
        help_ = f"{help_}, or make the mission smaller: fewer agents, a longer time step, a shorter horizon"
    help_ = "; or ".join([help_, *_others(checked)])
    return Diagnostic(
        code,
        head,
        None,
        notes=(*more, *outcome.report.notes, "this says nothing about whether a plan exists"),
        help=f"{help_}; {_smallest(explained)}" if explained and explained.relaxations else help_,
    )


def _others(checked: Checked) -> list[str]:
    """That another engine plans such a mission too, where one alone was asked."""
    if checked.mission is None or checked.choice is None:
        return []
    able, _ = choose_backend(checked.mission, AUTO)
    others = [] if able is None else [name for name in able.engines if name not in checked.choice.engines]
    return [f"ask another engine: `--backend {others[0]}`"] if others and len(checked.choice.engines) == 1 else []


def not_brought_home(ended: Ended, planned: Planned, seconds: Sequence[tuple[str, Seconds]]) -> NotFound:
    """A plan was found, and a limit came before it was verified and written; ``seconds`` are those of each stage."""
    searched = sum(spent for _, spent in planned.report.seconds)
    stage = seconds[-1][0] if seconds else "verify"
    statement = f"a plan was found in {searched:.1f} s, and not yet verified and written: {ended.during(stage)}"
    return NotFound(ended.reason, statement, planned.report)


def not_between(mission: Mission, certificate: Certificate) -> tuple[Diagnostic, ...]:
    """Each requirement that fails between the steps, or of which that is not known."""
    spans = {each.name: each.span for each in mission.requirements}
    return tuple(
        Diagnostic(
            codes.NOT_BETWEEN,
            each.detail,
            Label(spans[each.requirement], ""),
            help="ask for a little more than is needed, or take a shorter time step",
        )
        for each in certificate.at_steps_alone
    )


def not_tolerated(mission: Mission, certificate: Certificate) -> Diagnostic:
    """Whose delay a plan that is right otherwise does not tolerate, and what it breaks."""
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
        help="let less be tolerated, give the agents more time or a larger `separation`, or try another `--seed`",
    )


MOST_LATE = 4
"""Agents that a message names, of those whose delays a plan does not tolerate."""


def not_verified(certificate: Certificate, backend: str) -> Diagnostic:
    """Report a plan that verification rejects: a defect of the compiler, or of an extension whose backend found it."""
    ours = backend in BACKENDS.built_in
    return Diagnostic(
        codes.NOT_VERIFIED if ours else codes.REJECTED_PLAN,
        "a plan was found, but it does not pass verification: a defect of the compiler"
        if ours
        else f"the plan of the backend `{backend}` does not pass verification",
        None,
        notes=tuple(
            f"{check.name} {check.subject}: margin {check.margin:g} {check.unit}" for check in certificate.failures[:5]
        ),
        help="report it with the mission and the seed; another `--seed` may do meanwhile"
        if ours
        else f"report it to the authors of `{backend}`, or plan with `--backend auto`",
    )
