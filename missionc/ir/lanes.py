"""The user's own roadmap: places and the lanes between them."""

from __future__ import annotations

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres, Seconds
from missionc.ir.shapes import Vector


class LaneNode(Record):
    """A place of the roadmap, by the name that its file gives it."""

    name: str
    position: Vector
    span: Span


class Lane(Record):
    """A straight way from one node to another, by their numbers; the way back is a lane of its own.

    Args:
        speed: m/s, the most that agents go on it; infinite where nothing is said.
        duration: seconds that it takes at least; 0 where nothing is said.
    """

    source: int
    target: int
    speed: float
    duration: Seconds
    span: Span


class Lanes(Record, eq=False):
    """All nodes and lanes of a roadmap; ``path`` is its file as the mission has it."""

    path: str
    nodes: tuple[LaneNode, ...]
    lanes: tuple[Lane, ...]
    span: Span

    def length(self, lane: Lane) -> Metres:
        """How long a lane is."""
        ends = zip(self.nodes[lane.source].position, self.nodes[lane.target].position, strict=True)
        return Metres(sum((after - before) ** 2 for before, after in ends) ** 0.5)
