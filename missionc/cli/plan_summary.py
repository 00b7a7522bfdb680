"""Summary of a plan in at most five lines: verdict, smallest margins, lower bound, warnings, path of the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from missionc.base.trace import counted, decimals
from missionc.base.units import Seconds
from missionc.ir import PLAIN, Mission
from missionc.ir.wording import listed
from missionc.output.folder.file_names import REPORT

if TYPE_CHECKING:
    from missionc.base.trace import Judgement
    from missionc.compiler.results import Verified
    from missionc.verification.certificate import Between, Certificate, Check

WHOLE = "whole flight"
"""Name of the certificate's quantity for the duration from takeoff to landing."""

MOST_WARNED = 2
"""Maximum number of requirements and of warnings that are listed; others are only counted."""


def plan_lines(
    verified: Verified,
    mission: Mission,
    seconds: Seconds,
    output: str,
    verbose: bool = False,
    further: Sequence[str] = (),
) -> list[str]:
    """Lines with the verdict, smallest margins, objective and its lower bound, warnings, and the path of the report.

    Args:
        verified: verified plan.
        mission: its mission.
        seconds: duration of the compilation.
        output: the written folder, or empty.
        verbose: if true, each warning has a line.
        further: lines before the path.
    """
    plan, certificate, cut_short = verified.plan, verified.certificate, verified.report.cut_short
    early = cut_short.note if cut_short else ""
    warnings = [*warnings_of(certificate), *filter(None, (early, without_vehicle(mission)))]
    return [
        f"{plan.mission}: verified in {seconds:.1f} s: {counted(len(mission.agents), 'agent')} for "
        f"{mission.horizon:g} s, planned by {plan.backend}, seed {plan.seed}{_flown(mission, certificate)}",
        *worst_margins(plan.judgements, certificate),
        *([f"  {plan.proven}"] if plan.proven else []),
        *warning_lines(warnings, verbose),
        *further,
        *([f"  report: {Path(output) / REPORT}"] if output else []),
    ]


def worst_margins(judgements: Sequence[Judgement], certificate: Certificate) -> list[str]:
    """Texts about the requirement with the smallest robustness, and the smallest margin between bodies."""
    says = []
    if judgements:
        least = min(judgements, key=lambda each: each.robustness)
        amount = f"{decimals(max(least.robustness, 0.0))} {least.unit}".rstrip()
        says.append(f"`{least.name}` {amount}")
    apart = [each for each in certificate.checks if each.name in ("separation", "flown separation")]
    if apart:
        says.append(_room(min(apart, key=lambda check: check.margin)))
    return [f"  smallest margins: {'; '.join(says)}"] if says else []


def _room(check: Check) -> str:
    """Text about the separation margin of two agents: their distance minus the required one."""
    when = "" if check.at is None else f" at {round(check.at, 2):g} s"
    return f"separation of {listed(check.agents)} {decimals(max(check.margin, 0.0))} m{when}"


def warning_lines(warnings: Sequence[str], verbose: bool) -> list[str]:
    """One line with the number of warnings and the first of them, or a line for each; empty without warnings."""
    if len(warnings) <= 1:
        return [f"  warning: {each}" for each in warnings]
    if verbose:
        return [f"  {len(warnings)} warnings", *(f"    {each}" for each in warnings)]
    more = len(warnings) - MOST_WARNED
    shown = "; ".join(warnings[:MOST_WARNED] if more > 1 else warnings)
    return [f"  {len(warnings)} warnings: {shown}" + (f"; {more} more with `-v`" if more > 1 else "")]


def warnings_of(certificate: Certificate) -> list[str]:
    """Warnings of a certificate: requirements violated between samples, distances of polynomials, preferences."""
    names = [f"`{each.subject}`" for each in certificate.figures if each.name == "preference" and each.value < 0]
    return [
        *([between_samples(certificate.at_steps_alone)] if certificate.at_steps_alone else []),
        *certificate.warnings,
        *([f"{counted(len(names), 'preference')} not satisfied ({', '.join(names)})"] if names else []),
    ]


def between_samples(violated: Sequence[Between]) -> str:
    """Sentence on requirements that are violated between samples: ``relay`` is violated between samples
    (1.04–1.69 s).
    """
    more = len(violated) - MOST_WARNED
    return ", ".join(map(_between, violated[:MOST_WARNED])) + (f" and {more} more" if more > 0 else "")


def _between(each: Between) -> str:
    from missionc.verification.certificate import Verdict  # evaluation of plans loads arrays

    violated = "is violated" if each.verdict is Verdict.FAILS else "may be violated"
    if each.at is None:
        return f"`{each.requirement}` {violated} between samples"
    when = f"{each.at:.2f}" if each.until is None or each.until == each.at else f"{each.at:.2f}–{each.until:.2f}"
    return f"`{each.requirement}` {violated} between samples ({when} s)"


def without_vehicle(mission: Mission) -> str:
    """Warning that agents have no vehicle, so that flyability was not checked; empty if all have one."""
    without = sum(agent.vehicle.name == PLAIN.name for agent in mission.agents)
    if not without:
        return ""
    of = "" if without == len(mission.agents) else f" for {counted(without, 'agent')}"
    return f"no vehicle set{of}, so flyability was not checked (add `--vehicle crazyflie21`)"


def _flown(mission: Mission, certificate: Certificate) -> str:
    """End of the verdict: vehicles that can fly the plan, and the duration from takeoff to landing."""
    named = sorted({agent.vehicle.name for agent in mission.agents if agent.vehicle.name != PLAIN.name})
    whole = [figure.value for figure in certificate.figures if figure.name == WHOLE]
    return "".join(
        (
            f"; flyable by {listed(tuple(f'`{name}`' for name in named))}" if named else "",
            *(f"; {each:.4g} s from takeoff to landing" for each in whole),
        )
    )
