"""User roadmaps: places and the lanes between them."""

from __future__ import annotations

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres, Seconds
from missionc.ir.shapes import Vector


class LaneNode(Record):
    """A place of the roadmap, under its name in the file."""

    name: str
    position: Vector
    span: Span


class Lane(Record):
    """A straight, directed edge between two nodes, by their numbers.

    Args:
        speed: maximum on it, m/s; infinite if not given.
        duration: minimum time, seconds; 0 if not given.
    """

    source: int
    target: int
    speed: float
    duration: Seconds
    span: Span


class Lanes(Record, eq=False):
    """All nodes and lanes of a roadmap; ``path`` is the path of its file as in the mission."""

    path: str
    nodes: tuple[LaneNode, ...]
    lanes: tuple[Lane, ...]
    span: Span

    def length(self, lane: Lane) -> Metres:
        """Length of a lane."""
        ends = zip(self.nodes[lane.source].position, self.nodes[lane.target].position, strict=True)
        return Metres(sum((after - before) ** 2 for before, after in ends) ** 0.5)
