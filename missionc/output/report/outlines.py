"""Outlines of shapes for the report: discs and balls unchanged, everything else as polygons between two heights."""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import shapely

from missionc.geometry.configuration_space import Atlas
from missionc.ir import Ball, Box, Disc, Polygon, Prism, Shape, Union, World

Solid: TypeAlias = dict[str, Any]
"""Part of a shape: ``rings`` or ``disc`` with ``low`` and ``high``, or ``ball``; metres."""


def solids(world: World, shape: Shape) -> list[Solid]:
    """Parts of a shape for drawing, which may overlap; heights are clipped to the world."""
    match shape:
        case Box(low, high):
            ring = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]
            return [{"rings": [_short(ring)], **_heights(world, Prism(low[2], high[2]) if len(low) == 3 else None)}]
        case Polygon(corners, band):
            return [{"rings": [_short(corners)], **_heights(world, band)}]
        case Disc(centre, radius, band):
            return [{"disc": [*_short([centre])[0], radius], **_heights(world, band)}]
        case Ball(centre, radius):
            return [{"ball": [*_short([centre])[0], radius]}]
        case Union(left, right):
            return solids(world, left) + solids(world, right)
        case _:
            return _layers(world, shape)


def inner_point(world: World, parts: list[Solid]) -> list[float]:
    """Point in the largest part of a shape, for its name; the middle of the world if the shape is empty."""
    plans = [_plan(part) for part in parts]
    if not plans:
        return [round((low + high) / 2, 3) for low, high in zip(world.low[:2], world.high[:2], strict=True)]
    largest = max(plans, key=lambda plan: plan.area)
    middle = largest.centroid if largest.contains(largest.centroid) else largest.representative_point()
    return [round(middle.x, 3), round(middle.y, 3)]


def _plan(part: Solid) -> Any:
    if "rings" in part:
        outer, *holes = part["rings"]
        return shapely.Polygon(outer, holes)
    round_part = part.get("disc") or part["ball"]
    return shapely.Point(round_part[0], round_part[1]).buffer(round_part[-1])


def _heights(world: World, band: Prism | None) -> dict[str, float]:
    """Lower and upper end of a prism within the world, metres, by name; empty in a plane."""
    if world.dimension == 2:
        return {}
    low, high = (band.low, band.high) if band is not None else (-math.inf, math.inf)
    return {"low": round(max(low, world.low[2]), 3), "high": round(min(high, world.high[2]), 3)}


def _layers(world: World, shape: Shape) -> list[Solid]:
    """Parts of a shape composed of several shapes, one for each layer of constant section."""
    atlas = Atlas.of(world, [shape])
    solids: list[Solid] = []
    for geometry, (low, high) in zip(atlas.outer(shape).geometry(), atlas.heights, strict=True):
        if low == high:
            continue
        for part in shapely.get_parts(geometry):
            if part.geom_type == "Polygon" and part.area > 0:
                fine = part.simplify(1e-3)
                rings = [_short(ring.coords[:-1]) for ring in (fine.exterior, *fine.interiors)]
                solids.append({"rings": rings, **_heights(world, Prism(low, high))})
    return solids


def _short(points: Any) -> list[list[float]]:
    return [[round(float(value), 3) for value in point] for point in points]
