"""Mission as a value: world, agents, requirements, preferences, objective."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field
from enum import Enum

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres, Seconds, Steps
from missionc.ir.agents import Agent, AgentSet, InitialSet
from missionc.ir.couplings import Formation, Graph
from missionc.ir.formulas import Formula
from missionc.ir.lanes import Lanes
from missionc.ir.places import Beacon, Obstacle, PlacesFile, Region, Vector, World
from missionc.ir.resources import Flag, Resource


class Requirement(Record, eq=False):
    name: str
    formula: Formula
    span: Span


class Preference(Record, eq=False):
    name: str
    formula: Formula
    weight: float
    span: Span


class Tolerance(Record, eq=False):
    """Tolerated delay: each agent of ``agents`` (mission indices), one at a time, may be delayed by up to ``steps``
    steps."""

    agents: tuple[int, ...]
    steps: Steps
    span: Span


class Spacing(Record):
    """Required separation of two agents' centres: their difference is outside an upright ellipsoid with these half
    axes, metres."""

    sideways: Metres
    height: Metres

    @property
    def least(self) -> Metres:
        """Least required distance over all directions, metres."""
        return min(self.sideways, self.height)

    @property
    def most(self) -> Metres:
        """Distance that satisfies the separation in every direction, metres."""
        return max(self.sideways, self.height)

    @property
    def flatness(self) -> float:
        """Factor on height differences that makes them comparable to horizontal distances; 1 for a ball."""
        return self.sideways / self.height if self.height > 0 else 1.0

    def measured(self, offset: Sequence[float]) -> Metres:
        """Length of an offset between two centres, with heights scaled by ``flatness``; metres, at least ``sideways``
        if the separation is satisfied."""
        return Metres(math.hypot(*offset[:2], *(self.flatness * each for each in offset[2:])))


class Objective(Enum):
    NONE = "none"
    DISTANCE = "distance"
    DURATION = "duration"
    ENERGY = "energy"
    ROBUSTNESS = "robustness"

    @property
    def word(self) -> str:
        """Verb of the objective, ``maximize`` or ``minimize``; empty without an objective."""
        return "" if self is Objective.NONE else "maximize" if self is Objective.ROBUSTNESS else "minimize"

    def __str__(self) -> str:
        return f"{self.word} {self.value}".lstrip()


class Connectivity(Enum):
    """Measure of connectivity that the optimiser increases to connect a graph."""

    BOTTLENECK = "bottleneck"
    LAMBDA2 = "lambda2"


class SolveWith(Record):
    """Requested backend (``auto``, ``smt``, ``clot`` or ``hybrid``) and its options, mostly numbers."""

    backend: str = "auto"
    options: tuple[tuple[str, float], ...] = ()
    connectivity: Connectivity = Connectivity.BOTTLENECK
    span: Span | None = None
    roadmap: Lanes | None = None
    """Roadmap that the user supplies, used instead of generated roadmaps; None if the user supplies none."""
    settings: tuple[tuple[str, float], ...] = ()
    """Backend settings that the mission changes from their defaults: ``("smt.roadmap.nodes", 400)``."""


class Mission(Record, eq=False, weakref_slot=True):
    """Complete resolved mission. States are at the steps 0 … ``steps``, both included; ``step`` is the duration of a
    step."""

    name: str
    step: Seconds
    steps: Steps
    world: World
    regions: tuple[Region, ...]
    obstacles: tuple[Obstacle, ...]
    beacons: tuple[Beacon, ...]
    agents: tuple[Agent, ...]
    teams: tuple[AgentSet, ...]
    groups: tuple[AgentSet, ...]
    graphs: tuple[Graph, ...]
    formations: tuple[Formation, ...]
    separation: Metres
    clearance: Metres
    requirements: tuple[Requirement, ...]
    preferences: tuple[Preference, ...]
    objective: Objective
    solve: SolveWith
    span: Span
    objective_span: Span | None = None
    time_span: Span | None = None
    lets: tuple[tuple[str, Formula], ...] = field(default=())
    resources: tuple[Resource, ...] = ()
    flags: tuple[Flag, ...] = ()
    tolerances: tuple[Tolerance, ...] = ()
    files: tuple[PlacesFile, ...] = ()
    drift: tuple[Metres, ...] = ()
    """Distance of each agent from its plan, metres, because it starts slightly earlier or later, in addition to its
    tracking error. Set only for missions prepared for planning (``lower.tighten``)."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the agents, in mission order."""
        return tuple(agent.name for agent in self.agents)

    @property
    def dimension(self) -> int:
        return self.world.dimension

    @property
    def starts(self) -> list[tuple[Agent, InitialSet]]:
        """All agents, each with its set of start positions."""
        return [(agent, agent.start) for agent in self.agents]

    @property
    def finishes(self) -> list[tuple[Agent, InitialSet]]:
        """Agents that have a finish, each with its set of finish positions."""
        return [(agent, agent.finish) for agent in self.agents if agent.finish is not None]

    def ends_at(self, step: int) -> list[tuple[Agent, InitialSet]]:
        """Agents with a prescribed position set at this step: starts at step 0, finishes at the last step, none
        otherwise."""
        return self.starts if step == 0 else self.finishes if step == self.steps else []

    def spacing(self, first: int, second: int) -> Spacing:
        """Required separation of the centres of two agents (mission indices).

        The separation covers both bodies and the mission's separation in every direction, and the vehicles' own
        distances and tracking errors. Bodies and pair distance grow by both tracking errors, and so does the ellipsoid
        of their downwash, by slightly more in height (``verify.flight.joint_claims.downwash`` gives the reason). Agents
        without a vehicle need only the mission's separation. In a plane no agent is above another, so both half axes
        are the horizontal one.
        """
        one, other = self.agents[first], self.agents[second]
        bodies = one.radius + other.radius
        missed = one.vehicle.tracking + other.vehicle.tracking
        if self.drift:
            missed += self.drift[first] + self.drift[second]
        apart = max(bodies, one.vehicle.pair_distance, other.vehicle.pair_distance) + missed
        sideways = height = max(bodies + self.separation, apart)
        wide = one.vehicle.downwash_radius + other.vehicle.downwash_radius
        tall = one.vehicle.downwash_height + other.vehicle.downwash_height
        if wide > 0 and tall > 0:
            sideways = max(sideways, wide + missed)
            height = max(height, math.sqrt(tall**2 * (1 + missed / wide) + missed**2 + missed * wide))
        return Spacing(Metres(sideways), Metres(height if self.dimension == 3 else sideways))

    def room(self, agent: int) -> tuple[Vector, Vector]:
        """Opposite corners of the box that contains an agent's plan, metres: the world inside the fence inset and the
        tracking error, within the vehicle's altitude band.

        The first corner exceeds the second if the box is empty.
        """
        vehicle = self.agents[agent].vehicle
        inset = vehicle.fence_inset + vehicle.tracking
        low = [value + inset for value in self.world.low]
        high = [value - inset for value in self.world.high]
        if self.dimension == 3:
            low[2], high[2] = max(low[2], vehicle.height.low), min(high[2], vehicle.height.high)
        return tuple(low), tuple(high)

    @property
    def horizon(self) -> Seconds:
        return Seconds(self.step * self.steps)
