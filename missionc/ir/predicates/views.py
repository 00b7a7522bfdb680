"""Views of the team: what a predicate measures of it, how fast that changes, how its parts move, and in which words.

A predicate says each of its meanings once, over one of these. Who sees the team in
a way of their own, as a trace or in plain numbers, gives a view of a few lines.
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
    """Measures of the team at some moments, metres; oneself is the agent that a predicate is asked of.

    Each is an array, (...), that broadcasts to one number for each agent that is asked and each moment.
    """

    @property
    def dimension(self) -> int: ...

    def radius(self) -> Array: ...

    def coordinate(self, axis: int) -> Array: ...

    def altitude(self) -> Array: ...

    def speed(self) -> Array:
        """One's own speed, m/s."""

    def outside(self, region: Region) -> Array:
        """The signed distance of one's centre to the region's border, negative inside."""

    def to_beacon(self, beacon: Beacon) -> Array: ...

    def of_place(self, value: Callable[[Any, Array], Array]) -> Array:
        """A function of the library and of one's place, (..., dim), which changes by at most 1 for each metre."""

    def apart(self, first: int | None, second: int) -> Array:
        """The distance of two agents' centres; None is oneself."""

    def formation_error(self, edge: FormationEdge) -> Array:
        """How far the ends of an edge are from the distance or offset they keep, at least 0."""

    def weakest_link(self, graph: Graph) -> Array:
        """The margin of the worst link of the best spanning tree."""

    def level(self, resource: Resource) -> Array:
        """What one has left of a resource."""

    def flagged(self, flag: Flag) -> Array:
        """The margin of the flag's being set."""

    def facing(self, towards: float | Beacon, within: float) -> Array:
        """How much is to spare of one's heading within an angle of a direction, rad, or of where a beacon is."""

    def nothing(self, *, of_team: bool = False) -> Array:
        """Zeros: one for each agent that is asked and each moment, or for each moment."""

    def larger(self, one: Array, other: Array) -> Array: ...


class Changes(Protocol):
    """Bounds on how fast measures change, metres per second; each broadcasts to one for each agent that is asked."""

    @property
    def dimension(self) -> int: ...

    def motion(self) -> Array:
        """One's own speed."""

    def relative(self, first: int | None, second: int) -> Array:
        """The speed of two agents against each other; None is oneself."""

    def acceleration(self) -> Array:
        """One's own, m/s²."""

    def use(self, resource: Resource) -> Array:
        """How fast one uses up or fills a resource."""

    def along(self, direction: tuple[float, ...]) -> Array:
        """How fast the inner product of one's position with a vector changes."""

    def larger(self, one: Array, other: Array) -> Array: ...


class Borders(Protocol):
    """Things of the mission whose borders are moved, and the metres by which a comparison's side is."""

    def region(self, region: Region) -> Region: ...

    def graph(self, graph: Graph) -> Graph: ...

    def formation(self, formation: Formation) -> Formation: ...

    @property
    def metres(self) -> float: ...


class Words(Protocol):
    """A printer's way to write what a formula is made of."""

    def agent(self, index: int) -> str: ...

    def graph(self, graph: Graph, agents: tuple[int, ...]) -> str:
        """The graph, and over which of its agents where those are not all."""

    def angle(self, value: float) -> str:
        """An angle, rad, in degrees and with their unit."""

    def inequality(self, terms: tuple[tuple[float, str], ...], constant: float, sign: str) -> str:
        """``constant + sum(weight * word) >= 0``."""


class Phrases(Words, Protocol):
    """A way to write what a sentence is made of."""

    def agents(self, agents: tuple[int, ...]) -> str:
        """A set by its name, or one by one."""

    def number(self, value: float) -> str: ...
