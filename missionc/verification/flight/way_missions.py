"""Ways before and after a mission, as missions of their own: from above the pads to the starts, and back above them.

in   Mission, the polynomials that fly it
out  where each agent hovers above its pad; the mission of a way

A way has the mission's world, its agents, bodies and vehicles, and no requirement but to be there at the end, at rest.
Obstacles are where they are then: on the way out they stand as they do when the mission begins, on the way home they
go on as they would. Noses stay as the mission begins, or ends.
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
"""The kernel of every way."""


class Stage(Enum):
    """A way; its value is the word that its checks begin with, and its folder."""

    OUT = "out"
    HOME = "home"


class Way(Record, eq=False):
    """Where all agents begin and end it.

    Args:
        begin, end: (agents, 3), metres; of a plane mission at its altitudes.
        yaw: (agents,), rad: throughout.
    """

    begin: Array
    end: Array
    yaw: Array

    @property
    def needed(self) -> bool:
        """Whether anybody is anywhere else at its end."""
        return bool(np.abs(self.end - self.begin).max() > MOTION * max(1.0, float(np.abs(self.end).max())))


Ways = Mapping[Stage, Mapping[str, str]]
"""The text of each agent's file, by the agent's name; a way that nobody needs is not there."""


def is_whole(mission: ir.Mission) -> bool:
    """Whether the mission says of some agent that it comes from the floor."""
    return any(agent.pad is not None for agent in mission.agents)


def has_risen(mission: ir.Mission) -> bool:
    """Whether its agents have risen from their pads before it begins: it is what is left of a mission in flight."""
    return any(agent.pad is not None and agent.pad.risen is not None for agent in mission.agents)


def ways_of(mission: ir.Mission, flown: Mapping[str, Pieces]) -> dict[Stage, Way]:
    """Both ways, from and to above the pads; who has risen before begins where it is.

    Args:
        flown: the polynomials of the mission, by the agent's name.
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
    """Where an agent hovers above its pad; at its start, where it has none."""
    pad = agent.pad
    if pad is None:
        return [float(value) for value in start]
    x, y = start[:2].tolist() if pad.point is None else pad.point
    height = float(start[2]) if pad.hover is None or mission.dimension < 3 else pad.hover
    return [float(np.float32(value)) for value in (x, y, height)]


def way_mission(mission: ir.Mission, stage: Stage, way: Way, seconds: float, steps: int, speed: float) -> ir.Mission:
    """The mission of a way that lasts so many seconds, in so many steps.

    Args:
        speed: m/s, that its plan keeps to, and an agent's own dynamics.
    """
    shift = mission.horizon if stage is Stage.HOME else 0.0
    # What grows is as large throughout as it is at the end of the way, and on the way out not grown yet.
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
    """An obstacle on the clock of a way, as large as it is at the end of that."""
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
    """Metres of the longest straight line of a way."""
    return max(map(math.dist, way.begin.tolist(), way.end.tolist()))
