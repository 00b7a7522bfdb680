"""Margin of ``touches(region)``: some part of the agent's body is in it."""

from __future__ import annotations

from missionc.ir import Region
from missionc.world.signed_distance import Array, Namespace, signed_distance


def margin(xp: Namespace, region: Region, radius: Array | float, position: Array) -> Array:
    """How deep bodies reach into a region: (..., dim) -> (...), metres. A body that meets the border touches it.

    ``radius`` is (...) or one number, metres.
    """
    return radius - signed_distance(xp, region.shape, position)
