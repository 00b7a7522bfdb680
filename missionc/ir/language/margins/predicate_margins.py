"""Margins of predicates along a trace, and at states of one agent or two.

Margins are in metres, except for comparisons of speed only (m/s). At margin 0, ``holds`` decides whether the predicate
is true.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from missionc.base.trace import Trace
from missionc.ir import Flag, Formation, FormationEdge, Graph, Mission, Predicate, Resource
from missionc.ir.distances.signed_distance import Array, Namespace
from missionc.ir.language.margins import connected, formation, resources
from missionc.ir.language.margins.connected import algebraic_connectivity
from missionc.ir.language.margins.links import all_links, link_margin
from missionc.ir.language.margins.view import View

__all__ = [
    "AlongTrace",
    "algebraic_connectivity",
    "all_links",
    "formation_margin",
    "holds",
    "least_in_motion",
    "link_margin",
    "margin",
    "of_pair",
    "of_states",
]


def margin(predicate: Predicate, mission: Mission, trace: Trace) -> Array:
    """Margin of a predicate along a trace.

    Returns:
        (agents, steps + 1) for predicates about one agent, (steps + 1,) for predicates about the team; metres, or m/s
        for comparisons of speed only.
    """
    return predicate.margin(AlongTrace(mission, trace))


def holds(predicate: Predicate, margins: Array) -> Array:
    """Truth of a predicate from its margins, metres or m/s: (...) -> (...), boolean.

    Regions, tolerances and ``>=`` are true at margin 0; links and ``>`` are not.
    """
    return margins > 0 if predicate.open_border else margins >= 0


def of_states(
    predicate: Predicate,
    mission: Mission,
    agent: int,
    position: Array,
    velocity: Array,
    heading: Array | None = None,
    *,
    xp: Namespace = np,
) -> Array:
    """Margin of a predicate at states of one agent: (..., dim) twice, metres and m/s -> (...), metres.

    Args:
        heading: (...), rad; NaN if unknown, which makes the margin NaN. Only predicates of headings need it.

    Raises:
        ValueError: the predicate depends on another agent.
    """
    return predicate.margin(_OfSome(xp, mission, {agent: position}, velocity, heading))


def of_pair(
    predicate: Predicate,
    mission: Mission,
    first: int,
    second: int,
    first_position: Array,
    second_position: Array,
    *,
    xp: Namespace = np,
) -> Array:
    """Margin, for agent ``first``, of a predicate that depends on no agent other than ``first`` and ``second``.

    Args:
        first_position: (..., dim), metres; broadcasts with ``second_position``.

    Returns:
        (...), metres.

    Raises:
        ValueError: the predicate names no agent, or it depends on a speed or a third agent.
    """
    if not predicate.others:
        raise ValueError("only comparisons and edges of formations are about a pair of agents")
    return predicate.margin(_OfSome(xp, mission, {first: first_position, second: second_position}, None))


def formation_margin(
    shape: Formation, edge: FormationEdge, first_position: Array, second_position: Array, *, xp: Namespace = np
) -> Array:
    """Margin of one formation edge: tolerance minus the edge's error; (..., dim) twice, metres -> (...), metres."""
    return shape.tolerance - formation.edge_error(xp, edge, first_position, second_position)


