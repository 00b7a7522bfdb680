"""Search results: the joint motions that a search ends with."""

from __future__ import annotations

from dataclasses import dataclass

from missionc.base.trace import Array


@dataclass(frozen=True, slots=True, eq=False)
class Searched:
    """Joint motions, each (agents, steps + 1, dim), metres, the cheapest first; none where none was found.

    ``planned`` is how many agents were planned at once at most, and ``margin``
    by how much the best candidate with so many holds, metres. ``iterations``
    are local optimisations of whole rounds, ``found`` is how many joint
    motions there were to choose from.

    Source:
        [clot] V-A.2, which reports both numbers.
    """

    motions: tuple[Array, ...]
    planned: int
    margin: float
    iterations: int = 0
    found: int = 0

    @property
    def sizes(self) -> dict[str, int]:
        """What a report says of the search."""
        return {"local iterations": self.iterations, "joint motions": self.found}

    @property
    def rank(self) -> tuple[int, float]:
        """The more, the further it came."""
        return self.planned, self.margin
