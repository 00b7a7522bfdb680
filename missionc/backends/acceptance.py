"""Acceptance test of a candidate trajectory: bodies, limits and requirements, at the samples and between them.

The verifier repeats these checks independently. The test lets the search continue if the verifier would reject the
candidate.
"""

from __future__ import annotations

import numpy as np

from missionc.backends.api import Attempt, Violation
from missionc.base.trace import Trace
from missionc.geometry.clearance import clear_motions, clear_of_movers, standing_solids
from missionc.geometry.curves.piecewise_polynomials import motion
from missionc.geometry.dynamics import UNIT_OF, Motions, States, check_step, motions_between
from missionc.geometry.relative_motion import closest_approach
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Kernel
from missionc.verification.monitoring.monitor import monitor

ROUNDING = 1e-9
"""Fraction of a limit by which rounding errors may exceed it."""


def violated_between_samples(mission: Mission, kernel: Kernel, trace: Trace) -> frozenset[str]:
    """Names of the requirements that hold at the steps of a motion, but not surely between them."""
    from missionc.verification.between.between_steps import between_steps  # only if wanted

    judged = between_steps(mission, kernel, trace, motion(mission, trace))
    return frozenset(each.requirement for each in judged if not each.holds)


def attempt(mission: Mission, kernel: Kernel, trace: Trace) -> Attempt:
    """Candidate trajectory with its verdict on every requirement and all violated constraints."""
    faults = [*_places(mission, trace), *_dynamics(mission, trace), *_bodies(mission, trace), *_apart(mission, trace)]
    return Attempt(monitor(mission, kernel, trace).requirements, tuple(faults), trace)


def _places(mission: Mission, trace: Trace) -> list[Violation]:
    faults: list[Violation] = []
    low, high = np.array(mission.world.low), np.array(mission.world.high)
    room = np.minimum(trace.position - low, high - trace.position).min(axis=-1)
    faults.extend(
        Violation("the world's bounds", (mission.agents[agent].name,), int(step), float(room[agent, step]))
        for agent, step in np.argwhere(room < 0)
    )
    for agent in mission.agents:
        for name, place, step in (("its start", agent.start, 0), ("its finish", agent.finish, mission.steps)):
            if place is not None and place.region is not None:
                outside = float(signed_distance(np, place.shape, trace.position[agent.index, step]))
                if outside > 0:
                    faults.append(Violation(name, (agent.name,), step, -outside))
    return faults


def _dynamics(mission: Mission, trace: Trace) -> list[Violation]:
    faults: list[Violation] = []
    for agent in mission.agents:
        position, velocity = trace.position[agent.index], trace.velocity[agent.index]
        margins = check_step(agent.dynamics, position[:-1], position[1:], velocity[:-1], velocity[1:], mission.step)
        parts = list(margins)
        each = np.stack([margins[part] for part in parts])
        for step in np.flatnonzero(each.min(axis=0) < -ROUNDING):  # a step counts once, by its worst violation
            part = parts[int(each[:, step].argmin())]
            faults.append(Violation(part, (agent.name,), int(step), float(each[:, step].min()), UNIT_OF[part]))
        if np.isfinite(agent.dynamics.top_turn):
            heading = trace.heading[agent.index]
            turned = np.abs((np.diff(heading) + np.pi) % (2 * np.pi) - np.pi)
            most = agent.dynamics.top_turn * mission.step + ROUNDING
            faults.extend(
                Violation("its turning rate", (agent.name,), int(step)) for step in np.flatnonzero(turned > most)
            )
    return faults


def _motions(mission: Mission, trace: Trace) -> Motions:
    """Motions of every step of a trace, (agents, steps)."""
    rows = []
    for agent in mission.agents:
        own = States(trace.position[agent.index], trace.velocity[agent.index])
        rows.append(motions_between(agent.dynamics, own.take(slice(-1)), own.take(slice(1, None)), mission.step))
    return Motions.stacked(rows)


def _bodies(mission: Mission, trace: Trace) -> list[Violation]:
    faults: list[Violation] = []
    standing = standing_solids(mission)
    whole = _motions(mission, trace)
    for agent in mission.agents:
        motions = whole.take(agent.index)
        margin = agent.radius + mission.clearance
        clear = clear_motions(standing, motions, mission.step, margin)
        steps = np.arange(mission.steps)
        clear &= clear_of_movers(mission, motions, margin)[steps, steps]
        faults.extend(Violation("an obstacle", (agent.name,), int(step)) for step in np.flatnonzero(~clear))
    return faults


def _apart(mission: Mission, trace: Trace) -> list[Violation]:
    faults: list[Violation] = []
    count = len(mission.agents)
    spacing = SpacingTable.of(mission)
    motions = _motions(mission, trace)
    for one in range(count - 1):
        rest = np.arange(one + 1, count)
        metric = spacing.metric(np.array(one), rest)
        factors = None if metric is None else metric[:, None]
        nearest = closest_approach(motions.take(one), motions.take(rest), mission.step, factors)
        margin = nearest - spacing.between(np.array(one), rest)[:, None]
        for other, step in np.argwhere(margin < 0):
            who = mission.agents[one].name, mission.agents[int(other) + one + 1].name
            faults.append(Violation("separation", who, int(step), float(margin[other, step])))
    return faults
