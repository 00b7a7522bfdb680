"""Residual groups of a candidate: bodies, limits, and the active margins of its goals.

Source:
    [clot] III-B, g_obs and g_int; III-C, the predicates; (3).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import field

import numpy as np

from missionc.backends.clot.optimise.active_set import Active
from missionc.backends.clot.optimise.control_points import Arguments, Splines
from missionc.backends.clot.optimise.dual_numbers import Values, plain
from missionc.backends.clot.optimise.flown_limits import flown_limits
from missionc.backends.clot.optimise.obstacle_index import Obstacles
from missionc.backends.clot.optimise.residuals import Group
from missionc.backends.clot.optimise.task_residuals import TaskCosts, norm
from missionc.backends.clot.optimise.turning import TURN, Turns, turns
from missionc.backends.clot.settings import Spare, Weights, clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array, Indices
from missionc.geometry.dynamics import speeds
from missionc.geometry.natural_scale import body
from missionc.geometry.required_separation import SpacingTable
from missionc.ir import Box as BoxShape
from missionc.ir import Mission
from missionc.ir.agents import ends_by_region
from missionc.ir.distances.signed_distance import signed_distance

OBSTACLES, SEPARATION = "obstacles", "separation"
"""Names of the residual groups of obstacles and of separation."""


class Samples(Record, eq=False):
    """Points of a trajectory that are tested against obstacles.

    Args:
        where: the points as functions of the control points, (samples,).
        radius: body radius of the agent, (samples,), metres.
        instant: time of each point, (samples,), as an index into the times of ``obstacles``.
    """

    where: Arguments
    radius: Array
    instant: Indices
    obstacles: Obstacles


class Costs(Record, eq=False):
    """Residual groups of a mission's trajectories, from control points (agents, points, dim), metres.

    ``start`` is the trajectory's first step in the mission: 0, or the step of a single configuration.
    """

    mission: Mission
    splines: Splines
    weights: Weights
    spare: Spare
    start: int = 0
    samples: Samples = field(init=False)
    turns: Turns = field(init=False)
    always: tuple[Group, ...] = field(init=False)
    """Residual groups common to all candidates: starts, finishes and limits."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "samples", _samples(self.mission, self.splines, self.start))
        object.__setattr__(self, "turns", turns(self.mission, self.splines))
        object.__setattr__(self, "always", (*self.ends(), *self.limits()))

    def groups(self, control: Array, active: Active) -> Iterator[Group]:
        """Yield all residual groups of a candidate, (agents, points, dim), metres."""
        yield from self.motion(control)
        yield from self.tasks(control, active)

    def motion(self, control: Array) -> Iterator[Group]:
        """Yield the residual groups that apply to any trajectory: starts, finishes, limits and bodies."""
        yield from self.always
        yield from self.obstacles(control)
        yield from self.separation(control)

    def tasks(self, control: Array, active: Active) -> Iterator[Group]:
        """Yield the residual groups of the active conditions of the mission's formulas."""
        yield from TaskCosts(self.mission, self.splines, self.weights, self.spare).groups(control, active)

    # ---------------------------------------------------------------- motion

    def ends(self) -> Iterator[Group]:
        """Yield the residual groups of start and finish regions, which must contain the agents' centres."""
        if self.splines.steps == 0:
            return
        for name, step, ends in (
            ("start", 0, self.mission.starts),
            ("finish", self.splines.steps, self.mission.finishes),
        ):
            for region, there in ends_by_region(ends).items():
                index = np.array([agent.index for agent, _ in there])
                where = self.splines.position(index, np.full(len(index), step), np.zeros(len(index)))
                yield Group(
                    name,
                    (where,),
                    lambda point, shape=region.shape: signed_distance(np, shape, point) + self.spare.task,
                    self.weights.task,
                    self.spare.task,
                )

    def limits(self) -> Iterator[Group]:
        """Yield the residual groups of minimum and maximum speed, turning, and acceleration."""
        made, step = self.splines, self.splines.step
        if made.steps == 0:
            return
        agent, moment = self._grid(made.steps)
        slowest, fastest = np.array([speeds(one.dynamics) for one in self.mission.agents])[agent].T
        unused = self.spare.limits * (fastest - slowest)
        most = (fastest - unused) * step
        yield Group(
            "speed",
            (made.velocity(agent, moment),),
            lambda velocity: norm(velocity) * step - most,
            self.weights.limits,
            step * float(unused.min()),
        )
        restless = np.flatnonzero((slowest > 0) & (moment < made.steps))
        if restless.size:
            least = (slowest + unused)[restless] * step
            yield Group(
                "least speed",
                (made.velocity(agent[restless], moment[restless]),),
                lambda velocity: least - norm(velocity) * step,
                self.weights.limits,
                step * float(unused[restless].min()),
            )
        bounded, unused_turn = self.turns, self.spare.limits
        if len(bounded.most):
            yield Group(
                TURN,
                bounded.pair,
                lambda one, other: bounded.excess(one * step, other * step, unused_turn),
                self.weights.limits,
                unused_turn * float(bounded.most.min()) * step * float(fastest.min()),
            )
        yield from flown_limits(self.mission, made, self.weights, self.spare)
        second = made.smooth[agent]
        if second.any():
            agent, moment = agent[second], moment[second]
            strongest = np.array([one.dynamics.top_acceleration for one in self.mission.agents])[agent]
            limit = strongest * (1 - self.spare.limits) * step**2
            yield Group(
                "acceleration",
                (made.acceleration(agent, moment),),
                lambda acceleration: norm(acceleration) * step**2 - limit,
                self.weights.limits,
                self.spare.limits * step**2 * float(strongest.min()),
            )

    def obstacles(self, control: Array) -> Iterator[Group]:
        """Yield the residual groups of obstacles and the world's bounds, at and between steps.

        Control points are (agents, points, dim), metres.
        """
        settings = clot_settings(self.mission).polish
        seen = self.samples
        radius, everywhere = seen.radius, seen.where
        point = everywhere.of(control)
        world = BoxShape(self.mission.world.low, self.mission.world.high)
        far = np.flatnonzero(signed_distance(np, world, point) > -settings.close)
        if far.size:
            yield Group(
                "world",
                (everywhere.take(far),),
                lambda inner: signed_distance(np, world, inner) + self.spare.bodies,
                self.weights.bodies,
                self.spare.bodies,
            )
        if not self.mission.obstacles:
            return
        spare, reach = self.spare.bodies, float(radius.max()) + self.mission.clearance + settings.close
        pairs = seen.obstacles.near(point, seen.instant, reach)
        if len(pairs.row):
            row = pairs.row
            need = radius[row] + self.mission.clearance + spare
            yield Group(
                OBSTACLES,
                (everywhere.take(row),),
                lambda inner: need - seen.obstacles.distance(inner, pairs),
                self.weights.bodies,
                spare,
            )

    def separation(self, control: Array) -> Iterator[Group]:
        """Yield the residual groups of near pairs of bodies within each step; control points are (agents, points, dim),
        metres."""
        made, mission = self.splines, self.mission
        if len(mission.agents) < 2:
            return
        position, _ = made.states(control)
        here, there = (position[:, :-1], position[:, 1:]) if made.steps else (position, position)
        reach = np.linalg.norm(there - here, axis=-1)
        middle = (here + there) / 2
        first, second = np.triu_indices(len(mission.agents), 1)
        spacing = SpacingTable.of(mission)
        least, metric = spacing.between(first, second), spacing.metric(first, second)
        square = np.zeros((len(first), middle.shape[1]))
        for axis in range(mission.dimension):
            between = middle[first, :, axis] - middle[second, :, axis]
            square += (between if metric is None else between * metric[:, axis, None]) ** 2
        within = least[:, None] + clot_settings(self.mission).polish.close / 4
        within = within + max(1.0, float(spacing.flatness.max())) * (reach[first] + reach[second]) / 2
        pair, step_of = np.nonzero(square < within**2)
        one, other = first[pair], second[pair]
        if one.size == 0:
            return
        need = least[pair] + self.spare.bodies
        factors = None if metric is None else metric[pair]
        part = np.zeros(len(one))
        ends = [made.position(agent, step_of, part) for agent in (one, other)]
        if made.steps == 0:
            yield Group(
                SEPARATION,
                tuple(ends),
                lambda a, b: need - norm(_measured(a - b, factors)),
                self.weights.bodies,
                self.spare.bodies,
            )
            return
        ends += [made.position(agent, step_of, part + 1) for agent in (one, other)]
        yield Group(
            SEPARATION,
            tuple(ends),
            lambda a, b, c, d: need - _approach(a, b, c, d, factors),
            self.weights.bodies,
            self.spare.bodies,
        )

    def body_margin(self, control: Array) -> float:
        """Least margin of obstacle clearance and separation, divided by the bodies' natural scale; dimensionless.

        Bodies that are far from each other and from obstacles are ignored; ``inf`` if all bodies are.
        """
        least = math.inf
        for group in (*self.obstacles(control), *self.separation(control)):
            if group.name in (OBSTACLES, SEPARATION):
                points = [argument.of(control) for argument in group.arguments]
                least = min(least, group.spare - float(group.shortfall(*points).max()))
        return least / max(body(self.mission), 1e-9)

    def _grid(self, count: int) -> tuple[Indices, Indices]:
        agents = np.arange(len(self.mission.agents))
        return np.repeat(agents, count), np.tile(np.arange(count), len(agents))


