"""Transfers before and after a mission, as separate missions: from above the pads to the starts, and back.

in   Mission, its polynomials
out  hover points above the pads; the mission of a transfer

A transfer has the mission's world, agents, bodies and vehicles. Its only requirement is to arrive at rest. In the
outbound transfer, obstacles are at their initial positions; in the return transfer they continue their motion. The yaw
is that of the mission's beginning, or of its end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from enum import Enum

import numpy as np

from missionc import ir
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.base.units import Metres, Seconds, Steps
from missionc.geometry.curves.piecewise_polynomials import Pieces, values
from missionc.geometry.displacement import displaced, moved
from missionc.geometry.grown_shape import grown_shape
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.certificate import MOTION

NOTHING_REQUIRED = Kernel((), ())
"""Kernel of every transfer, which has no requirements."""


class Stage(Enum):
    """Transfer before or after the mission; the value is the prefix of its checks and the name of its folder."""

    OUT = "out"
    HOME = "home"


class Way(Record, eq=False):
    """Begin and end positions of all agents in a transfer.

    Args:
        begin, end: (agents, 3), metres; in a plane mission at the agents' altitudes.
        yaw: (agents,), rad, constant.
    """

    begin: Array
    end: Array
    yaw: Array

    @property
    def needed(self) -> bool:
        """True if some agent's end position differs from its begin position."""
        return bool(np.abs(self.end - self.begin).max() > MOTION * max(1.0, float(np.abs(self.end).max())))


Ways = Mapping[Stage, Mapping[str, str]]
"""Texts of the trajectory files of each transfer, by agent name; a transfer without motion is absent."""


def is_whole(mission: ir.Mission) -> bool:
    """Return whether some agent of the mission starts on the floor."""
    return any(agent.pad is not None for agent in mission.agents)


def has_risen(mission: ir.Mission) -> bool:
    """Return whether the agents took off before the mission begins, as in a remaining mission."""
    return any(agent.pad is not None and agent.pad.risen is not None for agent in mission.agents)


def ways_of(mission: ir.Mission, flown: Mapping[str, Pieces]) -> dict[Stage, Way]:
    """Both transfers of a mission, from and to the hover points above the pads.

    An airborne agent begins at its position.

    Args:
        flown: polynomials of the mission, by agent name.
    """
    first, last, yaw_first, yaw_last, above, before = [], [], [], [], [], []
    for agent in mission.agents:
        own = flown[agent.name]
        begin, end = own.coefficients[0, :, 0], values(own.coefficients[-1], own.duration[-1])
        first.append(begin[:3])
        last.append(end[:3])
        yaw_first.append(begin[3])
        yaw_last.append(end[3])
        above.append(_above(mission, agent, begin[:3]))
        before.append(begin[:3].tolist() if has_risen(mission) else above[-1])
    return {
        Stage.OUT: Way(np.array(before), np.array(first), np.array(yaw_first)),
        Stage.HOME: Way(np.array(last), np.array(above), np.array(yaw_last)),
    }


def _above(mission: ir.Mission, agent: ir.Agent, start: Array) -> list[float]:
    """Hover point of an agent above its pad, or its start, (3,), metres, if it has no pad.

    Args:
        start: first position of its polynomials, (3,), metres.
    """
    pad = agent.pad
    if pad is None:
        return [float(value) for value in start]
    x, y = start[:2].tolist() if pad.point is None else pad.point
    height = float(start[2]) if pad.hover is None or mission.dimension < 3 else pad.hover
    return [float(np.float32(value)) for value in (x, y, height)]


def way_mission(mission: ir.Mission, stage: Stage, way: Way, seconds: float, steps: int, speed: float) -> ir.Mission:
    """Mission that describes a transfer, with a duration of ``seconds`` in ``steps`` steps.

    Args:
        speed: m/s, limit of the plan besides the agents' own dynamics.
    """
    shift = mission.horizon if stage is Stage.HOME else 0.0
    # A growing obstacle has its size at the transfer's end; before the mission it has not grown yet.
    end = shift + seconds if stage is Stage.HOME else 0.0
    size = mission.dimension
    agents = tuple(
        replace(
            agent,
            start=ir.InitialSet(agent.span, tuple(begin[:size])),
            finish=ir.InitialSet(agent.span, tuple(end[:size])),
            altitude=Metres(begin[2]) if size == 2 else agent.altitude,
            dynamics=ir.velocity_chosen_anew(min(speed, agent.dynamics.top_speed)),
            yaw=ir.Fixed(yaw),
            begins=(),
        )
        for agent, begin, end, yaw in zip(
            mission.agents, way.begin.tolist(), way.end.tolist(), way.yaw.tolist(), strict=True
        )
    )
    return replace(
        mission,
        name=f"{mission.name}_{stage.value}",
        step=Seconds(seconds / steps),
        steps=Steps(steps),
        agents=agents,
        obstacles=tuple(_then(obstacle, stage, shift, end, size) for obstacle in mission.obstacles),
        formations=(),
        requirements=(),
        preferences=(),
        objective=ir.Objective.NONE,
        solve=ir.SolveWith(),
        lets=(),
        resources=(),
        flags=(),
        tolerances=(),
    )


def _then(obstacle: ir.Obstacle, stage: Stage, shift: float, end: float, dimension: int) -> ir.Obstacle:
    """The obstacle on the clock of a transfer, with its size at the transfer's end."""
    if obstacle.growth:
        shape = grown_shape(obstacle.shape, obstacle.grown(end))
        return _then(replace(obstacle, shape=shape, growth=0.0), stage, shift, end, dimension)
    if not isinstance(obstacle.motion, ir.Path):
        return obstacle
    last = obstacle.motion.times[-1]
    if stage is Stage.OUT or last <= shift:
        there = moved(obstacle.shape, displaced(obstacle, shift, dimension))
        return replace(obstacle, shape=there, motion=ir.Still())
    later = [time - shift for time in obstacle.motion.times]
    now = displaced(obstacle, shift, dimension)
    rest = [(time, offset) for time, offset in zip(later, obstacle.motion.offsets, strict=True) if time > 0]
    times, offsets = zip((0.0, now), *rest, strict=True)
    return replace(obstacle, motion=ir.Path(tuple(map(Seconds, times)), tuple(offsets)))


def distance_of(way: Way) -> float:
    """Longest straight-line distance between an agent's begin and end positions in a transfer, metres."""
    return max(map(math.dist, way.begin.tolist(), way.end.tolist()))
