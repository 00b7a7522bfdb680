"""Placements of a formation: outer bounds of the first agent's positions such that all agents are in free space."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import shapely
from shapely.affinity import translate

from missionc.base.late_dataclass import Record
from missionc.geometry.height_layers import WIDEN

TURNS = 72
"""Number of headings tried for a formation that may rotate; each covers half the angle to its neighbours."""

MOST_PLACES = 2_000
"""Maximum number of agent positions tried in total; larger formations use fewer headings."""


class Spot(Record):
    """Position of an agent relative to the first: within ``slack`` metres of one of ``points``, metres, before
    rotation."""

    points: tuple[tuple[float, float], ...]
    slack: float


def placements(
    free: Sequence[shapely.Geometry], spots: Sequence[Spot], *, turns: bool, first: bool
) -> shapely.Geometry:
    """Outer bound of the first agent's positions for which every agent is in its free space, over all headings.

    Args:
        free: free space of each agent.
        turns: True if the formation may have any heading.
        first: True to stop at the first heading with such positions.
    """
    headings = max(min(TURNS, MOST_PLACES // len(spots)), 8) if turns else 1
    half = math.pi / headings if turns else 0.0
    wide = [
        shapely.buffer(area, WIDEN * (spot.slack + half * max(math.hypot(*point) for point in spot.points)))
        for area, spot in zip(free, spots, strict=True)
    ]
    found: list[shapely.Geometry] = []
    for number in range(headings):
        places = _at_heading(wide, spots, 2 * math.pi * number / headings)
        if not places.is_empty:
            found.append(places)
            if first:
                break
    return shapely.union_all(found)


def _at_heading(wide: Sequence[shapely.Geometry], spots: Sequence[Spot], heading: float) -> shapely.Geometry:
    along, across = math.cos(heading), math.sin(heading)
    places: shapely.Geometry | None = None
    for area, spot in zip(wide, spots, strict=True):
        moved = [translate(area, across * y - along * x, -across * x - along * y) for x, y in spot.points]
        here = moved[0] if len(moved) == 1 else shapely.union_all(moved)
        places = here if places is None else shapely.intersection(places, here)
        if places.is_empty:
            break
    assert places is not None
    return places


def joined_placements(places: shapely.Geometry, stride: float, ends: Sequence[shapely.Geometry]) -> bool:
    """Return true if moves of at most ``stride`` metres between placements can connect all of the sets ``ends``."""
    for part in shapely.get_parts(shapely.buffer(places, WIDEN * stride / 2)):
        if all(bool(shapely.intersects(shapely.intersection(places, end), part)) for end in ends):
            return True
    return False


def least_width(points: Sequence[tuple[float, float]]) -> float:
    """Width of a set of points in the direction of least width, metres."""
    hull = shapely.convex_hull(shapely.MultiPoint(points))
    corners = list(map(tuple, shapely.get_coordinates(hull)))
    return min((_across(corners, *pair) for pair in _sides(corners)), default=0.0)


def _sides(corners: Sequence[tuple[float, float]]) -> Iterator[tuple[tuple[float, float], tuple[float, float]]]:
    return ((here, there) for here, there in pairwise(corners) if here != there)


def _across(corners: Sequence[tuple[float, float]], here: tuple[float, float], there: tuple[float, float]) -> float:
    length = math.dist(here, there)
    heights = [
        ((there[0] - here[0]) * (y - here[1]) - (there[1] - here[1]) * (x - here[0])) / length for x, y in corners
    ]
    return max(heights) - min(heights)
