"""Ties in the worst figures of simulated flights, which rounding breaks: the document's choice is taken.

Which of them is told is decided by rounding, as machines do: agents that stand
are off by next to nothing all the time, and a symmetric flight has its least
room twice. What a document says is taken where the first flight shows it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from missionc.base.strict_json import is_number
from missionc.ir import Mission
from missionc.simulate.firmware_setpoints import SETPOINTS_PER_SECOND
from missionc.simulate.judge_flight import room, tracking_error
from missionc.simulate.trials import Trials, lost_agents
from missionc.verify.compare_documents import close
from missionc.verify.tolerances import CERTAIN

Row = dict[str, Any]


def settled(claimed: Row, made: Row, mission: Mission, trials: Trials, same: float) -> Row:
    """The document that was made, with the moments and agents that the other one tells where these are as right.

    Args:
        claimed: of whatever shape.
        same: metres by which the same flight may differ.
    """
    lost = lost_agents(mission, trials.trial.disturbance)
    error = tracking_error(trials.flown.times, trials.planned, trials.flown.position[0], lost)
    tracking = enumerate(_pairs(claimed.get("tracking"), made["tracking"]))
    rooms = _pairs(claimed.get("room"), made["room"])
    return {
        **made,
        "tracking": [_tracking(one, own, error[agent], same) for agent, (one, own) in tracking],
        "room": [_room(one, own, mission, trials, max(same, CERTAIN)) for one, own in rooms],
    }


def _pairs(claimed: object, made: list[Row]) -> list[tuple[Row, Row]]:
    """Each row with the one that is said in its place; an empty one where there is none."""
    rows = claimed if isinstance(claimed, list) and len(claimed) == len(made) else [None] * len(made)
    return [(row if isinstance(row, dict) else {}, own) for row, own in zip(rows, made, strict=True)]


def _tracking(claimed: Row, own: Row, error: np.ndarray[Any, np.dtype[np.float64]], same: float) -> Row:
    """With another moment at which the agent was as far off."""
    when = claimed.get("at")
    if not is_number(when) or not 0 <= when * SETPOINTS_PER_SECOND <= error.size - 1:
        return own
    sample = round(when * SETPOINTS_PER_SECOND)
    there = close(when, sample / SETPOINTS_PER_SECOND) and error[sample] >= own["most"] - same
    return {**own, "at": when} if there else own


def _room(claimed: Row, own: Row, mission: Mission, trials: Trials, same: float) -> Row:
    """With a margin as far below the least as a proof may fall short, and others who were as near at another moment."""
    margin, when, names = claimed.get("margin"), claimed.get("at"), claimed.get("agents")
    if is_number(margin) and abs(margin - own["margin"]) <= same:
        own = {**own, "margin": margin}
    if not is_number(when) or not 0 <= when <= trials.flown.times[-1] or not isinstance(names, list):
        return own
    own_names = [agent.name for agent in mission.agents if agent.name in names]
    if own_names != names or len(names) != len(own["agents"]):
        return own
    near = _margin(own["subject"], names, when, mission, trials) <= own["margin"] + 2 * same
    return {**own, "at": when, "agents": names} if near else own


def _margin(subject: str, names: list[str], when: float, mission: Mission, trials: Trials) -> float:
    """The least room of these agents in the first flight between the two samples around a moment, m."""
    agents = tuple(agent for agent in mission.agents if agent.name in names)
    obstacles = tuple(obstacle for obstacle in mission.obstacles if obstacle.name == subject)
    times = trials.flown.times
    after = int(np.clip(np.searchsorted(times, when), 1, times.size - 1))
    places = trials.flown.position[0][[agent.index for agent in agents], after - 1 : after + 1]
    part = replace(mission, agents=agents, obstacles=obstacles if len(names) == 1 else ())
    return min(check.margin for check in room(part, times[after - 1 : after + 1], places))
