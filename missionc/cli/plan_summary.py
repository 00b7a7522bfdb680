"""The summary of a plan in eight lines at most: that it is verified, how narrowly, what to be warned of, its page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from missionc.base.figures import counted, decimals
from missionc.base.solved import solved_text
from missionc.base.units import Seconds
from missionc.frontend.resolve.resolve_files import file_lines
from missionc.ir import PLAIN, Mission
from missionc.ir.wording import listed
from missionc.output.folder.file_names import REPORT

if TYPE_CHECKING:
    from missionc.backends.api import Report
    from missionc.base.judgement import Judgement
    from missionc.compiler.results import Verified
    from missionc.verification.certificate import Between, Certificate, Check

WHOLE = "whole flight"
"""The figure of a certificate that says how long that takes."""

MOST_WARNED = 2
"""Requirements, and warnings, that are told; of more how many there are."""


def plan_lines(verified: Verified, mission: Mission, seconds: Seconds, output: str) -> list[str]:
    """What everybody has to know of a plan; ``output`` is the folder written, or empty.

    Args:
        seconds: that the compilation took.
    """
    plan, certificate = verified.plan, verified.certificate
    return [
        f"{plan.mission}: verified in {seconds:.1f} s: {counted(len(mission.agents), 'agent')} for "
        f"{mission.horizon:g} s, planned by {plan.backend}, seed {plan.seed}",
        *([f"  {solved_text(plan.solved)}"] if plan.solved else []),
        *_files(mission),
        *worst_margins(plan.judgements, certificate),
        *([f"  {plan.proven}"] if plan.proven else []),
        *warning_lines(certificate),
        *_cut_short(verified.report),
        f"  {who_flies(mission)}",
        *_floor_to_floor(certificate),
        *([f"  report: {Path(output) / REPORT}"] if output else []),
    ]


def _files(mission: Mission) -> list[str]:
    """A line for each of the first files that the mission reads, and one for all others."""
    lines = [f"  {line}" for line in file_lines(mission)]
    more = len(lines) - MOST_WARNED
    return lines if more <= 1 else [*lines[:MOST_WARNED], f"  {more} more files, with -v"]


def worst_margins(judgements: Sequence[Judgement], certificate: Certificate) -> list[str]:
    """The requirement with the least robustness, and the least room between bodies."""
    says = []
    if judgements:
        least = min(judgements, key=lambda each: each.robustness)
        amount = f"{decimals(least.robustness)} {least.unit}".rstrip()
        says.append(f"`{least.name}` {amount}")
    apart = [each for each in certificate.checks if each.name in ("separation", "flown separation")]
    if apart:
        says.append(_room(min(apart, key=lambda check: check.margin)))
    return [f"  smallest margins: {'; '.join(says)}"] if says else []


def _room(check: Check) -> str:
    """The separation margin of two agents: the distance beyond the required separation."""
    when = "" if check.at is None else f" at {round(check.at, 2):g} s"
    return f"separation of {listed(check.agents)} {decimals(check.margin)} m{when}"


def warning_lines(certificate: Certificate) -> list[str]:
    """One line on what holds at the steps alone, and one for each warning of the certificate."""
    warnings = [*([at_steps(certificate.at_steps_alone)] if certificate.at_steps_alone else []), *certificate.warnings]
    more = len(warnings) - MOST_WARNED
    shown = warnings[:MOST_WARNED] if more > 1 else warnings
    return [f"  warning: {each}" for each in shown] + ([f"  warning: {more} more, with -v"] if more > 1 else [])


def at_steps(alone: Sequence[Between]) -> str:
    """``satisfied at the samples; `relay` is violated between, 1.04–1.69 s``"""
    told = "; ".join(_between(each) for each in alone[:MOST_WARNED])
    more = len(alone) - MOST_WARNED
    return f"satisfied at the samples; {told}" + (f"; and {more} more" if more > 0 else "")


def _between(each: Between) -> str:
    from missionc.verification.certificate import Verdict  # what judges plans loads arrays

    violated = "is violated" if each.verdict is Verdict.FAILS else "may be violated"
    if each.at is None:
        return f"`{each.requirement}` {violated} between"
    when = f"{each.at:.2f}" if each.until is None or each.until == each.at else f"{each.at:.2f}–{each.until:.2f}"
    return f"`{each.requirement}` {violated} between, {when} s"


def who_flies(mission: Mission) -> str:
    """Whether a vehicle can fly the plan, as far as that was asked."""
    named = {agent.vehicle.name for agent in mission.agents if agent.vehicle.name != PLAIN.name}
    without = sum(agent.vehicle.name == PLAIN.name for agent in mission.agents)
    if not named:
        return "no vehicle set, so flyability was not checked; add `--vehicle crazyflie21` to check it"
    flown = f"{listed(tuple(f'`{name}`' for name in sorted(named)))} can fly it, proved between samples"
    return flown + (f"; no vehicle set for {counted(without, 'agent')}" if without else "")


def _floor_to_floor(certificate: Certificate) -> list[str]:
    """How long the whole flight takes, of a mission that comes from the floor."""
    seconds = [figure.value for figure in certificate.figures if figure.name == WHOLE]
    return [f"  whole flight, from takeoff to landing: {each:.4g} s, proved on all paths" for each in seconds]


def _cut_short(report: Report) -> list[str]:
    return [f"  note: {report.cut_short.note}"] if report.cut_short else []
