"""Completed stretches of a mission, and the remaining mission after each, with the present world and team.

in   a mission and its kernel, the stretch, the current text of the mission
out  Remaining: the remaining mission and kernel, and the requirements that are violated
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace

import numpy as np

from missionc import ir
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Goal, Kernel, Node
from missionc.ir.kernel.normal_form import NO, constant
from missionc.ir.language.margins.resources import flag_truths, levels, within
from missionc.planning.progression.formula_progression import progressed
from missionc.planning.progression.rest_of_mission import rest_of, slowed
from missionc.planning.progression.symbol_map import SymbolMap


class Stretch(Record, eq=False):
    """Completed sequence of steps of a mission, between two plans.

    Args:
        trace: (agents, steps + 1): the states of the agents present; the last state is the first of the next stretch.
        lost: names of the agents lost after the stretch.
        given_up: names of the dropped requirements.
        slow: lower speed limits after the stretch, m/s, by agent name.
        moving: states of agents in motion at the end of the stretch, (5, 4), by agent name, as in ``ir.Agent.begins``.
        stays: True if no agent returns to its pad after the stretch, because no path was found.
    """

    trace: Trace
    lost: tuple[str, ...] = ()
    given_up: tuple[str, ...] = ()
    slow: Mapping[str, float] = field(default_factory=dict)
    moving: Mapping[str, Array] = field(default_factory=dict)
    stays: bool = False

    @property
    def steps(self) -> int:
        return int(self.trace.position.shape[1]) - 1


class Remaining(Record, eq=False):
    """Remaining mission after some completed steps.

    Args:
        elapsed: number of completed steps.
        violated: names of the requirements that no continuation can satisfy.
        nobodys: names of the requirements that only lost agents could satisfy.
        flags_set: by flag name, the names of the agents with the flag set at the last completed step.
        whole: the initial mission and kernel, if no agent is lost and nothing has changed.
        seen: traces of all completed stretches, in order.
        slow: lower speed limits, m/s, by agent name, over all completed stretches.
        stopping: ``mission`` with the agents' speed limits before the end of the last stretch, used to stop them.
    """

    mission: Mission
    kernel: Kernel
    elapsed: int = 0
    violated: tuple[str, ...] = ()
    nobodys: tuple[str, ...] = ()
    flags_set: tuple[tuple[str, frozenset[str]], ...] = ()
    whole: tuple[Mission, Kernel] | None = None
    seen: tuple[Trace, ...] = ()
    slow: Mapping[str, float] = field(default_factory=dict)
    stopping: Mission | None = None


def after(before: Remaining, stretch: Stretch, now: Mission) -> Remaining:
    """Remaining mission after one more stretch.

    Args:
        now: the mission of the current text, with all its agents and steps.

    Raises:
        NotProgressableError: no formula expresses the rest of a goal.
        ValueError: the stretch has other agents than the mission, or leaves no step of it.
    """
    mission, trace = before.mission, stretch.trace
    if trace.position.shape[0] != len(mission.agents) or not 0 <= stretch.steps < mission.steps:
        raise ValueError("the stretch has other agents than the mission, or leaves no step of it")
    left = tuple(agent.name for agent in mission.agents if agent.name not in stretch.lost)
    rows = [agent.index for agent in mission.agents if agent.name in left]
    elapsed = before.elapsed + stretch.steps
    slow = {**before.slow, **stretch.slow}
    ends, pads = trace.position[rows, -1], {} if stretch.stays else _pads(mission, trace)
    begun = rest_of(now, elapsed, ends, left, _levels(mission, trace), stretch.moving, pads)
    rest = slowed(begun, slow)
    flags = _flags(before, trace)
    since = SymbolMap(mission, rest, {name: _indices(mission, names) for name, names in flags})
    formulas = progressed(mission, before.kernel, trace, since)
    goals = before.kernel.goals
    asked = [
        (goal, formula) for goal, formula in zip(goals, formulas, strict=True) if goal.name not in stretch.given_up
    ]
    violated = tuple(goal.name for goal, formula in asked if _fails(goal, formula))
    nobodys = tuple(goal.name for goal, formula in asked if goal.weight is None and formula is None)
    kept = [Goal(goal.name, NO if formula is None else formula, goal.span, goal.weight) for goal, formula in asked]
    words = {goal.name: ir.Truth(True, goal.span) for goal in kept}
    spans = {each.name: each.span for each in now.requirements}
    kernel = Kernel(
        tuple(goal for goal in kept if goal.weight is None),
        tuple(goal for goal in kept if goal.weight is not None),
        {words[goal.name]: goal.formula for goal in kept},
    )
    rest = replace(
        rest,
        requirements=tuple(
            ir.Requirement(goal.name, words[goal.name], spans.get(goal.name, goal.span)) for goal in kernel.requirements
        ),
        preferences=tuple(
            ir.Preference(goal.name, words[goal.name], goal.weight or 0.0, goal.span) for goal in kernel.preferences
        ),
    )
    stopping = slowed(begun, before.slow)
    return Remaining(rest, kernel, elapsed, violated, nobodys, flags, slow=slow, stopping=stopping)


def _fails(goal: Goal, formula: Node | None) -> bool:
    return goal.weight is None and formula is not None and constant(formula) is False


def _pads(mission: Mission, trace: Trace) -> dict[str, ir.Pad]:
    """Pads of the agents that have taken off, by agent name: positions, heights, and time since takeoff."""
    found = {}
    seconds = float(mission.step) * (trace.position.shape[1] - 1)
    for agent in mission.agents:
        pad = agent.pad
        if pad is None:
            continue
        if pad.risen is None:
            start = tuple(trace.position[agent.index, 0].tolist())
            hover = start[2] if pad.hover is None and len(start) > 2 else pad.hover
            pad = replace(pad, point=start[:2] if pad.point is None else pad.point, hover=hover, risen=0.0)
        found[agent.name] = replace(pad, risen=(pad.risen or 0.0) + seconds)
    return found


def _levels(mission: Mission, trace: Trace) -> dict[tuple[str, str], float]:
    """Level of every resource at the last state of the trace, by resource and agent name."""
    found: dict[tuple[str, str], float] = {}
    for resource in mission.resources:
        left = levels(resource, trace)[:, -1]
        found.update({(resource.name, mission.agents[agent].name): float(left[agent]) for agent in resource.agents})
    return found


def _flags(before: Remaining, trace: Trace) -> tuple[tuple[str, frozenset[str]], ...]:
    """For each flag, the agents with the flag set at the last completed step, which precedes the last state."""
    mission, earlier = before.mission, dict(before.flags_set)
    steps = trace.position.shape[1] - 1
    if not steps:
        return before.flags_set
    found = []
    for flag in mission.flags:
        truths = flag_truths(flag, trace)[:, steps - 1]
        cleared = _was_in(flag.cleared_in, trace.position[:, :steps])
        stays = [
            agent.name in earlier.get(flag.name, frozenset()) and not cleared[agent.index] for agent in mission.agents
        ]
        found.append((flag.name, frozenset(mission.agents[each].name for each in np.flatnonzero(truths | stays))))
    return tuple(found)


def _was_in(region: ir.Region | None, position: Array) -> Flags:
    """Return true for each agent that was in a region at some step: (agents, steps, dim), metres -> (agents,),
    boolean."""
    if region is None:
        return np.zeros(len(position), dtype=np.bool_)
    return np.asarray(within(region, position).any(axis=1), dtype=np.bool_)


def _indices(mission: Mission, names: frozenset[str]) -> frozenset[int]:
    return frozenset(agent.index for agent in mission.agents if agent.name in names)
