"""Diagnostics of a flight that cannot satisfy its mission: the requirement, the time, and alternatives.

says MC720 MC722 MC724
"""

from __future__ import annotations

from missionc.backends.api import Impossible
from missionc.base.diagnostics.code import NO_LONGER_KEPT, NO_SAFE_STOP, NOT_BY_THEN
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.compiler.front_end import Checked
from missionc.compiler.replan.request import Request
from missionc.compiler.results import Compiled
from missionc.ir import Mission
from missionc.verification.certificate import Check
from missionc.verification.monitoring.live.first_violations import first_violations

HOVER = "all agents can stop before then (proved; `--format json` lists the polynomials of the stops)"


def no_longer_kept(before: Checked, rest: Checked, request: Request) -> list[Diagnostic]:
    """Diagnostics of the requirements that no continuation satisfies, each with the time of its violation."""
    assert rest.rest is not None
    spans = {each.name: each.span for each in before.valid_mission.requirements}
    since = _since(before, request)
    findings = []
    for name in (*rest.rest.violated, *rest.rest.nobodys):
        lost = name in rest.rest.nobodys
        when = f"since {since[name]:g} s" if name in since else "with the current world and team"
        why = f"only lost agents could satisfy it: {', '.join(request.lost)}" if lost else f"violated {when}"
        findings.append(
            Diagnostic(
                NO_LONGER_KEPT,
                f"`{name}` can no longer be satisfied",
                Label(spans[name]) if name in spans else None,
                notes=(why,),
                help=f"drop this requirement with `--give-up {_word(name)}`",
            )
        )
    return findings


def _word(name: str) -> str:
    """The name of a requirement as a command-line argument, quoted if it contains a space."""
    return f"'{name}'" if " " in name else name


def _since(before: Checked, request: Request) -> dict[str, float]:
    """Time in seconds at which each violated requirement was first certainly violated by the flight, by name."""
    mission, kernel, trace = before.valid_mission, before.valid_kernel, request.so_far.trace
    return {name: float(step * mission.step) for name, step in first_violations(mission, kernel, trace).items()}


def no_safe_stop(mission: Mission, failed: tuple[Check, ...]) -> Diagnostic:
    """Diagnostic of a team for which no stop without contact and within the vehicles' limits was found."""
    worst = min(failed, key=lambda check: check.margin, default=None)
    if worst is None:
        message = "too little time to stop before the plan ends"
        return Diagnostic(NO_SAFE_STOP, message, Label(mission.span), help="follow the plan to its end")
    who = ", ".join(worst.agents)
    what, note = f"without a collision: {who} at {worst.subject}", "overlap"
    if worst.name.startswith("flown"):
        what, note = f"that satisfies `{worst.name}`: {who}", "violated by"
    return Diagnostic(
        NO_SAFE_STOP,
        f"no stop of all agents was found {what}",
        Label(mission.span),
        notes=(f"{note} {-worst.margin:.2f} {worst.unit}",),
        help="land the blocking agents and name them with `--lost`",
    )


def nobody_left(mission: Mission) -> Diagnostic:
    return Diagnostic(NO_LONGER_KEPT, "all agents are lost", Label(mission.span), help="start a new mission")


def no_plan_in_time(rest: Checked, compiled: Compiled) -> tuple[Diagnostic, ...]:
    """Diagnostics of a replanning attempt that found no plan."""
    if isinstance(compiled.outcome, Impossible):
        names = compiled.outcome.conflict
        way = f"drop this requirement with `--give-up {_word(names[0])}`" if names else "land"
    else:
        way = "allow more time with `--within`"
    mine = Diagnostic(NOT_BY_THEN, "no new plan was ready in time", None, notes=(HOVER,), help=way)
    return (*(each for each in compiled.findings if not each.code.warning), mine)
