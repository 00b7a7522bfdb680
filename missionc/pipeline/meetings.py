"""Meetings in a search's best candidate: who comes too near whom, in how wide a passage, and what would help.

in   Mission, the candidate as the acceptance test judged it
out  Meeting, one for each pair, who is nearest first
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missionc.backends.api import Attempt, Fault
from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Agent, Mission, Still
from missionc.ir.wording import listed
from missionc.world.signed_distance import signed_distance

SAMPLES = 1000
"""Places at which it is looked how wide a passage is, to each side."""


def meetings(mission: Mission, best: Attempt) -> list[Meeting]:
    """Where each pair that comes too near each other does so most; who is nearest first."""
    agents = {agent.name: agent for agent in mission.agents}
    worst: dict[tuple[str, ...], Fault] = {}
    for fault in best.faults:
        if fault.what == "separation" and fault.margin < worst.get(fault.agents, fault).margin + 1e-12:
            worst[fault.agents] = fault
    ordered = sorted(worst.values(), key=lambda fault: (fault.margin, fault.step))
    return [Meeting(mission, best.trace, fault, agents) for fault in ordered]


class Meeting:
    """Two who come too near each other: where, in how wide a passage, and whether one of them could have waited."""

    def __init__(self, mission: Mission, trace: Trace, fault: Fault, agents: dict[str, Agent]) -> None:
        self.mission, self.fault, self.step = mission, fault, fault.step
        self.ends = [agents[name] for name in fault.agents]
        self.ways = trace.position[[agent.index for agent in self.ends]]
        self.point = np.asarray(self.ways[:, self.step].mean(axis=0))
        self.apart = sum(agent.radius for agent in self.ends) + mission.separation
        self.two = self.apart + self.apart - mission.separation + 2 * mission.clearance
        """The width in which the two pass each other, metres."""
        self.width = self._narrow()
        """How wide the passage is in which they want to pass each other and cannot, metres."""

    @property
    def says(self) -> str:
        when = f"at {self.step * self.mission.step:g} s, {self.fault.short} too near"
        says = f"{listed([f'`{name}`' for name in self.fault.agents])} meet {place(self.mission, self.point)} {when}"
        if self.width is None:
            return says
        wide = f"{self.width:.3g} m wide" if self.width > 0 else "too narrow"
        return f"{says}: the passage is {wide} there, and two pass in {self.two:.3g} m"

    @property
    def advice(self) -> str:
        names = self.fault.agents
        wait = f"{_either(names)} can wait"
        if self.width is None:
            return f"allow more time, so that {wait} for the other"
        held = [agent.name for agent, way in zip(self.ends, self.ways, strict=True) if _stays(agent, way)]
        if held:
            return f"widen the passage to {self.two:.3g} m, or let {_either(held)} make way"
        if self._has_room():
            return f"allow more time, so that {wait} outside the passage, or widen it to {self.two:.3g} m"
        return f"widen the passage to {self.two:.3g} m, give it a room where {wait}, or let one start behind the other"

    def _narrow(self) -> float | None:
        """Where they meet head-on and change sides, and it is too narrow for that; in a plane only."""
        moves = self.ways[:, self.step + 1] - self.ways[:, self.step]
        along = moves[0] - moves[1]
        if len(along) != 2 or float(moves[0] @ moves[1]) >= 0 or not self._change_sides(along):
            return None
        self.across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        width = self._width(self.point)
        return width if width < self.two else None

    def _change_sides(self, along: Array) -> bool:
        """Whether they are on other sides of each other after they have met than before."""
        between = self.ways[0] - self.ways[1]
        clear = np.flatnonzero(np.linalg.norm(between, axis=-1) >= self.apart)
        before, after = clear[clear <= self.step], clear[clear > self.step]
        first, last = (before[-1] if before.size else 0), (after[0] if after.size else -1)
        return bool((between[first] @ along) * (between[last] @ along) < 0)

    def _has_room(self) -> bool:
        """Whether one of them was before at a place where the other could have passed it."""
        return any(self._width(here) >= self.two for way in self.ways for here in way[: self.step + 1])

    def _width(self, point: Array) -> float:
        """How much room there is across the passage at a place, metres; no more is looked at than two need."""
        reach = np.linspace(0.0, self.two, SAMPLES + 1)
        width = 0.0
        for side in (self.across, -self.across):
            blocked = np.flatnonzero(~_free(self.mission, point + reach[:, None] * side))
            width += float(reach[blocked[0]]) if len(blocked) else self.two
        return width


def _stays(agent: Agent, way: Array) -> bool:
    """Whether it ends no further from its start than its body is wide: (steps + 1, dim)."""
    return float(np.linalg.norm(way[-1] - way[0])) <= 2 * agent.radius


def _free(mission: Mission, points: Array) -> Flags:
    """Which of these, (points, dim), are in the world and in no obstacle that stands: (points,)."""
    free: Flags = np.asarray(((points >= mission.world.low) & (points <= mission.world.high)).all(axis=-1))
    for obstacle in mission.obstacles:
        if isinstance(obstacle.motion, Still):
            free &= signed_distance(np, obstacle.shape, points) > 0
    return free


def place(mission: Mission, point: Array) -> str:
    """The smallest words for where it is: its coordinates, and the nearest thing with a name."""
    where = f"at ({', '.join(f'{value + 0.0:.3g}' for value in point)})"
    things = [(each.name, each.shape) for each in mission.regions]
    things += [(each.name, each.shape) for each in mission.obstacles if isinstance(each.motion, Still)]
    away = [(float(signed_distance(np, shape, point)), name) for name, shape in things if name]
    if not away:
        return where
    distance, name = min(away)
    return f"{'in' if distance <= 0 else 'near'} `{name}` {where}"


def _either(names: Sequence[str]) -> str:
    return " or ".join(f"`{name}`" for name in names)
