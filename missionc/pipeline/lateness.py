"""Lateness in a search's best candidate: who is still on the way when something is asked, and how much time that takes.

in   Mission, its kernel, the candidate as the acceptance test judged it
out  Late, each with a sentence, and the least time that is missing
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from missionc.backends.api import Attempt
from missionc.base.judgement import Judgement
from missionc.base.trace import Array, Trace
from missionc.ir import Agent, Mission
from missionc.ir.wording import listed
from missionc.kernel.analysis import robustness_unit
from missionc.kernel.conjuncts import conjuncts
from missionc.kernel.nodes import At, Kernel, Node
from missionc.kernel.walk import awaited, postorder
from missionc.monitoring.monitor import robustness
from missionc.monitoring.violation import first_violation
from missionc.world.dynamics import SPEED

PUSHED = ("separation", "an obstacle")
"""Who breaks one of these may be too fast because it is pushed about, and not because it has too little time."""


@dataclass(frozen=True, slots=True)
class Late:
    """Somebody who is short of time: how that is said, and by how much."""

    says: str
    names: tuple[str, ...]
    seconds: float
    """At least so much more time it needs."""
    asks: str = ""
    """The requirement that asks for it, where one does."""
    step: int = 0
    """By which step."""


def late_agents(mission: Mission, kernel: Kernel, best: Attempt) -> list[Late]:
    """Those who are late for a requirement or their finish, and those who are so by going too fast, unless pushed."""
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
        Late(f"`{agent.name}` goes faster than it can, and is {seconds:.2g} s late by that", (agent.name,), seconds)
        for agent in mission.agents
        if (seconds := float(extra[agent.index])) > 0 and agent.name not in known
    ]


def _too_fast(mission: Mission, best: Attempt) -> Array:
    """How much longer each agent takes for the steps in which it is too fast: (agents,), seconds."""
    extra = np.zeros(len(mission.agents))
    rows = {agent.name: agent for agent in mission.agents}
    for fault in best.faults:
        if fault.what == SPEED and (top := (agent := rows[fault.agents[0]]).dynamics.top_speed) > 0:
            move = best.trace.position[agent.index, fault.step + 1] - best.trace.position[agent.index, fault.step]
            extra[agent.index] += max(float(np.linalg.norm(move)) / top - mission.step, 0.0)
    return extra


def _awaiting(formula: Node) -> list[Node]:
    """The conjuncts of a formula in which something is awaited, each as it is asked at step 0."""
    parts = (
        each.windows[0] if each.windows else each.formula if each.agent is None else At(each.agent, each.formula)
        for each in conjuncts((formula,))
    )
    return [part for part in dict.fromkeys(parts) if any(awaited(node) for node in postorder((part,)))]


def _late(mission: Mission, trace: Trace, name: str, part: Node, extra: Array) -> list[Late]:
    """Whether a part of a requirement fails because some are still on their way when it asks for them."""
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
    says = f"{_listed(names)} {be} {short:.3g} m short of what `{name}` asks {when}"
    seconds = short / speed + float(max(extra[agent.index] for agent in asked))
    return [Late(says, names, seconds, name, found.step)]


def _under_way(trace: Trace, agent: Agent, step: int, short: float) -> bool:
    """Whether an agent that has so many metres left keeps its pace up to a step; else it waits or is held up."""
    lengths = np.linalg.norm(np.diff(trace.position[agent.index, : step + 1], axis=0), axis=-1)
    if not lengths.size or not lengths.any() or agent.dynamics.top_speed <= 0:
        return False
    last = max(math.ceil(short / agent.dynamics.top_speed / trace.step), 1)
    return bool(lengths[-last:].mean() >= lengths.mean() / 2)


def more_time(mission: Mission, late: Late, violated: Sequence[Judgement]) -> str:
    """Advice for whom or what the time is to be longer, and by how much at least, unless they violate more besides."""
    rivals = [each.name for each in violated if each.name != late.asks and not set(late.names).isdisjoint(each.agents)]
    if rivals:
        what = f"`{late.asks}`" if late.asks else _listed(late.names)
        return f"allow {what} more time, or ask less of {_listed(rivals)}"
    steps = max(math.ceil(late.seconds / mission.step - 1e-9), 1)
    more, until = f"at least {steps * mission.step:g} s more", f"{(late.step + steps) * mission.step:g} s"
    if not late.step:
        return f"allow {_listed(late.names)} {more} for its way, or a higher speed"
    if late.step >= mission.steps:
        return f"allow {more}: horizon {until}, and the windows that end with it"
    horizon = f", and a horizon of {until}" if late.step + steps > mission.steps else ""
    return f"allow `{late.asks}` {more}, until {until}{horizon}"


def _listed(names: Sequence[str]) -> str:
    return listed([f"`{name}`" for name in names])
