"""Rebuilt ``plan.json``, from the states that were read from it: nothing else may stand in it."""

from __future__ import annotations

from missionc.base.strict_json import parse_json
from missionc.base.trace import Plan
from missionc.monitoring.monitor import monitor
from missionc.output.documents.plan_json import plan_json
from missionc.replay.read_folder import PLAN, OutputFolder
from missionc.replay.rebuild.verdict import verdict
from missionc.verify.certificate import Check
from missionc.verify.compare_documents import difference


def plan_of(opened: OutputFolder) -> Plan:
    """The plan, its requirements judged anew; who planned it, and from which seed, is what the manifest says."""
    mission, kernel, trace = opened.mission, opened.kernel, opened.trace
    backend, seed = opened.manifest.get("backend"), opened.manifest.get("seed")
    return Plan(
        mission.name,
        backend if isinstance(backend, str) else "",
        seed if isinstance(seed, int) else 0,
        trace,
        monitor(mission, kernel, trace).requirements,
    )


def check_plan(opened: OutputFolder, plan: Plan) -> Check:
    """Every entry: states, times, graphs, radii, verdicts; none between the steps, and no other agent."""
    mismatch = difference(parse_json(opened.text(PLAN)), parse_json(plan_json(opened.mission, plan)))
    return verdict(PLAN, mismatch)
