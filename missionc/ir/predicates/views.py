"""Views of the team for predicates: measures, their rates, moved boundaries, and wording.

A predicate defines each meaning once, over one of these views. A module with its own representation of the team, such
as a trace or plain numbers, provides a short view.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

from missionc.ir.couplings import Formation, FormationEdge, Graph
from missionc.ir.places import Beacon, Region
from missionc.ir.resources import Flag, Resource

Array: TypeAlias = Any
"""An array of any library, (...), or a number."""


class Measures(Protocol):
    """Measures of the team at some times, metres, for an evaluated agent.

    Each is an array, (...), that broadcasts to one number for each evaluated agent and time.
    """

    @property
    def dimension(self) -> int: ...

    def radius(self) -> Array: ...

    def coordinate(self, axis: int) -> Array: ...

    def altitude(self) -> Array: ...

    def speed(self) -> Array:
        """Speed of the evaluated agent: (...), m/s."""

    def outside(self, region: Region) -> Array:
        """Signed distance of the agent's centre to the region's border, negative inside: (...), metres."""

    def to_beacon(self, beacon: Beacon) -> Array: ...

    def of_place(self, value: Callable[[Any, Array], Array]) -> Array:
        """Function of the library and the agent's position, (..., dim), that changes by at most 1 per metre.

        Shape: (...), metres.
        """

    def apart(self, first: int | None, second: int) -> Array:
        """Distance of two agents' centres; None means the evaluated agent: (...), metres."""

    def formation_error(self, edge: FormationEdge) -> Array:
        """Error of a formation edge's distance or offset, at least 0: (...), metres."""

    def least_in_motion(self, margin: Callable[[Any], Array]) -> Array:
        """Least value of a margin, (...), metres, over the agent's motion from here to the next step."""

    def weakest_link(self, graph: Graph) -> Array:
        """Margin of the worst link of the best spanning tree: (...), metres."""

    def level(self, resource: Resource) -> Array:
        """Level of a resource of the agent: (...), a number."""

    def flagged(self, flag: Flag) -> Array:
        """Margin of the flag being set: (...), metres."""

    def facing(self, towards: float | Beacon, within: float) -> Array:
        """Margin of the heading: (...), rad within an angle of a direction, or metres for a beacon."""

    def nothing(self, *, of_team: bool = False) -> Array:
        """Zeros (...), dimensionless: one per evaluated agent and time, or with ``of_team`` per time."""

    def larger(self, one: Array, other: Array) -> Array: ...


class Changes(Protocol):
    """Bounds on the rates of measures, m/s; each broadcasts to one per evaluated agent."""

    @property
    def dimension(self) -> int: ...

    def motion(self) -> Array:
        """Speed of the evaluated agent: (...), m/s."""

    def relative(self, first: int | None, second: int) -> Array:
        """Relative speed of two agents; None means the evaluated agent: (...), m/s."""

    def acceleration(self) -> Array:
        """Acceleration of the evaluated agent: (...), m/s²."""

    def use(self, resource: Resource) -> Array:
        """Rate of change of a resource: (...), a number per second."""

    def along(self, direction: tuple[float, ...]) -> Array:
        """Rate of change of the position's inner product with a vector: (...), m/s."""

    def larger(self, one: Array, other: Array) -> Array: ...


class Borders(Protocol):
    """Moved boundaries of the mission's objects, and the margin in metres for a comparison."""

    def region(self, region: Region) -> Region: ...

    def graph(self, graph: Graph) -> Graph: ...

    def formation(self, formation: Formation) -> Formation: ...

    @property
    def metres(self) -> float: ...


class Words(Protocol):
    """Printer for the parts of a formula."""

    def agent(self, index: int) -> str: ...

    def graph(self, graph: Graph, agents: tuple[int, ...]) -> str:
        """Text of the graph, with its agents if they are a subset."""

    def angle(self, value: float) -> str:
        """Text of an angle, rad, in degrees with the unit."""

    def inequality(self, terms: tuple[tuple[float, str], ...], constant: float, sign: str) -> str:
        """``constant + sum(weight * word) >= 0``."""


class Phrases(Words, Protocol):
    """Printer for the parts of a sentence."""

    def agents(self, agents: tuple[int, ...]) -> str:
        """Name of an agent set, or a list of its agents."""

    def number(self, value: float) -> str: ...
