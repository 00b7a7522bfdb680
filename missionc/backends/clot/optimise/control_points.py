"""Uniform B-splines: trajectories as control points, such that any control points satisfy the equations of motion.

First order: the control points are the positions at the steps, joined by straight lines. Second order: the control
points define a uniform quadratic B-spline with constant acceleration within each step. In both, the motion in a step is
linear in at most three neighbouring control points. Limits and distances therefore have direct gradients, and the
equations of motion hold exactly.

Source:
    [clot] (1), and the double integrator of its hardware; de Boor for the spline.

Pure pursuit: trajectories of agents that turn slowly or cannot wait, as near as possible to given trajectories.

In every step the agent turns towards its next position and moves as far ahead as needed, within its limits. It rounds
corners, turns in place, and circles if it cannot wait. A waiting agent turns towards its next motion. Trajectories
within the dynamics stay unchanged. Obstacles are ignored.

Source:
    Coulter, "Implementation of the pure pursuit path tracking algorithm", 1992.
"""

from __future__ import annotations

import math

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Flags, Indices, Trace
from missionc.geometry.dynamics import can_wait, turn_in_step
from missionc.ir import Dynamics, Mission


def followed(mission: Mission, position: Array) -> Array:
    """Positions, (agents, steps + 1, dim), metres, in which pursuit replaces the trajectories of agents that turn
    slowly or cannot wait."""
    result = position.copy()
    for agent in mission.agents:
        if not can_wait(agent.dynamics) or math.isfinite(turn_in_step(agent.dynamics, mission.step)):
            result[agent.index] = pursued(agent.dynamics, position[agent.index], mission.step)
    return result


def pursued(dynamics: Dynamics, ahead: Array, step: float) -> Array:
    """First-order trajectory that follows positions at the steps, (steps + 1, dim), metres, within the dynamics."""
    still = 1e-4  # share of its longest step, below which an agent that can wait is at rest
    limit = turn_in_step(dynamics, step)
    shortest, longest = dynamics.lowest_speed * step, dynamics.top_speed * step
    position, facing = ahead.copy(), math.nan
    leaves = _leaves(ahead[:, :2], still * longest)
    for now in range(len(ahead) - 1):
        way = ahead[now + 1] - position[now]
        if math.hypot(way[0], way[1]) > still * longest:
            wanted = math.atan2(way[1], way[0])
            turn = 0.0 if math.isnan(facing) else (wanted - facing + math.pi) % (2 * math.pi) - math.pi
            if abs(turn) <= limit and shortest <= np.linalg.norm(way) <= longest:
                facing, position[now + 1] = wanted, ahead[now + 1]
                continue
            facing = wanted - turn + max(-limit, min(limit, turn))
        elif not math.isnan(facing) and leaves[now] < len(ahead):
            next_way = ahead[leaves[now]] - position[now]
            turn = (math.atan2(next_way[1], next_way[0]) - facing + math.pi) % (2 * math.pi) - math.pi
            facing += max(-limit, min(limit, turn))
        direction = 0.0 if math.isnan(facing) else facing
        along = way[0] * math.cos(direction) + way[1] * math.sin(direction)
        far = max(shortest, min(longest, along if along > still * longest else 0.0))
        move = np.array([far * math.cos(direction), far * math.sin(direction), *way[2:]])
        if len(move) > 2:
            climb = math.sqrt(max(0.0, longest**2 - far**2))
            move[2] = max(-climb, min(climb, move[2]))
        position[now + 1] = position[now] + move
    return position


def _leaves(position: Array, still: float) -> list[int]:
    """For each step, the next step with another position, (steps + 1, 2), metres; past the last step if the position
    stays."""
    leaves = [len(position)] * len(position)
    for now in range(len(position) - 2, -1, -1):
        moves = math.hypot(*(position[now + 1] - position[now])) > still
        leaves[now] = now + 1 if moves else leaves[now + 1]
    return leaves


SPARE = 3
"""Number of control points beyond the number of steps, so that arguments read three; unneeded points stay fixed."""


class Arguments(Record, eq=False):
    """Points, velocities or accelerations of trajectories, each a weighted sum of three neighbouring control points.

    Args:
        agent: index of the agent, (arguments,).
        first: index of the first of the three control points, (arguments,).
        weight: (arguments, 3), dimensionless, per second or per second squared.
    """

    agent: Indices
    first: Indices
    weight: Array

    def of(self, control: Array) -> Array:
        """Values of the weighted sums, (arguments, dim), for control points (agents, points, dim), metres."""
        points = control[self.agent[:, None], self.first[:, None] + np.arange(3)]
        values: Array = np.einsum("rk,rkd->rd", self.weight, points)
        return values

    def take(self, which: Indices | Flags) -> Arguments:
        """Arguments selected by index, (some,), or by flag, (arguments,)."""
        return Arguments(self.agent[which], self.first[which], self.weight[which])


