"""Views of the team for predicates: measures, rates of change, moved boundaries, and wording.

A predicate defines its meaning once, over one of these views. A module with its own representation of the team, such as
a trace or plain numbers, provides a short view.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

from missionc.ir.couplings import Formation, FormationEdge, Graph
from missionc.ir.places import Beacon, Region
from missionc.ir.resources import Flag, Resource

Array: TypeAlias = Any
"""Array (...) of any library, or a number."""


class Measures(Protocol):
    """Interface to the measures of the team that predicates combine: metres, for the evaluated agents at some times.

    Each measure is an array (...) that broadcasts to one number for each evaluated agent and time.
    """

    @property
    def dimension(self) -> int: ...

    def radius(self) -> Array: ...

    def coordinate(self, axis: int) -> Array: ...

    def altitude(self) -> Array: ...

    def speed(self) -> Array:
        """Speed of the evaluated agents: (...), m/s."""

    def outside(self, region: Region) -> Array:
        """Signed distance of the agent's centre to the region's border, negative inside: (...), metres."""

    def to_beacon(self, beacon: Beacon) -> Array: ...

    def of_place(self, value: Callable[[Any, Array], Array]) -> Array:
        """Value of a function of the array library and the agent's position, (..., dim): (...), metres.

        The function changes by at most 1 per metre.
        """

    def apart(self, first: int | None, second: int) -> Array:
        """Distance of two agents' centres (``first`` None is the evaluated agent): (...), metres."""

    def formation_error(self, edge: FormationEdge) -> Array:
        """Error of a formation edge's distance or offset, at least 0: (...), metres."""

    def least_in_motion(self, margin: Callable[[Any], Array]) -> Array:
        """Least value of a margin, (...), metres, over the agent's motion from here to the next step."""

    def weakest_link(self, graph: Graph) -> Array:
        """Margin of the worst link of the graph's maximum spanning tree: (...), metres."""

    def level(self, resource: Resource) -> Array:
        """Level of a resource of the agent: (...), in the resource's unit."""

    def flagged(self, flag: Flag) -> Array:
        """Margin of the evaluated agents' flag being set: (...), metres."""

    def facing(self, towards: float | Beacon, within: float) -> Array:
        """Margin of the agent's heading within an angle of a direction (rad) or a beacon (metres): (...)."""

    def nothing(self, *, of_team: bool = False) -> Array:
        """Zeros (...), dimensionless: one zero per evaluated agent and time, or with ``of_team`` one zero per time."""

    def larger(self, one: Array, other: Array) -> Array: ...


class Changes(Protocol):
    """Interface to upper bounds on the rates of change of measures, m/s; each broadcasts to one per evaluated agent."""

    @property
    def dimension(self) -> int: ...

    def motion(self) -> Array:
        """Speed of the evaluated agents: (...), m/s."""

    def relative(self, first: int | None, second: int) -> Array:
        """Relative speed of two agents (``first`` None is the evaluated agent): (...), m/s."""

    def acceleration(self) -> Array:
        """Acceleration of the evaluated agents: (...), m/s²."""

    def use(self, resource: Resource) -> Array:
        """Rate of change of a resource level: (...), the resource's unit per second."""

    def along(self, direction: tuple[float, ...]) -> Array:
        """Rate of change of the inner product of the agent's position with a vector: (...), m/s."""

    def larger(self, one: Array, other: Array) -> Array: ...


class Borders(Protocol):
    """Interface to moved boundaries of regions, graphs and formations; ``metres`` is the move for a comparison."""

    def region(self, region: Region) -> Region: ...

    def graph(self, graph: Graph) -> Graph: ...

    def formation(self, formation: Formation) -> Formation: ...

    @property
    def metres(self) -> float: ...


class Words(Protocol):
    """Interface of the printer for the parts of a formula."""

    def agent(self, index: int) -> str: ...

    def graph(self, graph: Graph, agents: tuple[int, ...]) -> str:
        """Text of the graph, with ``agents`` if they are a subset of its agents."""

    def angle(self, value: float) -> str:
        """Text of an angle, given in rad, in degrees with the unit."""

    def inequality(self, terms: tuple[tuple[float, str], ...], constant: float, sign: str) -> str:
        """Text of a linear inequality: ``constant + sum(weight * word) >= 0``."""


class Phrases(Words, Protocol):
    """Interface of the printer for the parts of a sentence."""

    def agents(self, agents: tuple[int, ...]) -> str:
        """Name of an agent set, or if it has none, the list of its agents."""

    def number(self, value: float) -> str: ...
