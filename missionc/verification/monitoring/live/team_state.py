"""State of the team at the present step and after coasting for one step, with resources and flags.

If a state is unknown, the agent is within a known distance of the stated position, and derived values are bounded
likewise.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.geometry.vectors import norm
from missionc.ir import Compare, Flag, Flagged, Mission, Predicate, Resource
from missionc.ir.distances.signed_distance import signed_distance
from missionc.ir.language.margins.resources import BORDER, changes
from missionc.ir.language.margins.view import View
from missionc.ir.predicates.features import Level

NOW, COASTED = 0, 1
"""Column indices of the present state and of the state after coasting for one step."""


class TeamState:
    """Positions, velocities, headings, resource levels and flags of all agents, now and after coasting for one step.

    Attributes:
        position, velocity: (agents, 2, dim), metres and m/s.
        heading: (agents, 2), rad.
        doubt: (agents,), metres: maximum distance of an agent from there; 0 if it is known.
        levels: minimum and maximum level of each resource: (2, agents, 2).
        flags: minimum and maximum margin of each flag: (2, agents, 2), metres.
    """

    def __init__(self, mission: Mission, predicates: Iterable[Predicate]) -> None:
        self.mission = mission
        agents, dim = len(mission.agents), mission.dimension
        self.position = np.zeros((agents, 2, dim))
        self.velocity = np.zeros((agents, 2, dim))
        self.heading = np.zeros((agents, 2))
        self.doubt = np.zeros(agents)
        predicates = tuple(predicates)
        resources = dict.fromkeys(
            feature.resource
            for predicate in predicates
            if isinstance(predicate, Compare)
            for _, feature in predicate.terms
            if isinstance(feature, Level)
        )
        flags = dict.fromkeys(each.flag for each in predicates if isinstance(each, Flagged))
        self.levels = {each: np.full((2, agents, 2), each.start) for each in resources}
        self.flags = {each: np.full((2, agents, 2), -np.inf) for each in flags}
        self.begun = False

    def move(self, position: Array, velocity: Array, heading: Array, doubt: Array) -> None:
        """Advance to the next step, with the measured states of all agents.

        Args:
            position, velocity: (agents, dim), metres and m/s.
            heading: (agents,), rad.
            doubt: (agents,), metres: maximum distance from the stated position; 0 if the state is known.
        """
        before, doubt_before = self.position[:, NOW].copy(), self.doubt
        self.doubt = doubt
        coasted = position + velocity * self.mission.step
        self.position = np.stack([position, coasted], axis=1)
        self.velocity = np.stack([velocity, velocity], axis=1)
        self.heading = np.stack([heading, heading], axis=1)
        for resource, level in self.levels.items():
            now = level[:, :, NOW]
            if self.begun:
                now = self._used(resource, now, before, position, doubt_before + doubt)
            later = self._used(resource, now, position, coasted, 2 * doubt)
            self.levels[resource] = np.stack([now, later], axis=-1)
        for flag, margin in self.flags.items():
            last = margin[:, :, NOW]
            now = self._flagged(flag, last if self.begun else np.full_like(last, -np.inf), position)
            self.flags[flag] = np.stack([now, self._flagged(flag, now, coasted)], axis=-1)
        self.begun = True

    def _used(self, resource: Resource, left: Array, here: Array, there: Array, doubt: Array) -> Array:
        """Minimum and maximum level of a resource one step later: (2, agents), dimensionless.

        Args:
            left: minimum and maximum level before, (2, agents).
            here, there: positions before and after the step, metres.
            doubt: uncertainty of the positions, (agents,), metres.
        """
        step = self.mission.step
        change = changes(resource, step, here, there)
        least = most = change
        if np.any(doubt):
            way, refill = norm(there - here), sum(each.per_second for each in resource.refills)
            lost = change * 0 - resource.per_second * step
            least = np.where(doubt > 0, lost - resource.per_metre * (way + doubt), change)
            most = np.where(doubt > 0, lost + refill * step - resource.per_metre * np.maximum(way - doubt, 0.0), change)
        found = np.minimum(left + np.stack([least, most]), resource.capacity)
        return np.asarray(np.where(self._has(resource.agents), found, resource.start))

    def _flagged(self, flag: Flag, margin: Array, position: Array) -> Array:
        """Minimum and maximum margin of a flag one step later: (2, agents), metres.

        Args:
            margin: margins before the step, (2, agents), metres.
            position: positions after the step, (agents, dim), metres.
        """
        spread = np.stack([-self.doubt, self.doubt])
        sets = -signed_distance(np, flag.set_in.shape, position) + spread
        stays = margin
        if flag.cleared_in is not None:
            away = signed_distance(np, flag.cleared_in.shape, position)
            stays = np.minimum(margin, np.where(away == 0, -BORDER, away) + spread)
        return np.asarray(np.where(self._has(flag.agents), np.maximum(sets, stays), -np.inf))

    def _has(self, agents: tuple[int, ...]) -> Flags:
        mine = np.zeros(len(self.mission.agents), dtype=np.bool_)
        mine[list(agents)] = True
        return mine


class TeamView(View):
    """View of the team's state for predicates, now and after coasting: (agents, 2), for one agent (2,)."""

    def __init__(self, state: TeamState) -> None:
        super().__init__(np, state.mission.dimension)
        self.state = state

    def own(self) -> Array:
        """Positions of all agents: (agents, 2, dim), metres."""
        return self.state.position

    def place(self, agent: int) -> Array:
        """Position of one agent: (2, dim), metres."""
        place: Array = self.state.position[agent]
        return place

    def velocity(self) -> Array:
        """Velocities of all agents: (agents, 2, dim), m/s."""
        return self.state.velocity

    def heading(self) -> Array:
        """Headings of all agents: (agents, 2), rad."""
        return self.state.heading

    def radius(self) -> Array:
        """Body radii of all agents: (agents, 1), metres."""
        return np.array([agent.radius for agent in self.state.mission.agents])[:, None]

    def plane(self) -> Array:
        """Altitudes of all agents: (agents, 1), metres."""
        return np.array([agent.altitude for agent in self.state.mission.agents])[:, None]

    def level(self, resource: Resource) -> Array:
        """Middle of the bounds on each agent's resource level: (agents, 2), dimensionless."""
        return np.asarray(self.state.levels[resource].mean(axis=0))


