"""Time robustness: each agent's maximum delay with which the plan still satisfies the mission.

    in   Mission, its kernel, the Trace of a plan that passes its checks
    out  Delay for each agent; a Check for each agent with a required delay tolerance

A delayed agent waits at its start, at rest, and then follows its trace until the mission ends; all others are on time.
The affected checks are repeated: moving and growing obstacles, separation in continuous time, the agent's finish, and
the requirements at the steps.

Source:
    Donzé, Maler, "Robust Satisfaction of Temporal Logic over Real-Valued Signals" (2010), section 4, time robustness.
    Lindemann, Rodionova, Pappas, "Temporal Robustness of Stochastic Signals" (2022), asynchronous temporal robustness;
    here for one agent's signal at a time, and only for delays.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from missionc.base.trace import Array, Indices, Trace
from missionc.geometry.curves.piecewise_polynomials import Curves, extents, motion
from missionc.geometry.vectors import norm
from missionc.ir import Mission
from missionc.ir.kernel.analysis import about_whom
from missionc.ir.kernel.nodes import Always, At, Kernel, Node
from missionc.ir.kernel.walk import conjuncts
from missionc.verification.certificate import CERTAIN, CONTACT, Check, Delay
from missionc.verification.monitoring.monitor import truths
from missionc.verification.monitoring.violation import first_violation
from missionc.verification.plan.clearances import check_obstacles, relative_margins
from missionc.verification.plan.starts_and_finishes import check_place

WORK = 400_000
"""Maximum number of agent states evaluated for all delays together; larger delays are not tested."""

FEWEST = 4
"""Number of delays, in steps, that are tested for each agent regardless of the work limit."""


def time_robustness(mission: Mission, kernel: Kernel, trace: Trace) -> tuple[Delay, ...]:
    """Delay tolerance of each agent, in the order of the mission."""
    late = _Late(mission, kernel, trace)
    states = trace.position.shape[0] * trace.position.shape[1]
    most = max(FEWEST, WORK // (states * len(mission.agents)))
    wanted = tolerated_steps(mission)
    return tuple(late.delay(agent.index, max(most, wanted.get(agent.index, 0))) for agent in mission.agents)


def tolerated_steps(mission: Mission) -> Mapping[int, int]:
    """Required delay tolerance in steps, by agent."""
    wanted: dict[int, int] = {}
    for tolerance in mission.tolerances:
        for agent in tolerance.agents:
            wanted[agent] = max(wanted.get(agent, 0), tolerance.steps)
    return wanted


def check_tolerances(mission: Mission, delays: tuple[Delay, ...]) -> Iterator[Check]:
    """Yield a check for each agent with a required delay tolerance; its margin is the additional tolerated delay."""
    for index, steps in sorted(tolerated_steps(mission).items()):
        delay, asked = delays[index], steps * float(mission.step)
        margin = round(delay.tolerated / mission.step) - steps
        detail = f"no violation with a delay of up to {asked:g} s of this agent alone"
        if margin < 0:
            detail = f"a delay of {delay.tolerated + mission.step:g} s violates {delay.broken}"
        passed = margin >= 0
        at, agents = (None, (delay.agent,)) if passed else (delay.at, delay.agents)
        yield Check("delay", delay.agent, margin * float(mission.step), "s", 0.0, passed, at, agents, detail)


def delayed(mission: Mission, trace: Trace, agent: int, steps: int) -> Trace:
    """The trace with one agent delayed by ``steps`` (at least one): it waits at its start, and the end of its trace is
    cut off.
    """
    position, velocity, heading = trace.position.copy(), trace.velocity.copy(), trace.heading.copy()
    last = position.shape[1] - 1
    steps = min(steps, last)
    position[agent, :steps], position[agent, steps:] = (
        trace.position[agent, 0],
        trace.position[agent, : last + 1 - steps],
    )
    velocity[agent, :steps], velocity[agent, steps:] = 0.0, trace.velocity[agent, : last + 1 - steps]
    heading[agent, :steps], heading[agent, steps:] = trace.heading[agent, 0], trace.heading[agent, : last + 1 - steps]
    if not mission.agents[agent].dynamics.has_momentum:  # at the last step, of the motion that ended there
        velocity[agent, last] = velocity[agent, last - 1]
    return Trace(trace.step, position, velocity, heading)


class _Late:
    """Evaluation of a plan with one delayed agent, with cached results for the agents on time."""

    def __init__(self, mission: Mission, kernel: Kernel, trace: Trace) -> None:
        self.mission, self.trace = mission, trace
        self.curves = motion(mission, trace)
        self.low, self.high = extents(self.curves)
        self.radii = np.array([one.radius for one in mission.agents])
        self.changing = tuple(obstacle for obstacle in mission.obstacles if not obstacle.constant)
        parts = [(goal.name, part) for goal in kernel.requirements for part in _parts(goal.formula)]
        about = about_whom((part for _, part in parts), len(mission.agents))
        self.about = [[(name, part) for name, part in parts if about[part][agent.index, 0]] for agent in mission.agents]

    def delay(self, agent: int, most: int) -> Delay:
        """Delay tolerance of an agent, at most ``most`` steps, and the check that one further step breaks."""
        name, step = self.mission.agents[agent].name, float(self.mission.step)
        last = self.mission.steps
        for steps in range(1, min(most, last) + 1):
            found = min(self._broken(agent, steps), key=_when, default=None)
            if found is not None:
                what, subject, at, agents = found
                return Delay(name, (steps - 1) * step, False, what, subject, at, agents)
        return Delay(name, min(most, last) * step, most < last)

    def _broken(self, agent: int, steps: int) -> Iterator[_Broken]:
        late = delayed(self.mission, self.trace, agent, steps)
        yield from self._bodies(agent, steps)
        one = self.mission.agents[agent]
        if one.finish is not None:
            check = check_place(one, "finish", one.finish, late.position[agent, -1], float(self.mission.horizon))
            if not check.passed:
                yield "finish", one.name, float(self.mission.horizon), (one.name,)
        yield from self._requirements(agent, late)

    def _bodies(self, agent: int, steps: int) -> Iterator[_Broken]:
        mission, curves = self.mission, self.curves
        own = curves.coefficients[agent]
        waiting = np.zeros_like(own[:steps])
        waiting[..., 0] = own[0, :, 0]
        moved = np.concatenate([waiting, own[: len(own) - steps]])
        one = mission.agents[agent]
        if self.changing:
            alone = replace(mission, agents=(replace(one, index=0),), obstacles=self.changing)
            for check in check_obstacles(alone, Curves(curves.times, moved[None])):
                if not check.passed:
                    yield "obstacle", check.subject, check.at, check.agents
        others = self._near(agent)
        if others.size:
            yield from self._others(agent, moved, others)

    def _near(self, agent: int) -> Indices:
        """Agents that may come too near to an agent at some time, by the bounding boxes of their trajectories."""
        beside = np.maximum(self.low - self.high[agent], self.low[agent] - self.high).clip(0.0)
        near = norm(beside) <= self.radii + self.radii[agent] + self.mission.separation + CERTAIN
        near[agent] = False
        return np.flatnonzero(near)

    def _others(self, agent: int, moved: Array, others: Indices) -> Iterator[_Broken]:
        mission, curves = self.mission, self.curves
        relative = Curves(curves.times, moved[None] - curves.coefficients[others])
        need = self.radii[others] + self.radii[agent] + mission.separation
        lower, upper, when = (each.reshape(len(others), -1) for each in relative_margins(relative, need, 0.0))
        slack = 0.0 if moved.shape[-1] == 2 else CERTAIN
        close = (lower < -CONTACT - slack) | (upper < -CONTACT)
        if close.any():
            piece = int(close.any(axis=0).argmax())
            other = int(np.where(close[:, piece], upper[:, piece], np.inf).argmin())
            names = (mission.agents[agent].name, mission.agents[others[other]].name)
            yield "separation", "all pairs", float(curves.times[piece] + when[other, piece]), names

    def _requirements(self, agent: int, late: Trace) -> Iterator[_Broken]:
        parts = self.about[agent]
        known = truths((part for _, part in parts), self.mission, late)
        for name, part in parts:
            if not known[part][0, 0]:
                where = first_violation(part, self.mission, late)
                names = tuple(each.name for each in self.mission.agents if each.index in where.agents)
                yield "requirement", name, where.step * float(self.mission.step), names


_Broken = tuple[str, str, float | None, tuple[str, ...]]
"""A failed check: its name, its subject, its time in seconds, and its agents."""


def _when(found: _Broken) -> float:
    return np.inf if found[2] is None else found[2]


def _parts(formula: Node) -> Iterator[Node]:
    """Team formulas that must all hold at step 0 if the given formula holds."""
    for agent, windows, body in conjuncts((formula,)):
        node = body
        for window in reversed(windows):
            node = Always(node, window.low, window.high, window.span)
        yield node if agent is None else At(agent, node)
