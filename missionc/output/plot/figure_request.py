"""Figure requests: what a picture of a plan shows, at which moments, and how wide it is."""

from __future__ import annotations

from dataclasses import dataclass

MAP, ROADMAP, ROBUSTNESS, DISTANCES, TIMELINE = KINDS = ("map", "roadmap", "robustness", "distances", "timeline")
"""What is drawn; the first is the default."""
MAPS = (MAP, ROADMAP)
"""Those that show the world, so that they can be drawn at moments."""

SUFFIXES = (".svg", ".png", ".pdf")

WIDTHS = {"single": 8.6, "double": 17.8}
"""Centimetres: of a column, and of a page of two columns."""

MOST_MOMENTS = 24
"""A strip has at most so many snapshots."""


@dataclass(frozen=True, slots=True)
class FigureRequest:
    """
    Args:
        at: seconds, at each of which a map is drawn as a snapshot; empty for the whole motion.
        width: a name of ``WIDTHS``; empty where the picture is as wide as what it shows needs.
    """

    kind: str = MAP
    at: tuple[float, ...] = ()
    width: str = ""
