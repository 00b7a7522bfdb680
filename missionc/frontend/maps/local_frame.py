"""The local metric frame: conversion of longitude and latitude to metres east and north of a stated origin.

Source:
    Snyder, "Map Projections: A Working Manual" (1987), 25: the azimuthal equidistant projection of the ellipsoid, in
    which every distance from the origin is true. 1 km away, other distances have an error below 1 mm per metre.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeAlias

from missionc.base.source import Source, Span
from missionc.frontend.maps.map_metadata import library

Frame: TypeAlias = Callable[[float, float], tuple[float, float]]


def local_frame(origin: tuple[float, float], source: Source, asked: Span) -> Frame:
    """Function from longitude and latitude, in degrees on WGS 84, to metres east and north of the origin.

    Args:
        origin: longitude and latitude in degrees.

    Raises:
        MapError: the geodesy library is not installed.
    """
    frame: Frame = _projection(origin, source, asked)
    return frame


def geographic(origin: tuple[float, float], source: Source, asked: Span) -> Frame:
    """Function from metres east and north of the origin to longitude and latitude in degrees: inverse of
    ``local_frame``.

    Raises:
        MapError: the geodesy library is not installed.
    """
    return partial(_projection(origin, source, asked), inverse=True)


def _projection(origin: tuple[float, float], source: Source, asked: Span) -> Any:
    pyproj = library("pyproj", "pyproj", source, asked)
    return pyproj.Proj(proj="aeqd", lon_0=origin[0], lat_0=origin[1], ellps="WGS84")
