"""Diagnosis of a search's best candidate: who is late and by how much, who meets whom where, and what to try.

in   Mission, its kernel, the candidate as the acceptance test judged it
out  Diagnosis: sentences, and one change that follows from them

It is the same for every engine, and asks nothing but the candidate's own positions.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from missionc.backends.api import Attempt, Fault
from missionc.base.judgement import Judgement
from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Agent, Mission, Still
from missionc.kernel.nodes import Eventually, Kernel
from missionc.kernel.walk import postorder
from missionc.world.signed_distance import signed_distance

SHOWN = 3
"""So many of a kind are told."""

SAMPLES = 1000
"""Places at which it is looked how wide a passage is, to each side."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What the candidate fails, a sentence each, and what to try, which is empty where nothing follows from that.

    ``late``: the mission's own time is what is short, so that a longer search is not what to try first.
    """

    notes: tuple[str, ...]
    advice: str
    late: bool


def diagnose(mission: Mission, kernel: Kernel, best: Attempt) -> Diagnosis:
    """Who is late, who is in whose way, and which requirements ask for the same agents."""
    agents = {agent.name: agent for agent in mission.agents}
    meetings = _meetings(best.faults)
    late = [*_late(mission, kernel, best.violated, agents), *_unfinished(best.faults, agents)]
    notes = [
        *_some([each.says for each in late], "agents are late"),
        *_some([_met(mission, best.trace, fault, agents) for fault in meetings], "pairs meet"),
        *_some(_touching(mission, best), "agents touch an obstacle"),
        *_some(_competing(best.violated), "pairs of requirements compete"),
    ]
    narrow = [width for fault in meetings if (width := _narrow(mission, best.trace, fault, agents)) is not None]
    return Diagnosis(tuple(notes), _advice(mission, late, meetings, narrow, agents), bool(late and not meetings))


@dataclass(frozen=True, slots=True)
class _Late:
    says: str
    seconds: float
    """At least so much more time it needs."""


def _late(mission: Mission, kernel: Kernel, violated: Sequence[Judgement], agents: dict[str, Agent]) -> list[_Late]:
    """Those from whom something is asked by a time at which they are still on their way."""
    formulas = {goal.name: goal.formula for goal in kernel.requirements}
    late = []
    for each in violated:
        awaited = any(isinstance(node, Eventually) for node in postorder([formulas[each.name]]))
        if not awaited or not each.agents or each.step is None or not math.isfinite(each.robustness):
            continue
        short, speed = -each.robustness, min(agents[name].dynamics.top_speed for name in each.agents)
        if short > 0 and speed > 0:
            who = f"{_listed(each.agents)} {_be(each.agents)}"
            when = f"at {each.step * mission.step:g} s"
            late.append(_Late(f"{who} {short:.3g} m short of what `{each.name}` asks {when}", short / speed))
    return late


def _unfinished(faults: Sequence[Fault], agents: dict[str, Agent]) -> list[_Late]:
    return [
        _Late(f"`{fault.agents[0]}` is {-fault.margin:.3g} m short of its finish", -fault.margin / speed)
        for fault in faults
        if fault.what == "its finish" and (speed := agents[fault.agents[0]].dynamics.top_speed) > 0
    ]


def _meetings(faults: Sequence[Fault]) -> list[Fault]:
    """Where each pair that comes too near each other does so most; who is nearest first."""
    worst: dict[tuple[str, ...], Fault] = {}
    for fault in faults:
        if fault.what == "separation" and fault.margin < worst.get(fault.agents, fault).margin + 1e-12:
            worst[fault.agents] = fault
    return sorted(worst.values(), key=lambda fault: (fault.margin, fault.step))


def _met(mission: Mission, trace: Trace, fault: Fault, agents: dict[str, Agent]) -> str:
    point = _middle(trace, fault, agents)
    much = f"{-fault.margin:.3g} m too near"
    says = f"{_listed(fault.agents)} meet {_place(mission, point)} at {fault.step * mission.step:g} s, {much}"
    width = _narrow(mission, trace, fault, agents)
    if width is None:
        return says
    wide = f"{width:.3g} m wide" if width > 0 else "too narrow"
    return f"{says}: the passage is {wide} there, and two pass in {_two(mission, fault, agents):.3g} m"


def _middle(trace: Trace, fault: Fault, agents: dict[str, Agent]) -> Array:
    """The place between two agents, (dim,), metres."""
    rows = [agents[name].index for name in fault.agents]
    return np.asarray(trace.position[rows, fault.step].mean(axis=0))


def _two(mission: Mission, fault: Fault, agents: dict[str, Agent]) -> float:
    """The width in which the two pass each other, metres."""
    return sum(2 * agents[name].radius for name in fault.agents) + mission.separation + 2 * mission.clearance


def _narrow(mission: Mission, trace: Trace, fault: Fault, agents: dict[str, Agent]) -> float | None:
    """How wide the passage is in which two meet head-on, metres, where they cannot pass each other; in a plane only."""
    one, other = (agents[name].index for name in fault.agents)
    moves = trace.position[[one, other], fault.step + 1] - trace.position[[one, other], fault.step]
    along = moves[0] - moves[1]
    if len(along) != 2 or float(moves[0] @ moves[1]) >= 0:
        return None
    across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    need = _two(mission, fault, agents)
    reach = np.linspace(0.0, need, SAMPLES + 1)
    point = _middle(trace, fault, agents)
    width = 0.0
    for side in (across, -across):
        blocked = np.flatnonzero(~_free(mission, point + reach[:, None] * side))
        width += float(reach[blocked[0]]) if len(blocked) else need
    return width if width < need else None


def _free(mission: Mission, points: Array) -> Flags:
    """Which of these, (points, dim), are in the world and in no obstacle that stands: (points,)."""
    free: Flags = np.asarray(((points >= mission.world.low) & (points <= mission.world.high)).all(axis=-1))
    for obstacle in mission.obstacles:
        if isinstance(obstacle.motion, Still):
            free &= signed_distance(np, obstacle.shape, points) > 0
    return free


def _place(mission: Mission, point: Array) -> str:
    """The smallest words for where it is: its coordinates, and the nearest thing with a name."""
    where = f"at ({', '.join(f'{value + 0.0:.3g}' for value in point)})"
    things = [(each.name, each.shape) for each in mission.regions]
    things += [(each.name, each.shape) for each in mission.obstacles if isinstance(each.motion, Still)]
    away = [(float(signed_distance(np, shape, point)), name) for name, shape in things if name]
    if not away:
        return where
    distance, name = min(away)
    return f"{'in' if distance <= 0 else 'near'} `{name}` {where}"


def _touching(mission: Mission, best: Attempt) -> list[str]:
    """Each agent that touches an obstacle, where it first does."""
    first: dict[str, Fault] = {}
    for fault in best.faults:
        if fault.what == "an obstacle":
            first.setdefault(fault.agents[0], fault)
    rows = {agent.name: agent.index for agent in mission.agents}
    return [
        f"`{name}` touches an obstacle {_place(mission, best.trace.position[rows[name], fault.step])}"
        f" at {fault.step * mission.step:g} s"
        for name, fault in first.items()
    ]


def _competing(violated: Sequence[Judgement]) -> list[str]:
    """Requirements that both fail because of the same agents."""
    return [
        f"`{one.name}` and `{other.name}` compete for {_listed(shared)}"
        for one, other in combinations(violated, 2)
        if (shared := [name for name in one.agents if name in other.agents])
    ]


def _advice(
    mission: Mission, late: list[_Late], meetings: list[Fault], narrow: list[float], agents: dict[str, Agent]
) -> str:
    if narrow and meetings:
        two = max(_two(mission, fault, agents) for fault in meetings)
        return f"widen the passage to {two:.3g} m, give it a room where one can wait, or let one start behind the other"
    if late:
        more = max(math.ceil(max(each.seconds for each in late) / mission.step - 1e-9), 1) * mission.step
        horizon = mission.steps * mission.step
        return f"allow at least {more:g} s more: horizon {horizon + more:g} s, and the windows that end with it"
    if meetings:
        return f"allow more time, so that {_either(meetings[0].agents)} can wait for the other"
    return ""


def _some(sentences: list[str], more: str) -> list[str]:
    """The first of them, and how many there are besides."""
    left = len(sentences) - SHOWN
    return sentences if left <= 0 else [*sentences[:SHOWN], f"{left} more {more}"]


def _listed(names: Sequence[str]) -> str:
    """```a`, `b` and 3 more``"""
    shown = [f"`{name}`" for name in names[:SHOWN]]
    shown += [f"{len(names) - SHOWN} more"] if len(names) > SHOWN else []
    return " and ".join([", ".join(shown[:-1]), shown[-1]]) if len(shown) > 1 else "".join(shown)


def _either(names: Sequence[str]) -> str:
    return " or ".join(f"`{name}`" for name in names)


def _be(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"
