"""Summary of replanning: the new plan for the remaining mission, and its start."""

from __future__ import annotations

from pathlib import Path

from missionc.base.trace import counted
from missionc.cli.plan_summary import warning_lines, without_vehicle, worst_margins
from missionc.compiler.replan.request import Replanned, Way
from missionc.compiler.results import Verified
from missionc.ir.wording import listed
from missionc.output.folder.file_names import REPORT


def replanned_lines(replanned: Replanned, output: str) -> list[str]:
    """Lines of the summary; empty without a new plan. ``output`` is the written folder, or empty."""
    rest = replanned.rest
    if replanned.way is Way.NONE or rest is None or rest.mission is None:
        return []
    mission, begins = rest.mission, replanned.begins or 0.0
    lines = [f"{mission.name}: {replanned.way.value} in {replanned.seconds:.2f} s: {_rest(replanned)}"]
    if replanned.way is Way.KEPT:
        assert replanned.certificate is not None
        return [*lines, *worst_margins(replanned.certificate.judgements, replanned.certificate)]
    assert replanned.compiled is not None
    outcome = replanned.compiled.outcome
    assert isinstance(outcome, Verified)
    return [
        *lines,
        *worst_margins(outcome.plan.judgements, outcome.certificate),
        f"  {_changing(replanned, begins)}",
        *warning_lines(list(filter(None, (_hovers(replanned), without_vehicle(mission)))), verbose=False),
        *([f"  report: {Path(output) / REPORT}"] if output else []),
    ]


def _changing(replanned: Replanned, begins: float) -> str:
    """Text about agents whose path changes, and agents that stop before that. ``begins`` is the plan's start, s."""
    assert replanned.rest is not None
    stopping = [agent.name for agent in replanned.rest.valid_mission.agents if not agent.begins]
    if len(stopping) == len(replanned.rest.valid_mission.agents):
        return f"all agents stop (the stops are proved too); the new plan starts at {begins:g} s"
    plural = "s" if len(replanned.changed) == 1 else ""
    new = f"{listed(replanned.changed)} follow{plural} a new path" if replanned.changed else "no agent changes its path"
    stops = f"{listed(stopping)} stop{'s' if len(stopping) == 1 else ''} before" if stopping else "no agent stops"
    return f"from {begins:g} s on, {new}; {stops}"


def _rest(replanned: Replanned) -> str:
    """Text about agents that continue, and the time that remains."""
    assert replanned.rest is not None
    mission, past = replanned.rest.valid_mission, replanned.rest.past
    lost = [name for each in past.flown for name in each.stretch.lost] if past else []
    without = f", without {listed(lost)}" if lost else ""
    given_up = past.flown[-1].stretch.given_up if past else ()
    dropped = f", `{'`, `'.join(given_up)}` dropped" if given_up else ""
    return f"{counted(len(mission.agents), 'agent')} for the last {mission.horizon:g} s{without}{dropped}"


def _hovers(replanned: Replanned) -> str:
    return "no path back to the pads was found in time, so the flight ends in a hover" if _stays(replanned) else ""


def _stays(replanned: Replanned) -> bool:
    """Return whether the plan ends without the return of agents that the mission requires."""
    checked = replanned.compiled.checked if replanned.compiled is not None else None
    return checked is not None and checked.past is not None and checked.past.flown[-1].stretch.stays


def replanned_document(replanned: Replanned, output: str | None) -> dict[str, object]:
    """JSON document of replanning; ``output`` is the written folder, or None."""
    compiled = replanned.compiled
    verified = compiled.outcome if compiled is not None and isinstance(compiled.outcome, Verified) else None
    certificate = verified.certificate if verified else replanned.certificate
    judgements = certificate.judgements if certificate else ()
    mission = replanned.rest.mission if replanned.rest is not None else None
    return {
        "outcome": replanned.way.name.lower(),
        "begins": replanned.begins,
        "changed": list(replanned.changed),
        "in_motion": [agent.name for agent in mission.agents if agent.begins] if mission is not None else [],
        "seconds": round(replanned.seconds, 3),
        "requirements": [each.as_verdict() for each in judgements],
        "flying_on": None if replanned.flown_on is None else list(replanned.flown_on),
        "stops": dict(replanned.stops),
        "way_home_found": not _stays(replanned),
        "output": output,
    }
