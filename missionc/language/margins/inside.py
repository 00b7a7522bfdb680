"""Margin of ``inside(region)``: the agent's whole body is in it."""

from __future__ import annotations

from missionc.ir import Region
from missionc.world.signed_distance import Array, Namespace, signed_distance


def margin(xp: Namespace, region: Region, radius: Array | float, position: Array) -> Array:
    """How far whole bodies are inside a region.

    Args:
        radius: of the bodies, (...) or one number, metres.
        position: centres, (..., dim), metres.

    Returns:
        (...), metres. A body that touches the border from inside is inside.

    Source:
        [clot] III-C, first class of predicates, for one agent.
    """
    return -signed_distance(xp, region.shape, position) - radius
