"""Diagnosis of a search's best candidate: late agents, conflicts of two agents, and suggested changes.

    in   Mission, its kernel, the candidate with its acceptance test
    out  Diagnosis: sentences, and one suggested change

The diagnosis is the same for every engine, and uses only the candidate's positions. An agent is late if it is still
under way when a requirement is due; the minimum missing time is computed. A conflict is found for each pair of agents
that come too close, with the width of the passage; the closest pair comes first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from missionc.backends.api import Attempt, Violation
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Judgement, Trace
from missionc.geometry.dynamics import SPEED
from missionc.ir import Agent, Mission, Still
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.analysis import robustness_unit
from missionc.ir.kernel.nodes import At, Kernel, Node
from missionc.ir.kernel.walk import awaited, conjuncts, postorder
from missionc.ir.wording import listed
from missionc.verification.monitoring.monitor import robustness
from missionc.verification.monitoring.violation import first_violation

PUSHED = ("separation", "an obstacle")
"""Kinds of violations near which excess speed may come from a collision instead of a lack of time."""


class Late(Record):
    """Agents that need more time for a requirement or finish: the sentence, their names, and the amount."""

    says: str
    names: tuple[str, ...]
    seconds: float
    """Lower bound of the additional time, seconds."""
    asks: str = ""
    """Name of the requirement whose deadline the agents miss; empty for a finish."""
    step: int = 0
    """Step of the missed deadline."""


def late_agents(mission: Mission, kernel: Kernel, best: Attempt) -> list[Late]:
    """Agents that are late for a requirement or finish, and agents with excess speed that no collision explains."""
    extra = _too_fast(mission, best)
    formulas = {goal.name: goal.formula for goal in kernel.requirements}
    late: list[Late] = []
    for each in best.violated:
        for part in _awaiting(formulas[each.name]):
            late += _late(mission, best.trace, each.name, part, extra)
    late += [
        Late(f"`{agent.name}` is {fault.short} short of its finish", (agent.name,), seconds, "", mission.steps)
        for fault in best.faults
        if fault.what == "its finish"
        for agent in mission.agents
        if agent.name == fault.agents[0] and agent.dynamics.top_speed > 0
        for seconds in (-fault.margin / agent.dynamics.top_speed + extra[agent.index],)
    ]
    pushed = {name for fault in best.faults if fault.what in PUSHED for name in fault.agents}
    known = pushed.union(*(each.names for each in late))
    return late + [
        Late(f"`{agent.name}` exceeds its top speed and would arrive {seconds:.2g} s late", (agent.name,), seconds)
        for agent in mission.agents
        if (seconds := float(extra[agent.index])) > 0 and agent.name not in known
    ]


def _too_fast(mission: Mission, best: Attempt) -> Array:
    """Additional time that each agent would need at its top speed in steps with excess speed: (agents,), seconds."""
    extra = np.zeros(len(mission.agents))
    rows = {agent.name: agent for agent in mission.agents}
    for fault in best.faults:
        if fault.what == SPEED and (top := (agent := rows[fault.agents[0]]).dynamics.top_speed) > 0:
            move = best.trace.position[agent.index, fault.step + 1] - best.trace.position[agent.index, fault.step]
            extra[agent.index] += max(float(np.linalg.norm(move)) / top - mission.step, 0.0)
    return extra


def _awaiting(formula: Node) -> list[Node]:
    """Conjuncts of a formula, evaluated at step 0, that contain an event to wait for."""
    parts = (
        each.windows[0] if each.windows else each.formula if each.agent is None else At(each.agent, each.formula)
        for each in conjuncts((formula,))
    )
    return [part for part in dict.fromkeys(parts) if any(awaited(node) for node in postorder((part,)))]


def _late(mission: Mission, trace: Trace, name: str, part: Node, extra: Array) -> list[Late]:
    """Agents that are late for one conjunct of the requirement ``name``.

    Args:
        extra: additional time of each agent for excess speed, (agents,), seconds.
    """
    short = -float(robustness(part, mission, trace)[0, 0])
    if not (0 < short < math.inf) or robustness_unit(part) != "m":
        return []
    found = first_violation(part, mission, trace)
    asked = [agent for agent in mission.agents if agent.index in found.agents]
    speed = sum(agent.dynamics.top_speed for agent in asked)
    if not asked or speed <= 0 or not any(_under_way(trace, agent, found.step, short) for agent in asked):
        return []
    names = tuple(agent.name for agent in asked)
    be, when = "is" if len(names) == 1 else "are", f"at {found.step * mission.step:g} s"
    says = f"{_listed(names)} {be} {short:.3g} m short of `{name}` {when}"
    seconds = short / speed + float(max(extra[agent.index] for agent in asked))
    return [Late(says, names, seconds, name, found.step)]


def _under_way(trace: Trace, agent: Agent, step: int, short: float) -> bool:
    """Return whether an agent with ``short`` metres left moves up to a step without slowing down to wait."""
    lengths = np.linalg.norm(np.diff(trace.position[agent.index, : step + 1], axis=0), axis=-1)
    if not lengths.size or not lengths.any() or agent.dynamics.top_speed <= 0:
        return False
    last = max(math.ceil(short / agent.dynamics.top_speed / trace.step), 1)
    return bool(lengths[-last:].mean() >= lengths.mean() / 2)


def more_time(mission: Mission, late: Late, violated: Sequence[Judgement]) -> str:
    """Advice to allow a requirement or agent more time, with the minimum amount unless other violations share its
    agents.
    """
    rivals = [each.name for each in violated if each.name != late.asks and not set(late.names).isdisjoint(each.agents)]
    if rivals:
        what = f"`{late.asks}`" if late.asks else _listed(late.names)
        return f"allow {what} more time"
    steps = max(math.ceil(late.seconds / mission.step - 1e-9), 1)
    more, until = f"at least {steps * mission.step:g} s more", f"{(late.step + steps) * mission.step:g} s"
    if not late.step:
        return f"allow {_listed(late.names)} {more} for its path"
    if late.step >= mission.steps:
        return f"allow {more}: extend the horizon and its windows to {until}"
    horizon = f", and a horizon of {until}" if late.step + steps > mission.steps else ""
    return f"allow `{late.asks}` {more}, until {until}{horizon}"


def _listed(names: Sequence[str]) -> str:
    return listed([f"`{name}`" for name in names])


SAMPLES = 1000
"""Number of samples on each side when the width of a passage is measured."""


def meetings(mission: Mission, best: Attempt) -> list[Meeting]:
    """Closest approach of each pair of agents in conflict, the nearest pair first."""
    agents = {agent.name: agent for agent in mission.agents}
    worst: dict[tuple[str, ...], Violation] = {}
    for fault in best.faults:
        if fault.what == "separation" and fault.margin < worst.get(fault.agents, fault).margin + 1e-12:
            worst[fault.agents] = fault
    ordered = sorted(worst.values(), key=lambda fault: (fault.margin, fault.step))
    return [Meeting(mission, best.trace, fault, agents) for fault in ordered]


class Meeting:
    """Conflict of two agents: its position, the width of the passage, and whether one agent could wait for the
    other.
    """

    def __init__(self, mission: Mission, trace: Trace, fault: Violation, agents: dict[str, Agent]) -> None:
        self.mission, self.fault, self.step = mission, fault, fault.step
        self.ends = [agents[name] for name in fault.agents]
        self.ways = trace.position[[agent.index for agent in self.ends]]
        self.point = np.asarray(self.ways[:, self.step].mean(axis=0))
        self.apart = sum(agent.radius for agent in self.ends) + mission.separation
        self.two = self.apart + self.apart - mission.separation + 2 * mission.clearance
        """Width that the two agents need to pass each other, metres."""
        self.width = self._narrow()
        """Width of the passage in which the agents cannot pass each other, metres; None if there is no such passage."""

    @property
    def says(self) -> str:
        when = f"at {self.step * self.mission.step:g} s, {self.fault.short} too close"
        says = f"{listed([f'`{name}`' for name in self.fault.agents])} meet {place(self.mission, self.point)} {when}"
        if self.width is None:
            return says
        wide = f"{self.width:.3g} m wide" if self.width > 0 else "too narrow"
        return f"{says}: the passage is {wide}, but two agents need {self.two:.3g} m"

    @property
    def advice(self) -> str:
        names = self.fault.agents
        wait = f"{_either(names)} can wait"
        if self.width is None:
            return f"allow more time, so that {wait} for the other"
        held = [agent.name for agent, way in zip(self.ends, self.ways, strict=True) if _stays(agent, way)]
        if held:
            return f"widen the passage to {self.two:.3g} m"
        if self._has_room():
            return f"allow more time, so that {wait} outside the passage"
        return f"widen the passage to {self.two:.3g} m"

    def _narrow(self) -> float | None:
        """Width of the passage if the agents meet head-on and swap sides with too little room; plane missions only."""
        moves = self.ways[:, self.step + 1] - self.ways[:, self.step]
        along = moves[0] - moves[1]
        if len(along) != 2 or float(moves[0] @ moves[1]) >= 0 or not self._change_sides(along):
            return None
        self.across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        width = self._width(self.point)
        return width if width < self.two else None

    def _change_sides(self, along: Array) -> bool:
        """Return whether the agents are on opposite sides of each other before and after the meeting.

        Args:
            along: direction of their relative motion, (dim,).
        """
        between = self.ways[0] - self.ways[1]
        clear = np.flatnonzero(np.linalg.norm(between, axis=-1) >= self.apart)
        before, after = clear[clear <= self.step], clear[clear > self.step]
        first, last = (before[-1] if before.size else 0), (after[0] if after.size else -1)
        return bool((between[first] @ along) * (between[last] @ along) < 0)

    def _has_room(self) -> bool:
        """Return whether one agent passed a point before at which the other could have passed it."""
        return any(self._width(here) >= self.two for way in self.ways for here in way[: self.step + 1])

    def _width(self, point: Array) -> float:
        """Width across the passage at a point, (dim,), metres; at most twice the width that two agents need."""
        reach = np.linspace(0.0, self.two, SAMPLES + 1)
        width = 0.0
        for side in (self.across, -self.across):
            blocked = np.flatnonzero(~_free(self.mission, point + reach[:, None] * side))
            width += float(reach[blocked[0]]) if len(blocked) else self.two
        return width


def _stays(agent: Agent, way: Array) -> bool:
    """Return whether the agent's path, (steps + 1, dim), metres, ends within a body's diameter of its start."""
    return float(np.linalg.norm(way[-1] - way[0])) <= 2 * agent.radius


def _free(mission: Mission, points: Array) -> Flags:
    """Flags of points, (points, dim), metres, in the world and outside static obstacles: (points,)."""
    free: Flags = np.asarray(((points >= mission.world.low) & (points <= mission.world.high)).all(axis=-1))
    for obstacle in mission.obstacles:
        if isinstance(obstacle.motion, Still):
            free &= signed_distance(np, obstacle.shape, points) > 0
    return free


def place(mission: Mission, point: Array) -> str:
    """Text for a point, (dim,), metres: its coordinates, and the nearest named region or obstacle."""
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


SHOWN = 3
"""Maximum number of sentences of each kind in a diagnosis."""


class Diagnosis(Record):
    """Sentences on the violations of a candidate, and a suggested change, empty if none follows.

    ``late`` is True if the mission's own time is too short, so that a longer search is not the first suggestion.
    """

    notes: tuple[str, ...]
    advice: str
    late: bool


def diagnose(mission: Mission, kernel: Kernel, best: Attempt) -> Diagnosis:
    """Sentences on late agents, agents in conflict, and requirements that fail at the same agents, with a
    suggestion.
    """
    met, late = meetings(mission, best), late_agents(mission, kernel, best)
    notes = [
        *_some([each.says for each in late], "agent is late", "agents are late"),
        *_some([each.says for each in met], "pair meets", "pairs meet"),
        *_some(_touching(mission, best), "agent touches an obstacle", "agents touch an obstacle"),
        *_some(_failing_together(best.violated), "pair of requirements fails", "pairs of requirements fail"),
    ]
    return Diagnosis(tuple(notes), _advice(mission, best.violated, late, met), bool(late and not met))


def _touching(mission: Mission, best: Attempt) -> list[str]:
    """Sentences on agents that touch an obstacle, with the first contact of each."""
    first: dict[str, Violation] = {}
    for fault in best.faults:
        if fault.what == "an obstacle":
            first.setdefault(fault.agents[0], fault)
    rows = {agent.name: agent.index for agent in mission.agents}
    return [
        f"`{name}` touches an obstacle {place(mission, best.trace.position[rows[name], fault.step])}"
        f" at {fault.step * mission.step:g} s"
        for name, fault in first.items()
    ]


def _failing_together(violated: Sequence[Judgement]) -> list[str]:
    """Sentences on pairs of requirements that fail at the same agents, which need not conflict: one may imply the
    other.
    """
    return [
        f"`{one.name}` and `{other.name}` both fail at {listed(shared)}"
        for one, other in combinations(violated, 2)
        if (shared := [f"`{name}`" for name in one.agents if name in other.agents])
    ]


def _advice(mission: Mission, violated: Sequence[Judgement], late: list[Late], met: list[Meeting]) -> str:
    narrow = [each for each in met if each.width is not None]
    if narrow:
        return max(narrow, key=lambda each: each.two).advice
    if late:
        return more_time(mission, max(late, key=lambda each: each.seconds), violated)
    return met[0].advice if met else ""


def _some(sentences: list[str], one: str, more: str) -> list[str]:
    """The first sentences of a kind, and the number of the others, such as ``1 more pair meets``."""
    left = len(sentences) - SHOWN
    return sentences if left <= 0 else [*sentences[:SHOWN], f"{left} more {one if left == 1 else more}"]
