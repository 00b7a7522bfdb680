"""User roadmaps: nodes at fixed positions and the lanes between them."""

from __future__ import annotations

from missionc.base.late_dataclass import Record
from missionc.base.source import Span
from missionc.base.units import Metres, Seconds
from missionc.ir.places import Vector


class LaneNode(Record):
    """Node of a user roadmap: its position, metres, and its name in the roadmap file."""

    name: str
    position: Vector
    span: Span


class Lane(Record):
    """Straight, directed edge of a user roadmap between two nodes, by node number.

    Args:
        speed: speed limit of the lane, m/s; infinite if not given.
        duration: minimum travel time, seconds; 0 if not given.
    """

    source: int
    target: int
    speed: float
    duration: Seconds
    span: Span


class Lanes(Record, eq=False):
    """User roadmap with all nodes and lanes; ``path`` is the path of its file as the mission writes it."""

    path: str
    nodes: tuple[LaneNode, ...]
    lanes: tuple[Lane, ...]
    span: Span

    def length(self, lane: Lane) -> Metres:
        """Length of a lane, metres."""
        ends = zip(self.nodes[lane.source].position, self.nodes[lane.target].position, strict=True)
        return Metres(sum((after - before) ** 2 for before, after in ends) ** 0.5)
