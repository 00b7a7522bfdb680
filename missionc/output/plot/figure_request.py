"""Figure requests: content, moments and width of a picture of a plan."""

from __future__ import annotations

from missionc.base.late_dataclass import Record

MAP, ROADMAP, ROBUSTNESS, DISTANCES, TIMELINE = KINDS = ("map", "roadmap", "robustness", "distances", "timeline")
"""Kinds of figures; the first is the default."""
MAPS = (MAP, ROADMAP)
"""Kinds that show the world, so that they can be drawn at moments."""

SUFFIXES = (".svg", ".png", ".pdf")

WIDTHS = {"single": 8.6, "double": 17.8}
"""Widths in cm of a column, and of a page with two columns."""

MOST_MOMENTS = 24
"""Maximum number of snapshots in a strip."""


class FigureRequest(Record):
    """Request for a figure.

    Args:
        at: moments of map snapshots, seconds; empty for the whole motion.
        width: a name in ``WIDTHS``; empty for the natural width of the picture.
    """

    kind: str = MAP
    at: tuple[float, ...] = ()
    width: str = ""
