"""Label placement: the name of a shape inside it, and beside the paths that run through it."""

from __future__ import annotations

import numpy as np

from missionc.base.trace import Array
from missionc.ir import Shape, World
from missionc.output.plot.silhouette import View, inner_point
from missionc.verify.plan.obstacle_bodies import solid

LETTER = 0.62
"""How wide a letter is, in font sizes."""

LINE = 1.5
"""How high a line is, in font sizes."""

SHIFTS = (0.0, -1.0, 1.0, -2.0, 2.0, -3.0, 3.0, -4.0, 4.0)
"""Lines up from the middle of the shape, in the order in which they are tried."""

PIECES = 24
"""Pieces of each segment of a path."""


def name_place(world: World, view: View, shape: Shape, name: str, letter: float, paths: Array) -> tuple[float, float]:
    """The middle of a name: that of the shape, or the nearest line above or below that no path crosses.

    Args:
        letter: the size of its font, metres.
        paths: (agents, points, 2), metres, across and up.
    """
    middle = inner_point(world, view, shape)
    if world.dimension > 2:
        return middle
    wide, high = LETTER * letter * len(name), LINE * letter
    share = np.linspace(0.0, 1.0, PIECES)[:, None, None, None]
    points = (paths[None, :, :-1] * (1 - share) + paths[None, :, 1:] * share).reshape(-1, 2)
    for shift in SHIFTS:
        place = np.array([middle[0], middle[1] + shift * high])
        crossed = (np.abs(points - place) < np.array([wide, high]) / 2).all(axis=1).any()
        if not crossed and float(solid(shape, 2)(place[None])[0]) <= -high / 2:
            return float(place[0]), float(place[1])
    return middle
