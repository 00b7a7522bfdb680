"""Margin of a region's name: the agent's centre is in it."""

from __future__ import annotations

from missionc.ir import Region
from missionc.world.signed_distance import Array, Namespace, signed_distance


def margin(xp: Namespace, region: Region, position: Array) -> Array:
    """How far centres are inside a region: (..., dim) -> (...), metres. A centre on the border is in it."""
    return -signed_distance(xp, region.shape, position)
