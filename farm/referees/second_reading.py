"""The second reading of the semantics: the monitor must agree with ``tests.reference`` about a motion.

in   a mission as resolved, its kernel, a trace of it
says Broken, where the two readings differ in truth or in robustness
"""

from __future__ import annotations

import math

import numpy as np

from farm.trial import Broken
from missionc import ir
from missionc.base.trace import Judgement, Trace
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring import monitor
from tests import reference

NEAR = 1e-6
"""Tolerance for robustness, metres or other units: rounding alone stays below it."""


def agree(mission: ir.Mission, kernel: Kernel, trace: Trace, about: str) -> None:
    """Check that both readings of every requirement and preference agree.

    Args:
        about: description of the motion, for messages.

    Raises:
        Broken: the readings differ.
    """
    if any(isinstance(graph, ir.Sight) and not all(map(_convex, graph.shapes)) for graph in mission.graphs):
        return  # the second reading looks past convex shapes only
    judged = monitor.monitor(mission, kernel, trace)
    run = reference.Run(
        mission,
        [[tuple(point) for point in agent] for agent in trace.position.tolist()],
        [[tuple(point) for point in agent] for agent in trace.velocity.tolist()],
        trace.heading.tolist(),
    )
    goals: list[ir.Requirement | ir.Preference] = [*mission.requirements, *mission.preferences]
    for goal, judgement in zip(goals, [*judged.requirements, *judged.preferences], strict=True):
        value = reference.robustness(goal.formula, run, 0, 0)
        holds = reference.truth(goal.formula, run, 0, 0)
        if not _near(judgement.robustness, value) or (holds != judgement.satisfied and abs(value) > NEAR):
            promise = "The monitor and the second implementation of the semantics agree on every motion."
            seen = f"{about}: `{goal.name}`: {_said(judgement)}, and {holds}, {value} by the second implementation"
            raise Broken("second reading", promise, f"{seen}\n{trace.position.tolist()}")


def random_motion(mission: ir.Mission, seed: int) -> Trace:
    """Random motion of all agents that ignores dynamics, obstacles and goals."""
    draw = np.random.default_rng(seed)
    low, high = (np.array(corner) for corner in (mission.world.low, mission.world.high))
    agents, states = len(mission.agents), mission.steps + 1
    begin = draw.uniform(low, high, (agents, 1, len(low)))
    moves = draw.normal(0, draw.choice([0.1, 0.7, 2.0]), (agents, states, len(low)))
    moves[draw.random((agents, states)) < 0.2] = 0.0
    position = np.clip(begin + np.cumsum(moves, axis=1), low, high)
    velocity = np.zeros_like(position)
    if states > 1:
        velocity[:, :-1] = np.diff(position, axis=1) / mission.step
        velocity[:, -1] = velocity[:, -2]
    return Trace(mission.step, position, velocity, draw.uniform(-math.pi, math.pi, (agents, states)))


def _convex(shape: ir.Shape) -> bool:
    return isinstance(shape, ir.Box | ir.Disc | ir.Ball)


def _near(one: float, other: float) -> bool:
    return one == other or math.isclose(one, other, rel_tol=1e-9, abs_tol=NEAR)


def _said(judgement: Judgement) -> str:
    return f"{judgement.satisfied}, {judgement.robustness} by the monitor"
