"""Pads at the measured positions of agents, which replace those of the mission.

in   Mission, the text of the poses
out  Mission, whose agents all take off from their measured positions
says MC546 MC547, and the codes of tables
"""

from __future__ import annotations

import math
from dataclasses import replace

from missionc.base.diagnostics.code import PAD_ELSEWHERE, UNUSABLE_POSES
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.base.diagnostics.suggest import suggestion
from missionc.base.limits import Limits
from missionc.base.source import Source, Span
from missionc.frontend.maps.table import PoseRow, pose_table
from missionc.ir import Agent, Mission, Pad, Vector
from missionc.ir.wording import listed, metres

NEAR = 0.1
"""Maximum horizontal distance in metres from the pad, or from the start: beyond it, vehicles may be in the
wrong order.
"""
LOW, HIGH = -0.1, 0.3
"""Range of measured heights in metres that counts as the floor, since markers and body origins differ."""


def with_measured_pads(mission: Mission, poses: Source, limits: Limits) -> tuple[Mission | None, list[Diagnostic]]:
    """The mission with pads at the measured positions, and findings.

    None unless every agent is measured exactly once.
    """
    rows = pose_table(poses, limits)
    if isinstance(rows, Diagnostic):
        return None, [rows]
    by_name: dict[str, PoseRow] = {}
    known = {agent.name for agent in mission.agents}
    findings: list[Diagnostic] = []
    for row in rows:
        if row.agent not in known:
            findings.append(_unknown(row, sorted(known)))
        elif row.agent in by_name:
            findings.append(_wrong(f"two poses of agent `{row.agent}`", row.span, "delete one of the two rows"))
        elif not LOW <= row.position[2] <= HIGH:
            findings.append(_in_the_air(row))
        else:
            by_name[row.agent] = row
    missing = [f"`{agent.name}`" for agent in mission.agents if agent.name not in {row.agent for row in rows}]
    if missing:
        whole = Span(poses, 0, len(poses.text)).first_line
        findings.append(_wrong(f"no measured pose of {listed(missing)}", whole, "add a row for each agent"))
    if findings:
        return None, findings
    agents = []
    for agent in mission.agents:
        row = by_name[agent.name]
        own = agent.pad if agent.pad is not None else Pad(None, row.span)
        agents.append(replace(agent, pad=replace(own, point=row.position[:2], span=row.span)))
        away = _away(agent, row.position)
        if away > NEAR:
            findings.append(_elsewhere(agent, row, away))
    return replace(mission, agents=tuple(agents)), findings


def _away(agent: Agent, here: Vector) -> float:
    """Horizontal distance in metres of a measured position from the agent's pad or start.

    0 if the mission states neither.
    """
    if agent.pad is not None and agent.pad.point is not None:
        return math.dist(agent.pad.point, here[:2])
    return math.dist(agent.start.point[:2], here[:2]) if agent.start.point is not None else 0.0


# ------------------------------------------------------------------ messages


def _wrong(message: str, span: Span, way_out: str) -> Diagnostic:
    return Diagnostic(UNUSABLE_POSES, message, Label(span), help=way_out)


def _unknown(row: PoseRow, known: list[str]) -> Diagnostic:
    meant = suggestion(row.agent, known, f"use one of the agents {listed(known[:4])}")
    return _wrong(f"the mission has no agent `{row.agent[:40]}`", row.span, meant)


def _in_the_air(row: PoseRow) -> Diagnostic:
    message = f"`{row.agent}` was measured at a height of {metres(row.position[2])}, not on the floor"
    return _wrong(message, row.span, "measure the agent on the floor, at height 0")


def _elsewhere(agent: Agent, row: PoseRow, away: float) -> Diagnostic:
    where = "its pad" if agent.pad is not None and agent.pad.point is not None else "the point below its start"
    return Diagnostic(
        PAD_ELSEWHERE,
        f"the measured pose of `{agent.name}` is {metres(away)} from {where}",
        Label(row.span),
        notes=(f"the plan starts at the measured pose; differences up to {metres(NEAR)} give no warning",),
        help="check that this vehicle is `{agent.name}`",
    )
