"""Dynamics of a trace, step by step: equations of motion and limits of each agent."""

from __future__ import annotations

import math

import numpy as np

from missionc.base.extensions import Kind, guard, rejected
from missionc.base.trace import Array, Trace
from missionc.geometry.vectors import norm
from missionc.ir import Agent, Mission
from missionc.verification.certificate import MOTION, Check, judged


def check_shape(mission: Mission, trace: Trace) -> Check:
    """Check that the trace has the mission's sizes and finite numbers, as all other checks require."""
    states = (len(mission.agents), mission.steps + 1)
    wanted = (*states, mission.dimension)
    fits = trace.position.shape == wanted and trace.velocity.shape == wanted and trace.heading.shape == states
    finite = all(bool(np.isfinite(array).all()) for array in (trace.position, trace.velocity, trace.heading))
    on_time = math.isclose(trace.step, mission.step, rel_tol=1e-12)
    detail = f"{wanted[0]} agents, {wanted[1]} states of {wanted[2]} coordinates, {mission.step:g} s apart, all finite"
    return Check("shape", "plan", 0.0, "", 0.0, fits and finite and on_time, detail=detail)


def check_dynamics(mission: Mission, trace: Trace) -> list[Check]:
    """Checks of every agent's states against its equations of motion and limits; the trace has the mission's shape."""
    findings: list[Check] = []
    for agent in mission.agents:
        position, velocity = trace.position[agent.index], trace.velocity[agent.index]
        dynamics, step = agent.dynamics, trace.step
        motion = _parabolic if dynamics.has_momentum else _straight
        findings.append(motion(agent, position, velocity, step))
        # Within a step of constant acceleration, the speed is largest at an end.
        flown = norm(velocity) if dynamics.has_momentum else mean_rates(position, step)
        findings.append(_speed(agent, flown, dynamics.lowest_speed, dynamics.top_speed, step))
        if dynamics.faces_ahead:
            findings.append(_facing(agent, position, trace.heading[agent.index], step))
        if math.isfinite(dynamics.top_turn):
            findings.append(_turn(agent, trace.heading[agent.index], dynamics.top_turn, step))
        if math.isfinite(dynamics.top_acceleration):
            findings.append(_acceleration(agent, velocity, dynamics.top_acceleration, step))
        findings += _rules(agent, position, trace.heading[agent.index], step)
    return findings


def mean_rates(values: Array, step: float) -> Array:
    """Norm of the mean rate of change in each step: speeds from positions, accelerations from velocities.

    Args:
        values: (..., steps + 1, dim), metres or m/s.

    Returns:
        (..., steps), m/s or m/s².
    """
    rates: Array = norm(np.diff(values, axis=-2)) / step
    return rates


def facing_errors(position: Array, heading: Array) -> Array:
    """Distance between each horizontal move and a move of the same length in the direction of the heading.

    Args:
        position: (..., steps + 1, dim), metres.
        heading: (..., steps), rad, at the beginning of each move.

    Returns:
        (..., steps), metres. A climb does not turn the vehicle: altitudes do not count.
    """
    move = np.diff(position, axis=-2)[..., :2]
    facing = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    return norm(move - norm(move)[..., None] * facing)


def turned(change: Array) -> Array:
    """Absolute change of heading modulo a full turn, at most pi: (...), rad -> (...), rad."""
    return np.asarray(np.abs((change + math.pi) % (2 * math.pi) - math.pi))


def _straight(agent: Agent, position: Array, velocity: Array, step: float) -> Check:
    error = norm(np.diff(position, axis=0) - velocity[:-1] * step)
    # The last velocity belongs to the motion that ended there.
    last = norm(velocity[-1:] - velocity[-2:-1]) * step
    return _worst(
        agent, "motion", -np.concatenate([error, last]), "m", step, "position, velocity and time are consistent"
    )


def _parabolic(agent: Agent, position: Array, velocity: Array, step: float) -> Check:
    error = np.diff(position, axis=0) - (velocity[1:] + velocity[:-1]) / 2 * step
    margin = -norm(error)
    return _worst(
        agent, "motion", margin, "m", step, "position, velocity and time are consistent with constant acceleration"
    )


def _speed(agent: Agent, speeds: Array, slowest: float, fastest: float, step: float) -> Check:
    margin = fastest - speeds
    if slowest > 0:
        margin = np.minimum(margin, speeds - slowest)
    allowed = f"{slowest:g} to {fastest:g} m/s" if slowest > 0 else f"at most {fastest:g} m/s"
    return _worst(agent, "speed", margin, "m/s", step, allowed)


def _acceleration(agent: Agent, velocity: Array, most: float, step: float) -> Check:
    margin = most - mean_rates(velocity, step)
    return _worst(agent, "acceleration", margin, "m/s^2", step, f"at most {most:g} m/s^2")


def _facing(agent: Agent, position: Array, heading: Array, step: float) -> Check:
    error = facing_errors(position, heading[:-1])
    return _worst(agent, "heading", -error, "m", step, "it moves along its heading")


def _turn(agent: Agent, heading: Array, turn: float, step: float) -> Check:
    allowed = f"at most {turn * step:g} rad from step to step"
    return _worst(agent, "turn", turn * step - turned(np.diff(heading)), "rad", step, allowed)


def _rules(agent: Agent, position: Array, heading: Array, step: float) -> list[Check]:
    """Checks of each rule that the dynamics of an extension defines.

    Raises:
        ExtensionError: a rule has no margin of finite numbers with a unit.
    """
    word, checks = agent.dynamics.word, []
    with guard(Kind.DYNAMICS, word):
        margins = agent.dynamics.step_margins(position, heading, step)
        for name in agent.dynamics.rules:
            margin, unit = margins[name] if name in margins and len(margins[name]) == 2 else ((), None)
            numbers = np.atleast_1d(np.asarray(margin, dtype=np.float64))
            if not (isinstance(unit, str) and numbers.ndim == 1 and numbers.size and np.isfinite(numbers).all()):
                says = f"has no margin of the rule `{name}`: it needs finite numbers, one a step, and a unit"
                raise rejected(Kind.DYNAMICS, word, says)
            checks.append(_worst(agent, "rule", numbers, unit, step, f"the rule `{name}` of `{word}`"))
    return checks


def _worst(agent: Agent, name: str, margin: Array, unit: str, step: float, detail: str) -> Check:
    index = int(np.argmin(margin)) if margin.size else 0
    least = float(margin[index]) if margin.size else 0.0
    return judged(name, agent.name, least, unit, MOTION, at=index * step, agents=(agent.name,), detail=detail)