class Splines(Record, eq=False):
    """Mapping from control points to trajectories of a mission's agents.

    Args:
        steps: number of steps; 0 for a single configuration.
        step: duration of a step, seconds.
        smooth: (agents,), True for second-order agents.
        fixed: (agents, points), True for fixed control points.
        rest: step from which on all agents are at rest; None without such a step.
    """

    steps: int
    step: float
    smooth: Flags
    fixed: Flags
    rest: int | None = None

    @property
    def points(self) -> int:
        return self.steps + SPARE

    def unknowns(self) -> Indices:
        """Index of the unknown behind each control point: (agents, points), -1 for fixed points; points at rest share
        one unknown."""
        resting, point = self._resting(), np.arange(self.points)
        held = self.fixed | (resting & (resting & self.fixed).any(axis=1, keepdims=True))
        first = np.where(resting, self.rest or 0, point)
        number = np.full(held.shape, -1, dtype=np.int64)
        own = ~held & (first == point)
        number[own] = np.arange(int(own.sum()))
        return np.where(held, -1, np.take_along_axis(number, first, axis=1))

    def at_rest(self, control: Array) -> Array:
        """Control points, (agents, points, dim), metres, changed so that all agents are at rest from the step ``rest``
        on."""
        resting = self._resting()
        rested = control.copy()
        for agent, here in enumerate(resting):
            if here.any():
                held = np.flatnonzero(here & self.fixed[agent])
                rested[agent, here] = control[agent, held[0] if held.size else np.flatnonzero(here)[-1]]
        return rested

    def _resting(self) -> Flags:
        """Return true for each control point at which an agent must be at rest, (agents, points)."""
        point = np.arange(self.points)
        if self.rest is None:
            return np.zeros_like(self.fixed)
        resting: Flags = (point >= self.rest) & (point <= self.steps + self.smooth[:, None])
        return resting

    def position(self, agent: Indices, step: Indices, part: Array) -> Arguments:
        """Positions of agents, metres, at the fraction ``part`` (0 to 1) of the step after each given step, as sums of
        control points.

        Shape: agents and steps (arguments,).
        """
        smooth, part = self.smooth[agent][:, None], np.asarray(part, dtype=float)[:, None]
        straight = np.concatenate([1 - part, part, 0 * part], axis=1)
        if not smooth.any():
            return Arguments(agent, step, straight)
        spline = np.concatenate([(1 - part) ** 2 / 2, 0.5 + part - part**2, part**2 / 2], axis=1)
        return Arguments(agent, step, np.where(smooth, spline, straight))

    def velocity(self, agent: Indices, step: Indices) -> Arguments:
        """Velocities of agents, m/s, at given steps, as sums of control points; agents and steps are (arguments,).

        The velocity of a first-order agent is that of the step that begins at the state (at the last state, of the step
        that ended there).
        """
        latest = np.where(self.smooth[agent], self.steps, max(self.steps - 1, 0))
        weight = np.array([-1.0, 1.0, 0.0]) / self.step if self.steps else np.zeros(3)
        return Arguments(agent, np.minimum(step, latest), np.tile(weight, (len(agent), 1)))

    def acceleration(self, agent: Indices, step: Indices) -> Arguments:
        """Accelerations of second-order agents, m/s², within given steps, as sums of control points; agents and steps
        are (arguments,)."""
        return Arguments(agent, step, np.tile(np.array([1.0, -2.0, 1.0]) / self.step**2, (len(agent), 1)))

    def states(self, control: Array) -> tuple[Array, Array]:
        """Positions, metres, and velocities, m/s, at the steps.

        Shape: control points (..., agents, points, dim), metres -> (..., agents, steps + 1, dim) twice.
        """
        count = self.steps + 1
        here, ahead = control[..., :count, :], control[..., 1 : count + 1, :]
        smooth = self.smooth[:, None, None]
        position = np.where(smooth, (here + ahead) / 2, here)
        if self.steps == 0:
            return position, np.zeros_like(position)
        velocity = (ahead - here) / self.step
        first_order = np.concatenate([velocity[..., :-1, :], velocity[..., -2:-1, :]], axis=-2)
        return position, np.where(smooth, velocity, first_order)

    def joined(self, position: Array, velocity: Array) -> Array:
        """Control points of trajectories with these positions, metres, and velocities, m/s.

        Shape: (agents, steps + 1, dim) twice -> (agents, points, dim), metres.

        Second-order trajectories must have constant accelerations between their states.
        """
        control = self.through(position)
        half = velocity * (self.step / 2)
        spline = np.concatenate([position - half, *[position[:, -1:] + half[:, -1:]] * (SPARE - 1)], axis=1)
        return np.where(self.smooth[:, None, None], spline, control)

    def through(self, position: Array) -> Array:
        """Control points of trajectories near the positions.

        Shape: (..., agents, steps + 1, dim), metres -> (..., agents, points, dim), metres.

        First-order trajectories pass through the positions; second-order trajectories start and end there at rest, and
        cut corners in between.
        """
        padded = np.concatenate([position, *[position[..., -1:, :]] * (SPARE - 1)], axis=-2)
        halves = (position[..., 1:, :] + position[..., :-1, :]) / 2
        ends = [position[..., :1, :], halves, *[position[..., -1:, :]] * (SPARE - 1)]
        spline = np.concatenate(ends, axis=-2)
        if self.steps:
            spline[..., 1, :] = position[..., 0, :]
            spline[..., self.steps, :] = position[..., -1, :]
        result: Array = np.where(self.smooth[:, None, None], spline, padded)
        return result


