"""A link of a graph: how far two agents are from losing it."""

from __future__ import annotations

import math
from functools import reduce
from typing import assert_never

from missionc.ir import BeaconCover, Graph, Proximity, Sight
from missionc.ir.distances.line_of_sight import clear_line
from missionc.ir.distances.signed_distance import Array, Namespace, distance_between


def link_margin_of(
    xp: Namespace,
    graph: Graph,
    reach: Array,
    first_position: Array,
    second_position: Array,
    floor: float = -math.inf,
) -> Array:
    """How far the first agent is from losing its link to the second: (..., dim) twice -> (...), metres.

    The range of their pair, ``reach``, in metres, a number or (...), minus the
    distance between them; with beacons, what the worse of
    the two has left to the beacon that serves them best; of a sight, the
    clearance of the straight line between them too, where that is less. Linked
    where it is above 0. Of a margin that is at most ``floor`` perhaps only that
    is found, which is sooner.

    Source:
        [strel] ε-proximity and ε-connectivity graphs.
    """
    match graph:
        case Proximity():
            return reach - distance_between(xp, first_position, second_position)
        case Sight(shapes=shapes, room=room):
            spare = reach - distance_between(xp, first_position, second_position)
            return clear_line(xp, shapes, first_position, second_position, spare + room, floor + room) - room
        case BeaconCover():
            return reduce(
                xp.maximum,
                [
                    reach
                    - xp.maximum(
                        distance_between(xp, first_position, beacon), distance_between(xp, second_position, beacon)
                    )
                    for beacon in graph.beacons
                ],
            )
        case _:
            assert_never(graph)
