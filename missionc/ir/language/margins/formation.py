"""Errors of the edges of a formation."""

from __future__ import annotations

from missionc.ir import FormationEdge
from missionc.ir.distances.signed_distance import Array, Namespace, distance_between, length


def edge_error(xp: Namespace, edge: FormationEdge, first_position: Array, second_position: Array) -> Array:
    """Error of a formation edge's distance or offset at agent positions: (..., dim) twice, metres -> (...), metres, at
    least 0."""
    if not isinstance(edge.target, tuple):
        return xp.abs(distance_between(xp, first_position, second_position) - edge.target)
    return length(
        xp,
        [second_position[..., axis] - first_position[..., axis] - offset for axis, offset in enumerate(edge.target)],
    )
