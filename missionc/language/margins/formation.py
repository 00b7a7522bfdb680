"""Margin of a formation: each edge's error within the tolerance, or their sum where the tolerance is a total."""

from __future__ import annotations

import operator
from functools import reduce

from missionc.ir import Formation, FormationEdge
from missionc.world.signed_distance import Array, Namespace, distance_between, length


def edge_error(xp: Namespace, edge: FormationEdge, first_position: Array, second_position: Array) -> Array:
    """How far two agents are from the distance or offset they keep: (..., dim) twice -> (...), metres, at least 0."""
    if not isinstance(edge.target, tuple):
        return xp.abs(distance_between(xp, first_position, second_position) - edge.target)
    return length(
        xp,
        [second_position[..., axis] - first_position[..., axis] - offset for axis, offset in enumerate(edge.target)],
    )


def margin(xp: Namespace, formation: Formation, position: Array) -> Array:
    """The tolerance minus the largest edge error, or minus their sum where the tolerance is a total.

    Args:
        position: of all the mission's agents, (agents, ..., dim), metres.

    Returns:
        (...), metres.

    Source:
        [clot] III-C, F_form, with absolute errors.
    """
    errors = [edge_error(xp, edge, position[edge.first], position[edge.second]) for edge in formation.edges]
    none = 0.0 * position[0, ..., 0]
    return formation.tolerance - reduce(operator.add if formation.total else xp.maximum, errors, none)
