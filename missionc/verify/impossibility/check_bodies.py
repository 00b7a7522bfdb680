"""Checks of what a certificate says of bodies: that they have no room where it says so.

in   Mission, ClaimedCover
out  what is claimed and cannot be shown, in words

Source:
    Oler, "A finite packing problem", 1961; and Dirichlet's principle, for a box cut into parts too small for two.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations, product

import numpy as np

from missionc.base.trace import Array, Flags
from missionc.ir import Mission, Sight
from missionc.verify.impossibility.bodies import boxes_in, lies_in, name_in_graph, name_of_obstacle
from missionc.verify.impossibility.check_motion import inflated
from missionc.verify.impossibility.cover_document import ClaimedCover
from missionc.verify.impossibility.intervals import Boxes, between, length, must_be_apart, pairwise
from missionc.verify.tolerances import MOTION

MOST_PARTS = 12
"""Parts along each axis, beyond which nobody counts."""


def check_boxes(mission: Mission, cover: ClaimedCover) -> Iterator[str]:
    """That the boxes of a shape lie in it."""
    shapes = {name_of_obstacle(number): each.shape for number, each in enumerate(mission.obstacles)}
    for graph in mission.graphs:
        if isinstance(graph, Sight):
            shapes.update((name_in_graph(graph, number), shape) for number, shape in enumerate(graph.shapes))
    for name in cover.bodies:
        if name not in shapes:
            yield f"the mission has no {name}"
        elif not all(lies_in(box, shapes[name]) for box in boxes_in(name, cover)):
            yield f"a box that is said to lie in {name} does not"


def check_rooms(mission: Mission, cover: ClaimedCover) -> Iterator[str]:
    """That no more agents fit into a box than it is said."""
    pairs = [must_be_apart(mission, one, other) for one, other in combinations(cover.asked, 2)]
    for low, high, most in cover.at_most:
        if not pairs or most < fits([float(side) + 2 * MOTION for side in high - low], min(pairs)):
            yield f"more than {most} agents may be in a box of {' by '.join(f'{side:.4g}' for side in high - low)} m"


def fits(sides: list[float], apart: float) -> float:
    """How many points so far apart fit into a box with these sides, at most."""
    if apart <= 0:
        return math.inf
    widest = apart / math.sqrt(len(sides))
    most = math.prod(math.floor(side / widest) + 1 for side in sides)
    for counts in product(range(1, MOST_PARTS + 1), repeat=len(sides)):
        if math.hypot(*(side / count for side, count in zip(sides, counts, strict=True))) < apart:
            most = min(most, math.prod(counts))
    if len(sides) == 2:
        area, half_round = math.prod(sides) / apart**2, sum(sides) / apart
        most = min(most, math.floor(2 / math.sqrt(3) * area + half_round + 1 + 1e-9))
    return most


def check_pairs(mission: Mission, cover: ClaimedCover, agents: tuple[int, int]) -> Iterator[str]:
    """That two agents are never in two cells at a time: for want of room, or for want of a way there from the start.

    The pairs of cells that are left must hold every start, and whoever leaves one of them for a pair beside it that is
    not left must have no room there.
    """
    never = cover.not_together[agents]
    first, second = (inflated(cover.kind_of(agent)) for agent in agents)
    distance = length(between(*pairwise(first, second)))
    room = distance.high >= must_be_apart(mission, *agents)
    left = ~never
    touch = [_touching(boxes) for boxes in (first, second)]
    beside = (touch[0] @ left.astype(np.float32) > 0) | (left.astype(np.float32) @ touch[1] > 0)
    begins = _starts(mission, cover, agents[0])[:, None] & _starts(mission, cover, agents[1])[None, :]
    for one, other in np.argwhere(never & room & (beside | begins))[:1].tolist():
        names = [mission.agents[agent].name for agent in agents]
        yield f"{names[0]} may be in cell {one} while {names[1]} is in cell {other}"


def _touching(boxes: Boxes) -> Array:
    low, high = boxes
    meet = (low[:, None] <= high[None]) & (low[None] <= high[:, None])
    return np.asarray(np.all(meet, axis=2), dtype=np.float32)


def _starts(mission: Mission, cover: ClaimedCover, agent: int) -> Flags:
    """In which cells it may be at the first step; of the cells round an exact start, its point stands for them."""
    return np.asarray(~cover.absent[agent][0])
