"""Bodies of obstacles in a proof of impossibility: plain parts of shapes, and boxes claimed to lie inside other shapes.

in   a shape, boxes claimed to lie in it
out  shapes with the required distance of centres from each, metres
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
"""Maximum depth of halving a box to prove that it lies in a shape."""


def name_of_obstacle(number: int) -> str:
    """Name under which a certificate lists the boxes inside an obstacle."""
    return f"obstacle {number}"


def name_in_graph(graph: Sight, number: int) -> str:
    """Name under which a certificate lists the boxes inside a shape that blocks lines of sight."""
    return f"graph {graph.name} {number}"


def parts(shape: Shape) -> Iterator[Shape]:
    """Yield the shapes whose union is the given shape."""
    if isinstance(shape, Union):
        yield from parts(shape.left)
        yield from parts(shape.right)
    else:
        yield shape


def is_plain(shape: Shape) -> bool:
    """Return whether the signed distance of a shape is exact outside the shape."""
    return not isinstance(shape, Union | Intersection | Difference)


def boxes_in(name: str, cover: ClaimedCover) -> list[Box]:
    """Boxes that a certificate claims to lie in a shape."""
    if name not in cover.bodies:
        return []
    low, high = cover.bodies[name]
    return [Box(tuple(one), tuple(other)) for one, other in zip(low.tolist(), high.tolist(), strict=True)]


def blocked(mission: Mission, cover: ClaimedCover, number: int, radius: float, step: int, boxes: Boxes) -> Flags:
    """Flags of boxes, (...), in which no centre of a body is clear of an obstacle at a step.

    Args:
        number: index of the obstacle.
        radius: radius of the body, metres.
    """
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
    """Return whether a box surely lies in a shape, up to the verification tolerance at its faces.

    A False result may be wrong: distances are understated slightly outside of combined shapes, so parts of the box
    there count only if they lie inside.
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