class AlongTrace(View):
    """View of all agents: (agents, steps + 1, dim); one agent has (steps + 1, dim)."""

    def __init__(self, mission: Mission, trace: Trace) -> None:
        super().__init__(np, mission.dimension)
        self.mission, self.trace = mission, trace

    def own(self) -> Array:
        return self.trace.position

    def place(self, agent: int) -> Array:
        return self.trace.position[agent]

    def velocity(self) -> Array:
        return self.trace.velocity

    def heading(self) -> Array:
        return self.trace.heading

    def radius(self) -> Array:
        return np.array([agent.radius for agent in self.mission.agents])[:, None]

    def plane(self) -> Array:
        return np.array([agent.altitude for agent in self.mission.agents])[:, None]

    def least_in_motion(self, margin: Callable[[View], Array]) -> Array:
        position, velocity, step = self.trace.position, self.trace.velocity, self.mission.step
        speed, bend = velocity.copy(), np.zeros_like(velocity)
        speed[:, -1] = 0.0  # there is no motion from the last step
        for agent in self.mission.agents:
            if agent.dynamics.has_momentum:
                bend[agent.index, :-1] = np.diff(velocity[agent.index], axis=0) / (2 * step)

        def places(shares: Array) -> Array:
            time = (shares * step)[..., None]
            return position[:, :, None] + speed[:, :, None] * time + bend[:, :, None] * time**2

        return least_in_motion(self.mission, margin, places, position.shape[:2], self.radius(), self.plane())

    def weakest_link(self, graph: Graph) -> Array:
        return connected.connected_margin(graph, self.trace)

    def level(self, resource: Resource) -> Array:
        return resources.levels(resource, self.trace)

    def flagged(self, flag: Flag) -> Array:
        return resources.flag_margins(flag, self.trace)


class _Moving(View):
    """View of agents at several places of their motions, (..., samples, dim); radii and altitudes are (..., 1)."""

    def __init__(self, mission: Mission, position: Array, radius: Array, plane: Array) -> None:
        super().__init__(np, mission.dimension)
        self.position, self.radii, self.planes = position, radius, plane

    def own(self) -> Array:
        return self.position

    def place(self, agent: int) -> Array:
        raise ValueError("it depends on more than the place of one agent")

    def radius(self) -> Array:
        return self.radii[..., None]

    def plane(self) -> Array:
        return self.planes[..., None]


def least_in_motion(
    mission: Mission,
    margin: Callable[[View], Array],
    places: Callable[[Array], Array],
    shape: tuple[int, ...],
    radius: Array,
    plane: Array,
) -> Array:
    """Least value of a margin over motions, (...), metres: the least of samples, refined around it.

    Args:
        places: function from shares of the step, (..., samples), to positions, (..., samples, dim), metres.
        shape: shape (...) of the motions.
        radius: radii of the agents' bodies, broadcast to the motions, metres; ``plane`` likewise their altitudes.
    """
    samples, rounds = 17, 4  # the last samples are 1e-4 of a step apart
    low, width = np.zeros(shape), 1.0
    least = np.full(shape, np.inf)
    for _ in range(rounds):
        shares = low[..., None] + width * np.linspace(0.0, 1.0, samples)
        values = margin(_Moving(mission, places(shares), radius, plane))
        least = np.minimum(least, values.min(axis=-1))
        middle = low + width * values.argmin(axis=-1) / (samples - 1)
        width *= 2 / (samples - 1)
        low = np.clip(middle - width / 2, 0.0, 1.0 - width)
    return least


class _OfSome(View):
    """View of the positions of a few agents, evaluated for the first of them; other agents are unknown."""

    def __init__(
        self,
        xp: Namespace,
        mission: Mission,
        places: dict[int, Array],
        velocity: Array | None,
        heading: Array | None = None,
    ) -> None:
        super().__init__(xp, mission.dimension)
        self.places, self.moving, self.faced = places, velocity, heading
        self.agent = mission.agents[next(iter(places))]

    def own(self) -> Array:
        return self.places[self.agent.index]

    def place(self, agent: int) -> Array:
        if agent not in self.places:
            alone = len(self.places) == 1
            raise ValueError("it depends on more than the state of one agent" if alone else "it reads a third agent")
        return self.places[agent]

    def velocity(self) -> Array:
        return super().velocity() if self.moving is None else self.moving

    def heading(self) -> Array:
        return super().heading() if self.faced is None else self.faced

    def nothing(self, *, of_team: bool = False) -> Array:
        return 0.0 * self.own()[..., 0]

    def radius(self) -> float:
        return self.agent.radius

    def plane(self) -> float:
        return self.agent.altitude
