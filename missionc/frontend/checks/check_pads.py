"""Check of pads: clearance between simultaneous takeoffs, from obstacles, and from the border of the flight volume.

    says MC544 MC545

A pad below a start that the compiler chooses is checked once there is a plan.
"""

from __future__ import annotations

import math
from itertools import combinations

from missionc.base.diagnostics.code import PADS_TOO_NEAR, UNUSABLE_PAD
from missionc.base.diagnostics.model import Diagnostic, Label
from missionc.ir import Agent, Mission, Obstacle, Vector
from missionc.ir.wording import metres, number

ROUNDING = 1e-6
"""Tolerance in metres for two pads that seem too close to each other."""
SLACK = 5e-3
"""Tolerance in metres for a column near an obstacle: flights need only the clearance of plans."""


def check_pads(mission: Mission) -> list[Diagnostic]:
    """Findings about takeoff and landing; empty for a mission that does not start from the floor."""
    if all(agent.pad is None for agent in mission.agents):
        return []
    above = {agent.index: point for agent in mission.agents if (point := _above(mission, agent)) is not None}
    findings = []
    near = [pair for pair in combinations(above, 2) if _apart(above, pair) < mission.spacing(*pair).sideways - ROUNDING]
    if near and not _in_turns(mission, above):
        findings.append(_too_near(mission, above, near))
    for index, point in above.items():
        wrong = _wrong(mission, mission.agents[index], point)
        if wrong is not None:
            findings.append(wrong)
            break
    return findings


def _above(mission: Mission, agent: Agent) -> Vector | None:
    """Hover point of an agent above its pad, in world coordinates; None if it depends on the plan."""
    start, pad = agent.start.point, agent.pad
    if pad is None:
        return start
    flat = pad.point if pad.point is not None else (start[:2] if start is not None else None)
    if flat is None or mission.dimension < 3:
        return flat
    height = pad.hover if pad.hover is not None else (start[2] if start is not None else None)
    return None if height is None else (*flat, height)


def _in_turns(mission: Mission, above: dict[int, Vector]) -> bool:
    """Return whether all agents can take off in turns from pads that are too close for simultaneous takeoff.

    False if the answer depends on the plan.
    """
    if len(above) < len(mission.agents):
        return False
    from missionc.verification.flight.verify_whole_flight import pads_suffice  # with arrays

    heights = [(*above[agent.index][:2], (*above[agent.index], agent.altitude)[2]) for agent in mission.agents]
    return pads_suffice(mission, heights)


def _apart(above: dict[int, Vector], pair: tuple[int, int]) -> float:
    """Horizontal distance between the hover points of a pair of agents, metres."""
    return math.dist(above[pair[0]][:2], above[pair[1]][:2])


def _wrong(mission: Mission, agent: Agent, point: Vector) -> Diagnostic | None:
    low, high = mission.room(agent.index)
    sides = zip(low, point, high, strict=True)
    if any(not a - ROUNDING <= value <= b + ROUNDING for a, value, b in sides):
        return _outside(mission, agent, point)
    from missionc.geometry.columns import column_clearance  # with arrays

    need = agent.radius + max(agent.vehicle.tracking, mission.clearance)
    for verb, time in (("rise", 0.0), ("land", float(mission.horizon))):
        for obstacle in mission.obstacles:
            clear = column_clearance(obstacle, point, time, time)
            if clear < need - SLACK:
                return _blocked(agent, verb, obstacle, clear, need)
    return None


# ------------------------------------------------------------------ messages


def _label(agent: Agent) -> Label:
    return Label(agent.pad.span if agent.pad is not None else agent.start.span)


def _too_near(mission: Mission, above: dict[int, Vector], near: list[tuple[int, int]]) -> Diagnostic:
    first, second = (mission.agents[index] for index in near[0])
    apart, need = _apart(above, near[0]), mission.spacing(*near[0]).sideways
    more = f"also {len(near) - 1} more {'pair' if len(near) == 2 else 'pairs'}"
    return Diagnostic(
        PADS_TOO_NEAR,
        f"`{first.name}` and `{second.name}` cannot take off together: their pads are {metres(apart)} apart;"
        f" the minimum is {metres(need)}",
        _label(first),
        notes=("no agent may be in the downwash of another", *((more,) if len(near) > 1 else ())),
        help=f"place the pads at least {metres(need)} apart",
    )


def _outside(mission: Mission, agent: Agent, point: Vector) -> Diagnostic:
    low, high = (f"({', '.join(map(number, corner))})" for corner in mission.room(agent.index))
    return Diagnostic(
        UNUSABLE_PAD,
        f"`{agent.name}` would hover above its pad at ({', '.join(map(number, point))}), outside its flight volume",
        _label(agent),
        notes=(f"the flight volume is {low} to {high}",),
        help="move the pad",
    )


def _blocked(agent: Agent, verb: str, obstacle: Obstacle, clear: float, need: float) -> Diagnostic:
    return Diagnostic(
        UNUSABLE_PAD,
        f"`{agent.name}` cannot {verb} vertically {'from' if verb == 'rise' else 'on'} its pad: `{obstacle.name}`"
        f" is too close",
        _label(agent),
        (Label(obstacle.span, f"{max(clear, 0.0):.3g} m from the vertical path; the minimum is {need:.3g} m"),),
        help="move the pad",
    )