def splines(mission: Mission) -> Splines:
    """Spline representation of the trajectories of a mission's agents."""
    count = mission.steps
    smooth = np.array([agent.dynamics.has_momentum for agent in mission.agents]) & (count > 0)
    points = np.arange(count + SPARE)
    fixed = np.zeros((len(mission.agents), count + SPARE), dtype=np.bool_)
    for agent in mission.agents:
        second = bool(smooth[agent.index])
        fixed[agent.index] = points > count + second
        if count and agent.start.point is not None:
            fixed[agent.index, : 1 + second] = True
        if count and agent.finish is not None and agent.finish.point is not None:
            fixed[agent.index, count : count + 1 + second] = True
        if count and agent.course:
            fixed[agent.index] = True
    return Splines(count, float(mission.step), smooth, fixed)


def pinned(mission: Mission, made: Splines, control: Array) -> Array:
    """Control points, (agents, points, dim), metres, moved so that agents are at rest at prescribed starts and
    finishes."""
    result = control.copy()
    for agent in mission.agents:
        ends = 1 + int(made.smooth[agent.index])
        if agent.start.point is not None:
            result[agent.index, :ends] = agent.start.point
        if agent.finish is not None and agent.finish.point is not None:
            result[agent.index, made.steps :] = agent.finish.point
    return result


def control_after(mission: Mission, made: Splines, position: Array) -> Array:
    """Control points, (agents, points, dim), metres, that follow positions, (agents, steps + 1, dim), as closely as
    possible."""
    return pinned(mission, made, made.through(followed(mission, position)))


def trace(mission: Mission, made: Splines, control: Array) -> Trace:
    """Trace of control points, (agents, points, dim), metres; headings follow the velocity.

    An agent with bounded turning follows its control points within its limits, and turns at rest.
    """
    position, velocity = made.states(control)
    position, velocity = position.copy(), velocity.copy()
    for agent in mission.agents:
        for place, step in ((agent.start, 0), (agent.finish, -1)):
            if place is not None and place.point is not None:
                position[agent.index, step] = place.point
        if made.steps and not agent.dynamics.has_momentum:
            velocity[agent.index] = _velocity(position[agent.index], made.step)
    turning = [
        agent for agent in mission.agents if made.steps and math.isfinite(turn_in_step(agent.dynamics, made.step))
    ]
    for agent in turning:
        position[agent.index] = pursued(agent.dynamics, position[agent.index], made.step)
        velocity[agent.index] = _velocity(position[agent.index], made.step)
    moving = np.linalg.norm(velocity[..., :2], axis=-1) > 0
    facing = np.arctan2(velocity[..., 1], velocity[..., 0])
    number = np.where(moving, np.arange(facing.shape[1]), -1)
    latest = np.maximum.accumulate(number, axis=1)
    first = np.where(moving.any(axis=1), moving.argmax(axis=1), 0)[:, None]
    heading = np.take_along_axis(facing, np.where(latest < 0, first, latest), axis=1)
    for agent in turning:
        given = np.flatnonzero(moving[agent.index])
        if given.size:
            steadily = np.unwrap(facing[agent.index, given])
            heading[agent.index] = np.interp(np.arange(heading.shape[1]), given, steadily)
    return Trace(mission.step, position, velocity, heading)


def _velocity(position: Array, step: float) -> Array:
    """Velocities between consecutive positions, (steps + 1, dim), m/s; the last velocity is repeated."""
    moved = np.diff(position, axis=0) / step
    return np.concatenate([moved, moved[-1:]])
