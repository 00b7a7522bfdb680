"""Validity of polygons: enough corners, positive area, no repeated corner, no intersecting sides."""

from __future__ import annotations

from typing import TypeAlias

Corner: TypeAlias = tuple[float, float]


class Simple:
    """Result for a valid polygon, whose sides meet only at the corners."""


SIMPLE = Simple()


def fault(corners: tuple[Corner, ...]) -> str | Simple:
    """Fault of the polygon, as a phrase for a message that starts with it, or ``SIMPLE`` for a valid polygon."""
    if len(corners) < 3:
        return f"has {len(corners)} corners; it needs three"
    for index, corner in enumerate(corners):
        if corner == corners[index - 1]:
            second = index + 1 if index else len(corners)
            return f"has corner {second} where corner {second - 1 if index else 1} is"
    if area(corners) == 0:
        return "has no area"
    return _meeting_sides(corners)


def area(corners: tuple[Corner, ...]) -> float:
    """Signed area of a polygon, m²; positive if the corners run counterclockwise."""
    origin_x, origin_y = corners[0]
    shifted = [(x - origin_x, y - origin_y) for x, y in corners]
    return sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(shifted, shifted[1:] + shifted[:1], strict=True)) / 2


def _meeting_sides(corners: tuple[Corner, ...]) -> str | Simple:
    """Phrase for two sides that intersect, or ``SIMPLE``; a sweep line visits the sides by their left ends."""
    sides = []
    for index, (a, b) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
        (left, right), (low, high) = sorted((a[0], b[0])), sorted((a[1], b[1]))
        sides.append((left, right, low, high, index))
    sides.sort()
    swept: list[tuple[float, float, float, float, int]] = []
    for side in sides:
        left, _, low, high, index = side
        swept = [other for other in swept if other[1] >= left]
        for other in [other[4] for other in swept if other[2] <= high and other[3] >= low]:
            if _meet(corners, index, other):
                first, second = sorted((index, other))
                return f"crosses itself: side {first + 1} meets side {second + 1}"
        swept.append(side)
    return SIMPLE


def _meet(corners: tuple[Corner, ...], side: int, other: int) -> bool:
    """Return whether two sides share more than the corner between adjacent sides."""
    count = len(corners)
    if (other + 1) % count == side:
        side, other = other, side
    ends = [corners[place % count] for place in (side, side + 1, other, other + 1)]
    if (side + 1) % count == other:
        return _folds_back(ends[0], ends[1], ends[3])
    return _touch(*ends)


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _folds_back(start: Corner, corner: Corner, end: Corner) -> bool:
    """Return whether the second of two adjacent sides runs back over the first."""
    ahead = (corner[0] - start[0]) * (end[0] - corner[0]) + (corner[1] - start[1]) * (end[1] - corner[1])
    return _turn(start, corner, end) == 0 and ahead < 0


def _between(a: Corner, b: Corner, point: Corner) -> bool:
    """Return whether a point on the line through ``a`` and ``b`` lies between them."""
    return min(a[0], b[0]) <= point[0] <= max(a[0], b[0]) and min(a[1], b[1]) <= point[1] <= max(a[1], b[1])


def _touch(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Return whether the segments ``ab`` and ``cd`` have a common point."""
    turns = _turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b)
    if ((turns[0] > 0) != (turns[1] > 0)) and ((turns[2] > 0) != (turns[3] > 0)) and 0 not in turns:
        return True
    places = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    return any(turn == 0 and _between(*place) for turn, place in zip(turns, places, strict=True))
