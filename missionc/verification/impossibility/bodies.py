"""Bodies of what stands: plain parts of shapes, and the boxes that a certificate says lie in the others.

in   a shape, boxes that are claimed to lie in it
out  shapes with the metres that a centre has to stay away from each
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.geometry.displacement import displaced, moved
from missionc.ir import Box, Difference, Intersection, Mission, Obstacle, Shape, Sight, Union
from missionc.verification.certificate import MOTION
from missionc.verification.impossibility.cover_document import ClaimedCover
from missionc.verification.impossibility.intervals import NEARER, Boxes, signed_distances

DEEP = 10
"""How often a box is halved to see that it lies in a shape."""


def name_of_obstacle(number: int) -> str:
    """What the boxes of an obstacle are called in a certificate."""
    return f"obstacle {number}"


def name_in_graph(graph: Sight, number: int) -> str:
    """What the boxes of something that hides are called in a certificate."""
    return f"graph {graph.name} {number}"


def parts(shape: Shape) -> Iterator[Shape]:
    """The shapes that it is the union of."""
    if isinstance(shape, Union):
        yield from parts(shape.left)
        yield from parts(shape.right)
    else:
        yield shape


def is_plain(shape: Shape) -> bool:
    """Whether its signed distance is the true one outside of it."""
    return not isinstance(shape, Union | Intersection | Difference)


def boxes_in(name: str, cover: ClaimedCover) -> list[Box]:
    """Those that a certificate says lie in a shape."""
    if name not in cover.bodies:
        return []
    low, high = cover.bodies[name]
    return [Box(tuple(one), tuple(other)) for one, other in zip(low.tolist(), high.tolist(), strict=True)]


def blocked(mission: Mission, cover: ClaimedCover, number: int, radius: float, step: int, boxes: Boxes) -> Flags:
    """In which boxes, (...), no centre of a body is clear of an obstacle at a step."""
    obstacle: Obstacle = mission.obstacles[number]
    time = step * mission.step
    by = displaced(obstacle, time, mission.dimension)
    away = radius + mission.clearance + obstacle.grown(time)
    found: Flags = np.zeros(boxes[0].shape[:-1], dtype=np.bool_)
    plain = [(part, away if is_plain(part) else 0.0) for part in parts(obstacle.shape)]
    for shape, needed in (*plain, *((box, away) for box in boxes_in(name_of_obstacle(number), cover))):
        found |= signed_distances(moved(shape, by), boxes).high < needed - NEARER
    return found


def lies_in(box: Box, shape: Shape) -> bool:
    """Whether all of a box surely lies in a shape, but for as much along its faces as verification lets pass.

    A little outside of shapes that are combined, distances say too little of how far it is: what is left has to lie
    inside.
    """
    low, high = np.array(box.low) + MOTION, np.array(box.high) - MOTION
    return bool((low <= high).all()) and _lies_in(low, high, shape, DEEP)


def _lies_in(low: Array, high: Array, shape: Shape, deep: int) -> bool:
    distance = signed_distances(shape, (low, high))
    if distance.high <= 0.0:
        return True
    if distance.low > 0.0 or not deep:
        return False
    axis = int((high - low).argmax())
    middle = (low[axis] + high[axis]) / 2
    first, second = high.copy(), low.copy()
    first[axis] = second[axis] = middle
    return _lies_in(low, first, shape, deep - 1) and _lies_in(second, high, shape, deep - 1)
