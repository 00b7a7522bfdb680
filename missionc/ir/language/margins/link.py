"""Margin of one link of a communication graph between two agents."""

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
    """Margin of the link from the first agent to the second: (..., dim) twice, metres -> (...), metres.

    Agents are linked if the margin is positive. The margin is the range of the pair, ``reach`` (metres, a number or
    (...)), minus the distance of the agents. With beacons, it is the smaller of both agents' margins to the best beacon
    for the pair. For a line of sight, it is at most the clearance of the line. A margin of at most ``floor`` may be
    inexact, which is faster.

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