def _samples(mission: Mission, made: Splines, start: int) -> Samples:
    fewest, most = 3, 12  # points within a step, for any speed
    agents = np.arange(len(mission.agents))
    fastest = max(agent.dynamics.top_speed for agent in mission.agents)
    count = int(np.clip(np.ceil(fastest * made.step / clot_settings(mission).polish.gap), fewest, most))
    parts = np.arange(made.steps * count + 1) if made.steps else np.zeros(1, dtype=np.int64)
    moment, part = parts // count, (parts % count) / count
    index = np.repeat(agents, len(parts))
    where = made.position(index, np.tile(moment, len(agents)), np.tile(part, len(agents)))
    radius = np.array([one.radius for one in mission.agents])[index]
    return Samples(
        where,
        radius,
        np.tile(parts, len(agents)),
        Obstacles(mission, mission.obstacles, (start + moment + part) * made.step),
    )


def _measured(between: Values, factors: Array | None) -> Values:
    """Differences scaled by a factor per axis: (rows, dim) twice, metres."""
    return between if factors is None else between * factors


def _approach(one: Values, other: Values, one_next: Values, other_next: Values, factors: Array | None = None) -> Values:
    """Least distance of two points that move straight during a step, metres.

    Shape: (rows, dim) four times, and factors -> (rows,).
    """
    apart, change = _measured(other - one, factors), _measured((other_next - other) - (one_next - one), factors)
    here, moved = plain(apart), plain(change)
    square = np.maximum((moved * moved).sum(axis=1), 1e-18)
    when = np.clip(-(here * moved).sum(axis=1) / square, 0.0, 1.0)
    return norm(apart + change * when[:, None])
