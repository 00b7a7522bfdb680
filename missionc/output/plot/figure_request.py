"""Figure requests: kind, snapshot times and width of a picture of a plan."""

from __future__ import annotations

from missionc.base.late_dataclass import Record

MAP, ROADMAP, ROBUSTNESS, DISTANCES, TIMELINE = KINDS = ("map", "roadmap", "robustness", "distances", "timeline")
"""Kinds of figures; the first is the default."""
MAPS = (MAP, ROADMAP)
"""Kinds of figures that show the world, so that they can be drawn as snapshots."""

SUFFIXES = (".svg", ".png", ".pdf")

WIDTHS = {"single": 8.6, "double": 17.8}
"""Widths in cm of a text column, and of a page with two columns."""

MOST_MOMENTS = 24
"""Maximum number of snapshots side by side in a picture."""


class FigureRequest(Record):
    """Request for a picture of a plan.

    Args:
        at: times of map snapshots, seconds; empty for the complete motion.
        width: a name in ``WIDTHS``; empty for the natural width of the picture.
    """

    kind: str = MAP
    at: tuple[float, ...] = ()
    width: str = ""
