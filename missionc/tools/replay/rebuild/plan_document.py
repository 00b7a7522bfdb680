"""Check of ``plan.json``: the document computed from the states in it must be identical."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from missionc.base.strict_json import parse_json
from missionc.base.trace import COVER, TOURS, Plan, Proven, Solved, StageRun, read_solved, read_stage_runs
from missionc.frontend.checks.lower_bounds import beside, least_by_tours
from missionc.output.documents.plan_json import plan_json
from missionc.tools.replay.read_folder import PLAN, OutputFolder
from missionc.tools.replay.rebuild.verdict import verdict
from missionc.verification.certificate import Check
from missionc.verification.compare_documents import difference
from missionc.verification.monitoring.monitor import monitor


def plan_of(opened: OutputFolder) -> Plan:
    """Plan from a folder, with newly computed verdicts; backend and seed come from the manifest."""
    mission, kernel, trace = opened.mission, opened.kernel, opened.trace
    backend, seed = opened.manifest.get("backend"), opened.manifest.get("seed")
    return Plan(
        mission.name,
        backend if isinstance(backend, str) else "",
        seed if isinstance(seed, int) else 0,
        trace,
        monitor(mission, kernel, trace).requirements,
        _proven(opened),
        _solved(opened),
        _stage_runs(opened),
    )


def _solved(opened: OutputFolder) -> tuple[Solved, ...]:
    """Planning methods of the agents from the document, since only the original search knows them.

    Empty if malformed.
    """
    match opened.plan_document:
        case {"solved": records}:
            with suppress(ValueError):
                return read_solved(records, opened.mission.names)
    return ()


def _stage_runs(opened: OutputFolder) -> tuple[StageRun, ...]:
    """Attempts that led to the plan, from the document; empty for folders of older versions."""
    match opened.plan_document:
        case {"stages": records}:
            with suppress(ValueError):
                return read_stage_runs(records)
    return ()


def _proven(opened: OutputFolder) -> Proven | None:
    """Lower bound on the value of all plans: from newly computed tours, or the document's own bound from a cover.

    A bound from covers must be at most the value of the plan, and exceeds that from tours.
    """
    tours = least_by_tours(opened.mission, opened.kernel)
    if tours is None:
        return None
    known = beside(opened.mission, opened.trace, tours, TOURS)
    match opened.plan_document:
        case {"proven": {"by": str(by), "least": int() | float() as least}} if by == COVER:
            return replace(known, least=float(least), by=COVER) if known.least < least <= known.value else known
        case _:
            return known


def check_plan(opened: OutputFolder, plan: Plan) -> Check:
    """Check of every entry of the document: states, times, graphs, radii and verdicts."""
    said = opened.plan_document
    return verdict(PLAN, _too_high(said, plan) or difference(said, parse_json(plan_json(opened.mission, plan))))


def _too_high(said: object, plan: Plan) -> str:
    """Error if the document's lower bound exceeds the plan's value; empty otherwise."""
    match said:
        case {"proven": {"least": int() | float() as least}} if plan.proven and least > plan.proven.value:
            value, unit = plan.proven.value, plan.proven.unit
            return f"its lower bound {least:.6g} {unit} exceeds the {value:.6g} {unit} of the plan"
        case _:
            return ""
