"""Start grids: places spread evenly on a line, and in rows and columns."""

from __future__ import annotations

import math

from missionc.ir import Vector


def on_line(first: Vector, last: Vector, count: int) -> tuple[Vector, ...]:
    """So many points equally spaced from the first to the last, both included; a single one is in the middle."""
    return tuple(_between(first, last, (_part(index, count),) * len(first)) for index in range(count))


def on_grid(first: Vector, last: Vector, count: int) -> tuple[Vector, ...]:
    """So many points in rows and columns between two opposite corners, both included.

    The first row runs along the first axis from the first corner, the next ones
    follow along the second axis, and in a volume layers along the third. A lone
    row, column or layer is in the middle. The numbers of rows and columns are
    those whose cells are nearest to squares (cubes), with the fewest free
    places, then the fewest columns, among equals.
    """
    sides = tuple(abs(b - a) for a, b in zip(first, last, strict=True))
    counts = _counts(sides, count)
    points = []
    for index in range(count):
        parts, rest = [], index
        for length in counts:
            rest, place = divmod(rest, length)
            parts.append(_part(place, length))
        points.append(_between(first, last, tuple(parts)))
    return tuple(points)


def _part(index: int, count: int) -> float:
    return index / (count - 1) if count > 1 else 0.5


def _between(first: Vector, last: Vector, parts: tuple[float, ...]) -> Vector:
    return tuple(b if part == 1 else a + (b - a) * part for a, b, part in zip(first, last, parts, strict=True))


def _counts(sides: Vector, count: int) -> tuple[int, ...]:
    """How many points along each side: one along a side of no length."""
    long = tuple(axis for axis, side in enumerate(sides) if side > 0) or (0,)
    choices: list[dict[int, int]]
    match long:
        case (axis,):
            choices = [{axis: count}]
        case (first, second):
            choices = [{first: some, second: math.ceil(count / some)} for some in range(1, count + 1)]
        case _:
            choices = [
                {0: some, 1: others, 2: math.ceil(count / (some * others))}
                for some in range(1, count + 1)
                for others in range(1, math.ceil(count / some) + 1)
            ]
    every = [tuple(choice.get(axis, 1) for axis in range(len(sides))) for choice in choices]
    return min(every, key=lambda counts: (_stretch(sides, counts, long), math.prod(counts), counts))


def _stretch(sides: Vector, counts: tuple[int, ...], axes: tuple[int, ...]) -> float:
    """How much longer than wide a cell is; 1 for a square. Rounded, so that equals are equal."""
    gaps = [sides[axis] / max(counts[axis] - 1, 1) for axis in axes]
    return round(max(gaps) / min(gaps), 9) if min(gaps) > 0 else 1.0