class Reach:
    """Bounds on the change of measured quantities from a state until later times, from the agents' top speeds.

    Shape: (agents, columns), in the unit of each quantity.
    """

    larger = staticmethod(np.maximum)

    def __init__(self, state: TeamState, seconds: Array, column: int) -> None:
        """Compute the distance that every agent can move until each column.

        Args:
            seconds: time from the state to each column, (columns,).
            column: column of the state, now or coasted.
        """
        mission = state.mission
        self.state, self.seconds, self.column = state, seconds, column
        self.dimension = mission.dimension
        speed = np.array([agent.dynamics.top_speed for agent in mission.agents])
        self.top_speed = speed
        way = speed[:, None] * seconds * (1 + SLACK) + np.where(seconds > 0, ROUNDING, 0.0)
        self.radius = state.doubt[:, None] + way

    def motion(self) -> Array:
        """Upper bound on the distance of each agent from its stated position: (agents, columns), metres."""
        return self.radius

    def relative(self, first: int | None, second: int) -> Array:
        """Upper bound on the change of two agents' relative position: (agents, columns), metres.

        Args:
            first: one agent, or None for every agent.
        """
        radius: Array = self.radius[slice(None) if first is None else slice(first, first + 1)] + self.radius[second]
        return radius

    def acceleration(self) -> Array:
        """Upper bound on the change of each agent's speed: (agents, columns), m/s."""
        agents = self.state.mission.agents
        top = np.array([each.dynamics.top_acceleration if each.dynamics.has_momentum else np.inf for each in agents])
        later = self.seconds > 0
        change = np.where(later, top[:, None] * np.where(later, self.seconds, 1.0) * (1 + SLACK) + ROUNDING, 0.0)
        return np.asarray(np.where(self.state.doubt[:, None] > 0, np.inf, change))

    def use(self, resource: Resource) -> Array:
        """Upper bound on the change of each agent's resource level: (agents, columns), dimensionless."""
        least, most = self.state.levels[resource][:, :, self.column]
        refill = sum(each.per_second for each in resource.refills)
        rate = np.maximum(resource.per_second + resource.per_metre * self.top_speed, refill)
        change = rate[:, None] * self.seconds * (1 + SLACK) + np.where(self.seconds > 0, ROUNDING, 0.0)
        return np.asarray((most - least)[:, None] / 2 + change)

    def along(self, direction: tuple[float, ...]) -> Array:
        """Upper bound on the change of a weighted sum of coordinates: (agents, columns), metres.

        Args:
            direction: weight of each coordinate.
        """
        return float(np.hypot.reduce(direction)) * self.radius


SLACK, ROUNDING = 1e-9, 1e-9
"""Relative and absolute (metres) allowance for the rounding of a motion at top speed."""
