"""Lanes of a trace, step by step: where a mission brings its own roadmap, nobody leaves it or goes against a lane."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from missionc.base.trace import Array, Trace
from missionc.geometry.straight_runs import straight_runs
from missionc.ir import Agent, Lanes, Mission
from missionc.verification.certificate import MOTION, Check, judged

Segments: TypeAlias = tuple[Array, Array, Array]
"""Starts and ways, (segments, dim), metres, and the metres of one step at most, (segments,)."""


def check_lanes_kept(mission: Mission, trace: Trace) -> list[Check]:
    """For each agent whether every step leads along one lane, or several straight on, and no faster than they allow.

    Between a place where it starts or finishes and a node it goes straight, either way.
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
    """Distance of each step from leading along one of the segments, 0 or negative.

    Args:
        position: (steps + 1, dim), metres.

    Returns:
        (steps,), metres; of a single state (1,): how far it is from all of them.
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
    wrong = np.maximum(wrong, np.maximum(-gone, gone - most))  # who waits goes 0 m forward
    return np.asarray(0.0 - (wrong.min(axis=1) if len(gone) else amiss[:1].min(axis=1)))


def segments(agent: Agent, lanes: Lanes, step: float) -> Segments:
    """The segments that an agent may move along.

    A node is one of no length; lanes that lead straight on at one speed are one too.
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
