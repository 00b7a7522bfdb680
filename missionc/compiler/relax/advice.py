"""Relaxation advice for an infeasible mission: lines for users, and JSON values for programs."""

from __future__ import annotations

from missionc.compiler.results import Compiled, Explained, Relaxation


def explained_lines(compiled: Compiled) -> list[str]:
    """Lines that describe the changes with which there is a plan, smallest first, and the closest infeasible
    candidate.
    """
    explained, mission = compiled.explained, compiled.checked.mission
    if explained is None or mission is None:
        return []
    name = mission.name
    cut = " (search stopped at its time limit)" if explained.cut_short else ""
    if explained.relaxations:
        one = (
            "this change makes the mission feasible"
            if len(explained.relaxations) == 1
            else "each of these changes makes the mission feasible"
        )
        lines = [f"{name}: {one}{cut}"]
    else:
        lines = [f"{name}: no tested change makes the mission feasible{cut}"]
    for relaxation in explained.relaxations:
        proven = f"; {relaxation.proven} is proved infeasible" if relaxation.proven else ""
        less = "" if relaxation.smallest else "; a smaller change may suffice"
        guards = "; loosens a safety requirement" if relaxation.guards else ""
        lines.append(f"  {relaxation.says}{proven}{less}{guards}")
        for change in relaxation.changes:
            place = f"{change.line:>6} " if change.line else " " * 7
            lines += [f"{place}- {line}" for line in change.before.splitlines()]
            lines += [f"{place}+ {line}" for line in change.after.splitlines() if line.strip()]
    missed = explained.near_miss
    if missed is not None:
        lines.append(f"{name}: closest infeasible candidate {missed.attempt.violation(mission.step)}")
    return lines


def explained_document(explained: Explained | None) -> dict[str, object]:
    """JSON values of the explanation; null and empty if nothing was tried."""
    if explained is None:
        return {"blame": None, "relaxations": [], "near_miss": None}
    missed = explained.near_miss
    return {
        "blame": {
            "on": explained.blame.value,
            "trials": [{"change": trial.says, "outcome": trial.outcome} for trial in explained.trials],
            "cut_short": explained.cut_short,
        },
        "relaxations": [_relaxation(relaxation) for relaxation in explained.relaxations],
        "near_miss": missed
        and {
            "planned_for": missed.planned_for or None,
            "violates": [each.as_record() for each in missed.attempt.violated],
            "faults": [each.as_record() for each in missed.attempt.worst_faults()],
        },
    }


def _relaxation(relaxation: Relaxation) -> dict[str, object]:
    """JSON values of a suggested change, with its first changed location; ``also`` has the other locations, if any."""
    places = [
        {"file": change.file or None, "line": change.line or None, "before": change.before, "after": change.after}
        for change in relaxation.changes
    ]
    first, *others = places
    return {
        "change": relaxation.says,
        **first,
        "also": others,
        "smallest": relaxation.smallest,
        "proven": relaxation.proven or None,
        "guards": relaxation.guards,
        "verified": True,
    }
