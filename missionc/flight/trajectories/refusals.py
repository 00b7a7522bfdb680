"""Diagnostics of unflyable plans: no polynomials, or a longer time is needed.

says MC703 MC711
"""

from __future__ import annotations

import math

from missionc.base.diagnostics.code import NEEDS_MORE_TIME, NOT_FLYABLE
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.trace import Judgement
from missionc.flight.trajectories.vehicle_limits import Peak
from missionc.ir import PLAIN, Mission
from missionc.verification.certificate import TUBE, Certificate, Check

NEARLY_WHOLE = 1.25
"""Ratio up to which an integer stretch factor is preferred to the needed one, since it preserves the plan's corners."""
GRID = 20
"""Denominator of proposed stretch factors that are not integers."""
MOST_REASONS = 4


def not_flyable(mission: Mission, tried: list[Check]) -> Diagnostic:
    """Diagnostic of a plan for which no polynomials are valid, with the failure of the nearest attempt.

    Args:
        tried: the worst check of each attempt with polynomials.
    """
    failed = max(tried, key=lambda check: (check.at is not None, check.margin), default=None)
    plain = all(agent.vehicle == PLAIN for agent in mission.agents)
    spans = {agent.name: agent.span for agent in mission.agents}
    names = failed.agents if failed and failed.agents else (mission.agents[0].name,)
    who = " and ".join(f"`{name}`" for name in names)
    message, why = f"no polynomials fit the plan of {who}", "no curve near the plan was found"
    help_ = "use a larger `step`"
    match failed:
        case Check(name="flown obstacle", subject=obstacle, margin=margin, at=float(at)) if plain:
            message += f": a collision with `{obstacle}` at {at:.2f} s"
            why = f"the best curve overlaps by {-margin - mission.clearance:.3g} m"
            help_ = f"use a `clearance` above {mission.clearance:g} m"
        case Check(name="flown separation", margin=margin, at=float(at)) if plain:
            message += f": a collision at {at:.2f} s"
            why = f"the best curves overlap by {-margin - mission.separation:.3g} m"
            help_ = f"use a `separation` above {mission.separation:g} m"
        case Check(name=name, margin=margin, unit=unit, at=float(at)):
            message += f" at {at:.2f} s"
            why = f"the best curves violate `{name}` by {-margin:.3g} {unit}".rstrip()
            if name in ("flown downwash", "flown separation"):
                help_ = "use a larger `separation`"
        case _:
            pass
    return Diagnostic(
        NOT_FLYABLE,
        message,
        Label(spans[names[0]]),
        notes=(why, f"the curves must start and end at rest, within {TUBE:g} m of the verified motion"),
        help=help_,
    )


def too_fast(mission: Mission, peaks: tuple[tuple[str, Peak], ...], stretch: float) -> Diagnostic:
    """Diagnostic of a flight that exceeds vehicle limits, with the stretch of the duration that it needs.

    Args:
        peaks: exceeded limits by agent name; at least one.
        stretch: present stretch factor of the plan.
    """
    worst: dict[str, tuple[str, Peak]] = {}
    for name, peak in sorted(peaks, key=lambda entry: -entry[1].stretch):
        worst.setdefault(peak.limit.name, (name, peak))
    (first, most), *others = worst.values()
    agent = next(agent for agent in mission.agents if agent.name == first)
    needed = stretch * most.stretch
    return Diagnostic(
        NEEDS_MORE_TIME,
        f"the plan is too fast for `{first}`: {_reached(most)} at {most.at:.2f} s; `{agent.vehicle.name}` "
        f"allows {_allowed(most)}",
        Label(agent.span),
        notes=(
            *(f"{_reached(peak)} of `{name}` at {peak.at:.2f} s; {_allowed(peak)} allowed" for name, peak in others),
            f"the flight satisfies all limits if it is {needed:.3g} times slower",
        ),
        help=f"fly the plan slower with `--stretch {proposed(needed):g}`",
    )


def proposed(needed: float) -> float:
    """Stretch factor of at least ``needed`` that is a short number."""
    whole = float(math.ceil(needed))
    return whole if whole <= NEARLY_WHOLE * needed else math.ceil(needed * GRID) / GRID


def not_slower(
    mission: Mission, certificate: Certificate, judgements: tuple[Judgement, ...], stretch: float
) -> Diagnostic:
    """Diagnostic of a stretched plan that violates requirements or other conditions."""
    broken = [each for each in judgements if not each.satisfied]
    spans = {requirement.name: requirement.span for requirement in mission.requirements}
    names = " and ".join(f"`{each.name}`" for each in broken)
    other = [check for check in certificate.failures if check.name != "requirement"]
    what = f"violates {names}" if broken else "is not valid"
    if broken:
        help_ = f"make the window of {names} later or wider"
    elif any(check.name == "speed" for check in other):
        help_ = "allow a lower speed in `dynamics`"
    else:
        help_ = "use a whole number" if stretch % 1 else "use another number"
    return Diagnostic(
        NEEDS_MORE_TIME,
        f"flown {stretch:g} times slower, the plan {what}",
        Label(spans[broken[0].name]) if broken else Label(mission.time_span or mission.span),
        tuple(Label(spans[each.name], "also violated") for each in broken[1:]),
        notes=(
            *(f"`{each.name}` is violated by {each.short}{_when(mission, each)}" for each in broken),
            *map(_failure, other[:MOST_REASONS]),
        ),
        help=help_,
    )


def _reached(peak: Peak) -> str:
    return f"{peak.limit.name} {peak.reading:.3g} {peak.limit.unit}"


def _allowed(peak: Peak) -> str:
    side = "at least" if peak.limit.name == "least thrust" else "at most"
    return f"{side} {peak.limit.most:.3g} {peak.limit.unit}"


def _when(mission: Mission, judgement: Judgement) -> str:
    return "" if judgement.step is None else f" at {judgement.step * mission.step:g} s"


def _failure(check: Check) -> str:
    when = f" at {check.at:.2f} s" if check.at is not None else ""
    return f"{check.name} of {check.subject} fails by {-check.margin:.3g} {check.unit}{when}: {check.detail}"
