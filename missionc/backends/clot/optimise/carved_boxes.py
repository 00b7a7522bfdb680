"""Boxes with boxes taken out of them, as the boxes that are left: distances to these are exact.

The signed distance to a difference is a bound: in a door that is cut out of a wall it sees the edges of what was cut
away, not the wall, and calls the door narrower than it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from missionc.ir import Box, Difference, Obstacle, Shape, Union


def carved(obstacle: Obstacle) -> list[Obstacle]:
    """The obstacle as several that are solid, where it is made of boxes; as it is, where it is not."""
    pieces = _pieces(obstacle.shape)
    return [obstacle] if pieces is None else [replace(obstacle, shape=piece) for piece in pieces]


def _pieces(shape: Shape) -> list[Box] | None:
    match shape:
        case Box():
            return [shape]
        case Union(left, right):
            one, other = _pieces(left), _pieces(right)
            return None if one is None or other is None else one + other
        case Difference(left, right):
            one, other = _pieces(left), _pieces(right)
            if one is None or other is None:
                return None
            for taken in other:
                one = [piece for box in one for piece in _without(box, taken)]
            return one
        case _:
            return None


def _without(box: Box, taken: Box) -> Iterator[Box]:
    """What is left of a box: on either side of what is taken, one axis after the other."""
    if any(a >= d or c >= b for a, b, c, d in zip(box.low, box.high, taken.low, taken.high, strict=True)):
        yield box
        return
    low, high = list(box.low), list(box.high)
    for axis, (begin, end) in enumerate(zip(taken.low, taken.high, strict=True)):
        if low[axis] < begin:
            yield Box(tuple(low), (*high[:axis], begin, *high[axis + 1 :]))
            low[axis] = begin
        if end < high[axis]:
            yield Box((*low[:axis], end, *low[axis + 1 :]), tuple(high))
            high[axis] = end
