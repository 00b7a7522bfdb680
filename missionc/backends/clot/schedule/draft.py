"""Warm start of an attempt: a schedule, its joint waypoints, and an initial joint trajectory through them.

Initial joint trajectory through joint waypoints: teams move together, along geodesics around static obstacles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from missionc.backends.clot.optimise.obstacle_index import Obstacles
from missionc.backends.clot.schedule.deconflict_space_time import avoid_moving_obstacles, deconflict_space_time
from missionc.backends.clot.schedule.gather_team import teams_of
from missionc.backends.clot.schedule.geodesics import Geodesics
from missionc.backends.clot.schedule.joint_waypoints import joint_waypoints
from missionc.backends.clot.schedule.schedule import Scheduler
from missionc.backends.clot.schedule.tours import tours
from missionc.backends.clot.schedule.visits import NO_TOURS, KeyFrame, Schedule
from missionc.backends.clot.settings import clot_settings
from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.geometry.polylines import at_shares
from missionc.ir import Box, Mission
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.kernel.nodes import Atom


def sketch(
    mission: Mission,
    schedule: Schedule,
    frames: Sequence[KeyFrame],
    geodesics: Geodesics,
    generator: np.random.Generator,
    detour: float,
    toured: Mapping[int, Array] = NO_TOURS,
) -> Array:
    """Initial joint trajectory: positions at the steps, (agents, steps + 1, dim), metres.

    Args:
        detour: probability of a path other than the shortest for a team.
        toured: positions, (steps + 1, dim), metres, of agents on separate tours.
    """
    position = np.zeros((len(mission.agents), mission.steps + 1, mission.dimension))
    position[:, 0] = frames[0].position
    for agent, tour in toured.items():
        position[agent] = tour
    between = _Teams(mission, geodesics, generator)
    for earlier, later in pairwise(frames):
        teams = [team for team in _teams(mission, schedule, earlier.step, later.step) if toured.keys().isdisjoint(team)]
        ahead = slice(earlier.step + 1, later.step + 1)
        for team in teams:
            position[team, ahead] = between.by_routes(team, earlier, later, generator.random() < detour)
        if detour:
            alone = [team[0] for team in teams if len(team) == 1 and team[0] not in later.routes]
            both = slice(earlier.step, later.step + 1)
            position[:, both] = deconflict_space_time(mission, position[:, both], earlier.step, alone, geodesics)
    return position


class _Teams:
    """Initial trajectories of teams between two joint waypoints; ``figures``: geodesics of earlier teams."""

    def __init__(self, mission: Mission, geodesics: Geodesics, generator: np.random.Generator) -> None:
        self.mission, self.geodesics, self.generator = mission, geodesics, generator
        self.movers = [obstacle for obstacle in mission.obstacles if not obstacle.constant]
        self.figures: list[Geodesics] = []

    def by_routes(self, team: list[int], earlier: KeyFrame, later: KeyFrame, other_way: bool) -> Array:
        """Trajectory of a team along given routes, unless it collides with moving obstacles: (agents, steps, dim),
        metres."""
        share = _share(earlier, later)
        routed = {
            number: at_shares(
                np.concatenate([earlier.position[agent][None], later.routes[agent][1:-1], later.position[agent][None]]),
                share,
            )
            for number, agent in enumerate(team)
            if agent in later.routes
        }
        if len(routed) == len(team):
            moved: Array = np.stack(list(routed.values()))
            if not self.movers or self.meeting(team, earlier, later, moved) == 0.0:
                return moved
        made = self.together(team, earlier, later, other_way)
        beside = made.copy()
        for number, way in routed.items():
            beside[number] = way
        if not routed or not self.movers:
            return beside
        met, met_beside = (self.meeting(team, earlier, later, each) for each in (made, beside))
        return beside if met_beside <= met else made

    def together(self, team: list[int], earlier: KeyFrame, later: KeyFrame, other_way: bool) -> Array:
        """Trajectory of a team whose centre avoids obstacles while its members keep their offsets: (agents, steps,
        dim), metres."""
        bend_cost = 0.02  # cost of a metre of detour, in metres within an obstacle
        settings = clot_settings(self.mission).guess
        mission, geodesics, share = self.mission, self.geodesics, _share(earlier, later)
        start, end = earlier.position[team], later.position[team]
        middle, goal = start.mean(axis=0), end.mean(axis=0)
        radius = self.radius(team)
        extent = max(float(np.linalg.norm(each - each.mean(axis=0), axis=1).max()) for each in (start, end))
        way = None
        if len(team) > 1 and float(np.linalg.norm((end - goal) - (start - middle), axis=1).max()) <= settings.team:
            figure = self.of_figure(((start - middle) + (end - goal)) / 2)
            way = figure.way(middle, goal, radius + settings.team_clearance, radius)
        if way is None:
            way = geodesics.way(middle, goal, radius + 0.1 + extent, radius)
        if way is not None and other_way:
            avoided = at_shares(way, np.linspace(0.1, 0.9, 60))
            second = geodesics.way(middle, goal, radius + 0.1 + extent / 2, radius, avoided)
            way = way if second is None else second
        if way is None:
            way = np.stack([middle, goal])
        around = (start - middle)[:, None] * (1 - share)[None, :, None] + (end - goal)[:, None] * share[None, :, None]
        moved: Array = at_shares(way, share)[None] + around
        if self.meeting(team, earlier, later, moved) == 0.0:
            return moved
        # A map of static obstacles cannot show a path around moving or growing ones.
        time = _times(mission, earlier, later)
        if self.movers and not other_way:
            past = avoid_moving_obstacles(mission, team, around, time, middle, goal, geodesics)
            if past is not None:
                by: Array = past + around
                return by
        length = float(np.linalg.norm(goal - middle))
        bends = np.stack(_bends(share, length, mission.dimension, self.generator))
        blocked = _blocked(Obstacles(mission, mission.obstacles, time), moved + bends[:, None], radius)
        extra = np.linalg.norm(np.diff(bends, axis=1), axis=2).sum(axis=1)
        bent: Array = moved + bends[int(np.argmin(blocked + bend_cost * extra))]
        return bent

    def of_figure(self, figure: Array) -> Geodesics:
        """Geodesics on which no member touches a static obstacle if all keep their offsets.

        Geodesics of an earlier formation are reused if the grid does not resolve the difference.

        Args:
            figure: offsets of the members from the team's centre, (members, dim), metres.
        """
        for each in self.figures:
            near = each.figure.shape == figure.shape
            if near and np.linalg.norm(each.figure - figure, axis=1).max() <= each.cell / 2:
                return each
        self.figures.append(Geodesics(self.mission, figure))
        return self.figures[-1]

    def meeting(self, team: list[int], earlier: KeyFrame, later: KeyFrame, moved: Array) -> float:
        """Total penetration of a team's trajectory, (agents, steps, dim), into moving obstacles and out of the world,
        metres."""
        movers = Obstacles(self.mission, self.movers, _times(self.mission, earlier, later))
        return float(_blocked(movers, moved[None], self.radius(team))[0])

    def radius(self, team: list[int]) -> float:
        """Required clearance of the largest member of a team, metres."""
        return max(self.mission.agents[agent].radius for agent in team) + self.mission.clearance


def _share(earlier: KeyFrame, later: KeyFrame) -> Array:
    """Fraction of the time between two joint waypoints at each step after the first, (steps,), dimensionless."""
    span = later.step - earlier.step
    return np.arange(1, span + 1, dtype=np.float64) / span


def _times(mission: Mission, earlier: KeyFrame, later: KeyFrame) -> Array:
    """Times of the steps after one joint waypoint up to the next, (steps,), seconds."""
    return np.arange(earlier.step + 1, later.step + 1, dtype=np.float64) * mission.step


def _bends(share: Array, length: float, dimension: int, generator: np.random.Generator) -> list[Array]:
    """Detours from a path and back, the first of them zero: (steps, dim), metres, each.

    Args:
        share: (steps,), dimensionless.
        length: path length, metres.
    """
    bends, least_bend = 24, 0.5  # detours tried, and their least size in metres
    shape = np.sin(np.pi * share)[:, None]
    offsets = generator.standard_normal((bends, dimension)) * max(length / 3, least_bend)
    skewed = [np.sin(np.pi * share ** float(np.exp(0.5 * generator.standard_normal())))[:, None] for _ in offsets]
    return [0.0 * shape * offsets[0], *(skew * offset for skew, offset in zip(skewed, offsets, strict=True))]


def _blocked(obstacles: Obstacles, position: Array, radius: float) -> Array:
    """Total penetration of trajectories into obstacles or out of the world: (motions, agents, steps, dim), metres ->
    (motions,), metres."""
    room = 0.05  # metres beyond a body's need
    world = Box(obstacles.mission.world.low, obstacles.mission.world.high)
    total: Array = np.maximum(signed_distance(np, world, position), 0.0).sum(axis=(1, 2))
    points = position.reshape(-1, position.shape[-1])
    instant = np.tile(np.arange(position.shape[2]), position.shape[0] * position.shape[1])
    pairs = obstacles.near(points, instant, radius + room)
    lacking = np.maximum(radius + room - obstacles.distance(points[pairs.row], pairs), 0.0)
    motion = pairs.row // (position.shape[1] * position.shape[2])
    return total + np.bincount(motion, lacking, len(position))


def _teams(mission: Mission, schedule: Schedule, begin: int, end: int) -> list[list[int]]:
    """Groups of agents coupled by a formation or a connected graph between two steps."""
    pairs: list[tuple[int, int]] = []
    for hold in schedule.holds:
        node = hold.node
        if not (isinstance(node, Atom) and hold.low < end and hold.high > begin):
            continue
        graph = node.predicate.restricted
        if node.predicate.formation:
            pairs.extend(node.predicate.pairs)
        elif graph:
            pairs.extend((graph.agents[0], other) for other in graph.agents[1:])
    count = len(mission.agents)
    ties = np.zeros((count, count), dtype=np.bool_)
    for one, other in pairs:
        ties[one, other] = True
    return teams_of(ties)


class WarmStart(Record, eq=False):
    """Starting point of an attempt: a schedule, its joint waypoints, and a joint trajectory, (agents, steps + 1, dim),
    metres.

    ``number`` is the index of the attempt that made the schedule.
    """

    number: int
    schedule: Schedule
    key: tuple[KeyFrame, ...]
    motion: Array


def draft(
    number: int,
    mission: Mission,
    scheduler: Scheduler,
    geodesics: Geodesics,
    generator: np.random.Generator,
    noise: float,
    go_on: Callable[[], bool],
) -> WarmStart:
    """Warm start from the schedule that a scheduler computes.

    Args:
        number: index of the attempt.
        noise: relative random perturbation of distances.
        go_on: function that returns true while time is left; without time, first guesses are not corrected.
    """
    schedule = scheduler.schedule(noise)
    loose = {agent.index for agent in mission.agents} - scheduler.tied
    toured: dict[int, Array] = {}
    if loose:
        frames, motion = tours(mission, schedule, scheduler.timed, geodesics, generator)
        if not scheduler.tied:
            return WarmStart(number, schedule, frames, motion)
        toured = {agent: motion[agent] for agent in sorted(loose)}
    key = joint_waypoints(mission, schedule, scheduler, geodesics, generator, go_on, toured)
    detours = clot_settings(mission).attempts.detours if noise else 0.0
    first = sketch(mission, schedule, key, geodesics, generator, detours, toured)
    return WarmStart(number, schedule, key, first)
