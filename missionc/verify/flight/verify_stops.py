"""Verification of stops: what everybody flies until a plan that was made in flight begins.

    in   the mission that begins with that plan, each agent's polynomials up to its beginning
    out  Checks: nobody touches anything on the way, and all are where the plan begins, at rest or in its motion

Bodies alone count, not the distances that are kept beside them: those are for flights that were planned.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from missionc.base.trace import Array
from missionc.base.units import Metres
from missionc.curves.crazyflie_csv import Pieces, curves_of, read
from missionc.curves.piecewise_polynomials import Curves, derivatives_at
from missionc.ir import Agent, Exactly, Mission
from missionc.verify.certificate import Check
from missionc.verify.plan.agent_separation import check_separation
from missionc.verify.plan.obstacle_clearance import check_obstacles
from missionc.verify.tolerances import WAYPOINT

ENDS = 1e-3
"""Metres a second, and metres: who is so slow rests."""


def verify_stops(mission: Mission, files: Mapping[str, str]) -> list[Check]:
    """The stops of all agents together.

    Args:
        mission: its step 0 is when the stops are over.
        files: the text of each agent's polynomials, by the agent's name.
    """
    own = {name: read(text) for name, text in files.items()}
    wrong = [name for name, pieces in own.items() if isinstance(pieces, str)]
    flown = [own.get(agent.name) for agent in mission.agents]
    pieces = [each for each in flown if isinstance(each, Pieces)]
    alike = {each.duration.tobytes() for each in pieces}
    if wrong or len(pieces) != len(mission.agents) or len(alike) != 1:
        detail = "there is one for each agent, and all have pieces that last as long"
        return [Check("stop", "files", 0.0, "", 0.0, False, detail=detail)]
    return list(checks(mission, pieces))


def checks(mission: Mission, pieces: list[Pieces]) -> Iterator[Check]:
    """The checks of stops, all of the same durations."""
    curves = stop_curves(mission, pieces)
    bare = replace(mission, separation=Metres(0.0), clearance=Metres(0.0))
    for check in (*check_separation(bare, curves), *check_obstacles(bare, curves)):
        yield replace(check, name=f"stop {check.name}", detail=f"until the plan begins, nobody touches: {check.detail}")
    for agent, own in zip(mission.agents, pieces, strict=True):
        end = derivatives_at(curves_of([own], slice(None)), np.array([np.inf]), max(2, len(agent.begins)))[0, 0]
        place = end[0, : mission.dimension]
        off = float(np.linalg.norm(place - agent.start.point)) if isinstance(agent.start, Exactly) else np.inf
        jump = _jump(agent, end)
        margin = min(WAYPOINT - off, ENDS - jump)
        motion = "in the motion in which" if agent.begins else "at rest where"
        yield Check(
            "stop", agent.name, margin, "m", 0.0, margin >= 0, 0.0, (agent.name,), f"it ends {motion} the plan begins"
        )


def _jump(agent: Agent, end: Array) -> float:
    """How fast a stop ends in this state, (orders, 4); where the agent is in motion then, the largest jump."""
    if not agent.begins:
        return float(np.linalg.norm(end[1, :3]))
    return float(np.linalg.norm(end - np.array(agent.begins), axis=-1).max())


def stop_curves(mission: Mission, pieces: list[Pieces]) -> Curves:
    """The motion, its times counted to the mission's step 0, where it ends."""
    times = pieces[0].times - pieces[0].times[-1]
    return Curves(times, np.stack([own.coefficients[:, : mission.dimension] for own in pieces]))
