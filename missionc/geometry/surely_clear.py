"""Tests that given positions are certainly far enough from obstacles and from each other; in plain numbers.

``placement_conflicts``, which needs arrays, decides the other cases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

from missionc.geometry import plain_floats
from missionc.geometry.configuration_space import MANY, SURE
from missionc.geometry.displacement import displaced
from missionc.geometry.plain_floats import Place
from missionc.ir import Mission, Obstacle, Vector
from missionc.ir.distances.signed_distance import measured_outside, signed_distance

RIM = math.sqrt(2)
"""Factor on the margin at the upper and lower rims of obstacles, which grow both horizontally and vertically."""


def near_to(obstacle: Obstacle, time: float, places: Sequence[Vector], margins: Sequence[float]) -> list[int]:
    """Indices of positions that may be closer to the obstacle at ``time`` seconds than their margins, metres."""
    if len(places) > MANY or not measured_outside(obstacle.shape):
        return list(range(len(places)))
    pairs = enumerate(zip(places, margins, strict=True))
    return [at for at, (place, margin) in pairs if not _clear(obstacle, time, place, margin)]


def _clear(obstacle: Obstacle, time: float, place: Vector, margin: float) -> bool:
    by = displaced(obstacle, time, len(place))
    there = Place(value - shift for value, shift in zip(place, by, strict=True))
    margin += obstacle.grown(time)
    reach = margin if len(place) == 2 else RIM * margin
    return bool(signed_distance(plain_floats, obstacle.shape, there) > reach + SURE)


def all_apart(places: Sequence[Vector], agents: Sequence[int], mission: Mission) -> bool:
    """Return true if all pairs of positions are certainly further apart than their agents' required separation."""
    if len(places) > MANY:
        return False
    pairs = combinations(zip(places, agents, strict=True), 2)
    most = ((math.dist(here, there), mission.spacing(one, other).most) for (here, one), (there, other) in pairs)
    return all(apart > needed + SURE for apart, needed in most)
