"""Projections of shapes, from above or from the side, on matplotlib axes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from missionc.base.late_dataclass import Record
from missionc.base.trace import Array
from missionc.ir import Ball, Box, Disc, Polygon, Prism, Shape, World
from missionc.verification.plan.obstacle_bodies import solid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

GRID, DEPTH = 360, 24
"""Numbers of samples for shapes without a closed-form outline: across the world, and along the line of sight."""


class View(Record):
    """Projection of a picture: indices of the coordinates on the horizontal and the vertical axis."""

    across: int
    up: int


def draw_shape(
    axes: Axes, world: World, view: View, shape: Shape, shift: Array | None = None, grown: float = 0.0, **style: Any
) -> None:
    """Draw a shape's silhouette, with the style of a matplotlib patch.

    Args:
        shift: displacement of the shape, (dim,), metres.
        grown: growth on all sides, metres.
    """
    offset = np.zeros(world.dimension) if shift is None else shift
    patch = None if grown else _patch(world, view, shape, offset, style)
    if patch is not None:
        axes.add_patch(patch)
        return
    across, up, depth = _depth(world, view, shape, offset)
    x, y = across + offset[view.across], up + offset[view.up]
    alpha, zorder = style.get("alpha"), style.get("zorder", 1)
    inside = float(min(depth.min(), 0.0)) - 1.0
    axes.contourf(x, y, depth, levels=[inside, grown], colors=[style["fc"]], alpha=alpha, zorder=zorder)
    line = {"linewidths": style.get("lw", 1), "linestyles": [style.get("ls", "-")], "zorder": zorder}
    axes.contour(x, y, depth, levels=[grown], colors=[style["ec"]], **line)


def silhouette_point(world: World, view: View, shape: Shape) -> tuple[float, float]:
    """Point well inside the shape's silhouette, for its name."""
    match shape:
        case Box(low, high):
            return (low[view.across] + high[view.across]) / 2, (low[view.up] + high[view.up]) / 2
        case Ball(centre):
            return centre[view.across], centre[view.up]
        case Disc(centre) if view.up == 1:
            return centre[0], centre[1]
        case _:
            across, up, depth = _depth(world, view, shape)
            inside = np.argwhere(depth <= 0)
            if not len(inside):
                return float(across[GRID // 2]), float(up[GRID // 2])
            # Its middle, if that is well inside; else the place where it is widest.
            row, column = np.rint(inside.mean(axis=0)).astype(int)
            if depth[row, column] > 0.4 * depth.min():
                row, column = np.unravel_index(depth.argmin(), depth.shape)
            return float(across[column]), float(up[row])


def _patch(world: World, view: View, shape: Shape, offset: Array, style: dict[str, Any]) -> Patch | None:
    """Matplotlib patch for a simple shape; None for a shape without a closed-form outline.

    Args:
        offset: displacement of the shape, (dim,), metres.
    """
    from matplotlib import patches

    right, top = float(offset[view.across]), float(offset[view.up])
    match shape:
        case Box(low, high):
            corner, far = (low[view.across], low[view.up]), (high[view.across], high[view.up])
            size = far[0] - corner[0], far[1] - corner[1]
            return patches.Rectangle((corner[0] + right, corner[1] + top), *size, **style)
        case Ball(centre, radius):
            return patches.Circle((centre[view.across] + right, centre[view.up] + top), radius, **style)
        case Disc(centre, radius) if view.up == 1:
            return patches.Circle((centre[0] + right, centre[1] + top), radius, **style)
        case Polygon(corners) if view.up == 1:
            return patches.Polygon([(x + right, y + top) for x, y in corners], closed=True, **style)
        case Disc(centre, radius, band):
            bottom, height = _heights(world, band)
            return patches.Rectangle((centre[0] - radius + right, bottom + top), 2 * radius, height, **style)
        case Polygon(corners, band):
            bottom, height = _heights(world, band)
            west, east = min(x for x, _ in corners), max(x for x, _ in corners)
            return patches.Rectangle((west + right, bottom + top), east - west, height, **style)
        case _:
            return None


def _heights(world: World, band: Prism | None) -> tuple[float, float]:
    """Lower end of a prism within the world, and its height there, metres."""
    low, high = (band.low, band.high) if band is not None else (-math.inf, math.inf)
    return max(low, world.low[2]), max(0.0, min(high, world.high[2]) - max(low, world.low[2]))


def _depth(world: World, view: View, shape: Shape, offset: Array | None = None) -> tuple[Array, Array, Array]:
    """Depth of each grid point inside the silhouette: grid coordinates (across,) and (up,), and depths (up, across),
    metres.

    Args:
        offset: displacement of the shape, (dim,), metres.
    """
    away = np.zeros(world.dimension) if offset is None else offset
    low, high = np.array(world.low) - away, np.array(world.high) - away
    across = np.linspace(low[view.across], high[view.across], GRID)
    up = np.linspace(low[view.up], high[view.up], GRID)
    hidden = [axis for axis in range(world.dimension) if axis not in (view.across, view.up)]
    distance = solid(shape, world.dimension)
    point = np.zeros((GRID, GRID, world.dimension))
    point[..., view.across], point[..., view.up] = across[None, :], up[:, None]
    if not hidden:
        return across, up, distance(point)
    nearest = np.full((GRID, GRID), np.inf)
    for place in np.linspace(low[hidden[0]], high[hidden[0]], DEPTH + 2)[1:-1]:
        point[..., hidden[0]] = place
        nearest = np.minimum(nearest, distance(point))
    return across, up, nearest
