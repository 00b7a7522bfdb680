"""Check of a trace against the lanes of a user's roadmap: agents stay on the lanes and follow their directions."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.geometry.lane_room import straight_runs
from missionc.ir import Agent, Lanes, Mission
from missionc.verification.certificate import MOTION, Check, judged

Segments: TypeAlias = tuple[Array, Array, Array]
"""Start points and direction vectors, (segments, dim), metres, and the maximum length of one step, (segments,), metres.
"""


def check_lanes_kept(mission: Mission, trace: Trace) -> list[Check]:
    """Checks that every step of each agent follows one lane, or several collinear lanes, within their speeds.

    Between a start or finish and a node an agent moves straight, in either direction.
    """
    lanes = mission.solve.roadmap
    if lanes is None:
        return []
    return [_along_lanes(agent, lanes, trace.position[agent.index], float(trace.step)) for agent in mission.agents]


def _along_lanes(agent: Agent, lanes: Lanes, position: Array, step: float) -> Check:
    margin = lane_margins(segments(agent, lanes, step), position)
    at = int(margin.argmin())
    detail = f"every step follows lanes of `{lanes.path}`"
    return judged("lane", agent.name, float(margin[at]), "m", MOTION, at=at * step, agents=(agent.name,), detail=detail)


def lane_margins(along: Segments, position: Array) -> Array:
    """Negative distance of each step from the nearest segment that it could follow, 0 if it follows one.

    Args:
        along: segments that the agent may move along.
        position: (steps + 1, dim), metres.

    Returns:
        (steps,), metres; for a single state (1,): its distance from all segments.
    """
    start, way, most = along
    length = np.linalg.norm(way, axis=-1)
    direction = np.divide(way, length[:, None], out=np.zeros_like(way), where=length[:, None] > 0)
    amiss = np.zeros((len(position), len(start)))
    ahead_by = np.zeros_like(amiss)
    for number, (origin, ahead, far) in enumerate(zip(start, direction, length, strict=True)):
        offset = position - origin
        ahead_by[:, number] = offset @ ahead
        nearest = np.clip(ahead_by[:, number], 0.0, far)
        amiss[:, number] = np.linalg.norm(offset - nearest[:, None] * ahead, axis=-1)
    gone = np.diff(ahead_by, axis=0)
    wrong = np.maximum(amiss[:-1], amiss[1:])
    wrong = np.maximum(wrong, np.maximum(-gone, gone - most))  # a waiting agent moves 0 m forward
    return np.asarray(0.0 - (wrong.min(axis=1) if len(gone) else amiss[:1].min(axis=1)))


def segments(agent: Agent, lanes: Lanes, step: float) -> Segments:
    """Line segments that an agent may move along on the roadmap.

    A node is a segment of length zero; consecutive collinear lanes with one speed form a segment too.

    Args:
        step: duration of a step, seconds.
    """
    nodes = np.array([node.position for node in lanes.nodes], dtype=np.float64)
    source = np.array([lane.source for lane in lanes.lanes], dtype=np.int64)
    target = np.array([lane.target for lane in lanes.lanes], dtype=np.int64)
    length = np.linalg.norm(nodes[target] - nodes[source], axis=-1)
    seconds = np.array([max(each / lane.speed, lane.duration) for each, lane in zip(length, lanes.lanes, strict=True)])
    starts, ends = [nodes[source], nodes], [nodes[target], nodes]
    most = [
        np.divide(length * step, seconds, out=np.full(len(length), np.inf), where=seconds > 0),
        np.zeros(len(nodes)),
    ]
    for place in agent.ends:
        if place.point is not None:
            here = np.broadcast_to(np.array(place.point), nodes.shape)
            starts += [here, nodes]
            ends += [nodes, here]
            most.append(np.full(2 * len(nodes), np.inf))
    runs = straight_runs(lanes)
    if runs:
        first, last = (np.array([run[end] for run in runs]) for end in (0, -1))
        starts.append(nodes[source[first]])
        ends.append(nodes[target[last]])
        most.append(np.array([lanes.lanes[run[0]].speed * step for run in runs]))
    begin = np.concatenate(starts)
    return begin, np.concatenate(ends) - begin, np.concatenate(most)
