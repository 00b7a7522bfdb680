"""Stretches of a mission that were flown, and what is left of it after each, with the world and the team as they are.

in   a mission and its kernel, the stretch, the mission as it is written now
out  Remaining: the mission and the kernel that are left, and what of it can no longer be kept
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from missionc import ir
from missionc.base.trace import Array, Flags, Trace
from missionc.ir import Mission
from missionc.ir.kernel.nodes import Goal, Kernel, Node
from missionc.ir.kernel.normal_form import NO, constant
from missionc.ir.language.margins.resources import flag_truths, levels, within
from missionc.planning.progression.formula_progression import progressed
from missionc.planning.progression.rest_of_mission import rest_of, slowed
from missionc.planning.progression.symbol_map import SymbolMap


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Some steps that are over.

    Args:
        trace: (agents, steps + 1): the states of whoever was there, the last one the first of what follows.
        lost: the names of those who are there no longer after it.
        given_up: the names of requirements that nothing is asked of any more.
        slow: by their names, those who can go no faster than this after it, m/s.
        moving: by their names, the states of those who are in motion at its end, (5, 4), as of ``ir.Agent.begins``.
        stays: whether nobody goes back to its pad after it: no way there was found.
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


@dataclass(frozen=True, slots=True, eq=False)
class Remaining:
    """A mission after some of its steps.

    Args:
        elapsed: how many steps are over.
        violated: the names of the requirements that no continuation keeps.
        nobodys: of those that only agents could keep who are lost.
        flags_set: by the flag's name, the agents (by their names) of whom it was set at the last step that is over.
        whole: the mission and the kernel that it began as, where nobody is lost and nothing has changed since.
        seen: the traces of everything that is over, in order.
        slow: as of a ``Stretch``, of all that are over.
        stopping: ``mission`` with its agents as fast as before the last stretch ended: those who fly the stops.
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
    """What is left after one more stretch.

    Args:
        now: the mission as it is written now, whole: all its agents and steps.

    Raises:
        NotProgressableError: no formula says what is left of a goal.
        ValueError: the stretch is no motion of these agents, or lasts until the end.
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
    """The pads of those who have risen from one: where they stood, up to where, and how long ago."""
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
    """What every agent has left of every resource, by their names, at the last state."""
    found: dict[tuple[str, str], float] = {}
    for resource in mission.resources:
        left = levels(resource, trace)[:, -1]
        found.update({(resource.name, mission.agents[agent].name): float(left[agent]) for agent in resource.agents})
    return found


def _flags(before: Remaining, trace: Trace) -> tuple[tuple[str, frozenset[str]], ...]:
    """For each flag, those of whom it was set at the last step that is over, which is one before the last state."""
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
    """Who was in a region at some step: (agents, steps, dim) -> (agents,)."""
    if region is None:
        return np.zeros(len(position), dtype=np.bool_)
    return np.asarray(within(region, position).any(axis=1), dtype=np.bool_)


def _indices(mission: Mission, names: frozenset[str]) -> frozenset[int]:
    return frozenset(agent.index for agent in mission.agents if agent.name in names)
